// SPDX-License-Identifier: BSD-3-Clause
// Plays episodes: moves the scene that meshcat's viewer shows, draws the plots beside it, keeps the time.
//
//   const player = SwarmevoPlayer.mount(element, [episode, ...], {autoplay: false, scene: [...]});
//   player.load([episode]); player.play(); player.pause(); player.seek(t); player.poses(t);
//
// An episode is what swarmevo/views/replay/page.py writes (`data`). Several are shown side by side with one time for all. Times are
// seconds, places metres, headings radians, world frame: x east, y north, z up.
"use strict";

const SwarmevoPlayer = (() => {
  const FORMAT = 1;
  const TRAIL_SECONDS = 25;
  const PLOT_BINS = 300;
  const SPEEDS = [1, 2, 4, 8, 16, 32];
  const WAVE_SECONDS = 2.4; // from the emitter to the end of its range
  const SVG = "http://www.w3.org/2000/svg";

  const THEMES = {
    light: { floor: "#f3f0e8", wall: "#cfd3d6", target: "#86c5bc", reached: "#0fa08f", grid: [0, 0.09], trail: 0.8, ambient: 0.62, key: 0.4 },
    dark: { floor: "#39434c", wall: "#56626c", target: "#2b7f75", reached: "#2fd0bd", grid: [255, 0.06], trail: 0.9, ambient: 0.58, key: 0.48 },
  };

  // ---- small helpers -----------------------------------------------------------------------------------------------

  /** Return a new element. Text is given as text, so nothing in an episode can become markup. */
  function element(tag, className, text, parent) {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    if (parent) parent.append(made);
    return made;
  }

  function svg(tag, attributes, parent) {
    const made = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (parent) parent.append(made);
    return made;
  }

  function bytes(text) {
    return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  }

  function joined(before, after) {
    const all = new after.constructor(before.length + after.length);
    all.set(before);
    all.set(after, before.length);
    return all;
  }

  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const clock = (t) => `${Math.floor(t / 60)}:${(t % 60).toFixed(1).padStart(4, "0")}`;
  const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;

  // ---- an episode ----------------------------------------------------------------------------------------------------

  /** Arrays of all control steps so far, and what is between two of them. */
  class Track {
    constructor(episode) {
      if (episode.format !== FORMAT) throw new Error(`episode: expected format ${FORMAT}, got ${episode.format}`);
      this.episode = episode;
      this.robots = episode.robots;
      this.steps = 0;
      const none = (type) => new type(0);
      this.pose = this.box = this.gap = none(Int16Array);
      this.command = none(Int8Array);
      this.touch = this.rf = this.contact = none(Uint8Array);
      this.terms = episode.terms.map(() => none(Float32Array));
      this.wheels = none(Float32Array); // angles
      for (const chunk of episode.chunks) this.append(chunk);
    }

    append(chunk) {
      const types = { pose: Int16Array, box: Int16Array, gap: Int16Array, command: Int8Array, touch: Uint8Array, rf: Uint8Array, contact: Uint8Array };
      for (const [name, type] of Object.entries(types)) {
        this[name] = joined(this[name], new type(bytes(chunk[name]).buffer));
      }
      this.terms = this.terms.map((term, k) => joined(term, new Float32Array(bytes(chunk.terms[k]).buffer)));
      this.steps += chunk.steps;
      this._turn();
    }

    /** Add up how far the wheels have turned. */
    _turn() {
      const width = 2 * this.robots;
      const angles = new Float32Array(this.steps * width);
      const perStep = (this.episode.robot.speed * this.episode.period) / 127;
      for (let i = width; i < angles.length; i++) angles[i] = angles[i - width] + this.command[i - width] * perStep;
      this.wheels = angles;
    }

    get end() {
      return this.steps * this.episode.period;
    }

    /** Return the last step before t, and how far t is on the way to the next. */
    at(t) {
      const place = clamp(t / this.episode.period, 0, Math.max(this.steps - 1, 0));
      const step = Math.min(Math.floor(place + 1e-6), Math.max(this.steps - 1, 0));
      return { step, next: Math.min(step + 1, Math.max(this.steps - 1, 0)), part: clamp(place - step, 0, 1) };
    }

    _pose(array, from, to, part) {
      const { position, heading } = this.episode.unit;
      let turn = (array[to + 2] - array[from + 2]) * heading;
      if (turn > Math.PI) turn -= 2 * Math.PI;
      if (turn < -Math.PI) turn += 2 * Math.PI;
      return [
        (array[from] + part * (array[to] - array[from])) * position,
        (array[from + 1] + part * (array[to + 1] - array[from + 1])) * position,
        array[from + 2] * heading + part * turn,
      ];
    }

    /** Return every robot's and the box's x, y, heading at t. */
    poses(t) {
      const { step, next, part } = this.at(t);
      const robots = [];
      for (let i = 0; i < this.robots; i++) {
        robots.push(this._pose(this.pose, 3 * (step * this.robots + i), 3 * (next * this.robots + i), part));
      }
      return { robots, box: this._pose(this.box, 3 * step, 3 * next, part) };
    }

    /** Return a wheel's angle; 0 is left, 1 is right. */
    wheel(at, robot, side) {
      const width = 2 * this.robots;
      const from = this.wheels[at.step * width + 2 * robot + side];
      return from + at.part * (this.wheels[at.next * width + 2 * robot + side] - from);
    }

    /** Return the signal's strength S, and its share of the way from silence to the strongest. */
    signal(at, robot) {
      const [least, most] = this.episode.emitter.strength;
      const s = (this.rf[at.step * this.robots + robot] / 255) * most;
      return { s, level: most > least ? clamp((s - least) / (most - least), 0, 1) : 0 };
    }

    touched(at, robot, sensor) {
      return this.touch[4 * (at.step * this.robots + robot) + sensor] / 255;
    }
  }

  // ---- the scene -----------------------------------------------------------------------------------------------------

  const TRAIL_SHADER = {
    vertexShader: `
      attribute float time; varying float when;
      void main() { when = time; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
    fragmentShader: `
      uniform float now; uniform float fade; uniform float strength; uniform vec3 colour; varying float when;
      void main() {
        float age = (now - when) / fade;
        if (age < 0.0 || age > 1.0) discard;
        gl_FragColor = vec4(colour, strength * pow(1.0 - age, 1.4));
      }`,
  };

  /** One episode in meshcat's viewer. */
  class Scene {
    constructor(parent) {
      this.holder = element("div", "sw-view", undefined, parent);
      this.viewer = new MeshCat.Viewer(this.holder);
      this.viewer.gui.domElement.remove();
      this.viewer.set_3d_pane_size = () => this._fill();
      this.viewer.hide_background();
      this.viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.viewer.renderer.localClippingEnabled = true;
      this.viewer.camera.fov = 32;
      for (const name of ["Grid", "Axes"]) this.viewer.set_property([name], "visible", false);
      this._light();
      this.viewer.controls.maxPolarAngle = 1.5; // stay above the floor
      this.viewer.controls.addEventListener("start", () => this._moved(true));
      this.watching = new ResizeObserver(() => this._fill());
      this.watching.observe(this.holder);
      this.follow = null;
    }

    load(track, commands) {
      const { viewer } = this;
      this.track = track;
      for (const name of ["arena", "box", "emitter", "robots", "trails", "start"]) viewer.delete_path([name]);
      for (const command of commands) viewer.handle_command_bytearray(bytes(command));
      const find = (...path) => viewer.scene_tree.find(path).object;
      this.box = find("box");
      this.waves = [0, 1].map((k) => find("emitter", "range", `wave${k}`));
      this.robots = track.episode.colours.map((_, i) => ({
        body: find("robots", `${i}`),
        wheels: ["left", "right"].map((side) => find("robots", `${i}`, side)),
        touch: [0, 1, 2, 3].map((k) => find("robots", `${i}`, "touch", `${k}`)),
        halo: find("robots", `${i}`, "halo"),
      }));
      const { wheel, axle } = track.episode.robot;
      for (const robot of this.robots) {
        robot.wheels.forEach((node, side) => node.position.set(0, (side ? -axle : axle) / 2, wheel));
      }
      this._clip(find("emitter", "range"), track.episode.arena);
      this.fresh();
      this.follow = null;
      this.theme();
      this._moved(false);
      this._fill();
    }

    /** Draw what depends on steps that came since the last time. */
    fresh() {
      this._trails();
      this._start();
    }

    theme() {
      const theme = THEMES[isDark() ? "dark" : "light"];
      const paint = (path, colour) =>
        this.viewer.scene_tree.find(path).object.traverse((node) => node.material && node.material.color.set(colour));
      paint(["arena", "floor"], theme.floor);
      paint(["arena", "walls"], theme.wall);
      const [shade, opacity] = theme.grid;
      this.viewer.scene_tree.find(["arena", "grid"]).object.traverse((node) => {
        if (node.material) [node.material.opacity] = [opacity, node.material.color.setScalar(shade / 255)];
      });
      this.ambient.intensity = theme.ambient;
      this.key.intensity = theme.key;
      for (const trail of this.trails) trail.material.uniforms.strength.value = theme.trail;
      this.colours = theme;
      this.viewer.set_dirty();
    }

    show(t) {
      const { track, viewer } = this;
      if (!track.steps) return;
      const at = track.at(t);
      const { robots, box } = track.poses(t);
      this.box.position.set(box[0], box[1], 0);
      this.box.rotation.set(0, 0, box[2]);
      robots.forEach((pose, i) => this._robot(i, pose, at));
      this.waves.forEach((wave, k) => {
        const phase = (t / WAVE_SECONDS + k / 2) % 1;
        wave.scale.set(phase * track.episode.emitter.range, phase * track.episode.emitter.range, 1);
        wave.traverse((node) => node.material && (node.material.opacity = 0.45 * (1 - phase)));
      });
      for (const trail of this.trails) trail.material.uniforms.now.value = t;
      const reached = track.contact[at.step] > 0;
      for (const name of ["target", "stripe"]) {
        viewer.scene_tree.find(["arena", name]).object.traverse((node) => {
          if (node.material) node.material.color.set(reached ? this.colours.reached : this.colours.target);
        });
      }
      if (this.follow !== null) this._go(robots[this.follow]);
      viewer.set_dirty();
    }

    _robot(i, [x, y, heading], at) {
      const robot = this.robots[i];
      robot.body.position.set(x, y, 0);
      robot.body.rotation.set(0, 0, heading);
      robot.wheels.forEach((wheel, side) => wheel.rotation.set(0, this.track.wheel(at, i, side), 0));
      robot.touch.forEach((arc, k) => {
        const force = this.track.touched(at, i, k);
        arc.visible = force > 0;
        arc.traverse((node) => node.material && (node.material.opacity = 0.35 + 0.65 * force));
      });
      const { level } = this.track.signal(at, i);
      robot.halo.visible = level > 0.01;
      robot.halo.scale.setScalar(0.85 + 0.35 * level);
      robot.halo.traverse((node) => node.material && (node.material.opacity = 0.15 + 0.6 * level));
    }

    /** Return what the scene shows now, as `Track.poses` does. */
    shown() {
      const pose = (node) => [node.position.x, node.position.y, node.rotation.z];
      return { robots: this.robots.map((robot) => pose(robot.body)), box: pose(this.box) };
    }

    // -- parts

    _light() {
      const { THREE } = MeshCat;
      for (const name of ["PointLightNegativeX", "PointLightPositiveX", "FillLight"]) {
        this.viewer.set_property(["Lights", name], "visible", false);
      }
      this.ambient = this.viewer.scene_tree.find(["Lights", "AmbientLight", "<object>"]).object;
      this.key = new THREE.DirectionalLight(0xfffaf2, 0.5);
      this.key.position.set(-0.9, -0.7, 1.9);
      this.key.castShadow = true;
      this.key.shadow.mapSize.set(1024, 1024);
      this.key.shadow.radius = 3;
      this.key.shadow.bias = -0.0004;
      this.viewer.set_object(["Lights", "Key"], this.key);
    }

    /** Keep a node's meshes inside the walls, and the light's shadow on the floor. */
    _clip(node, size) {
      const { THREE } = MeshCat;
      const half = size / 2;
      const planes = [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1]].map((n) => new THREE.Plane(new THREE.Vector3(...n), half));
      node.traverse((mesh) => mesh.material && (mesh.material.clippingPlanes = planes));
      Object.assign(this.key.shadow.camera, { left: -0.8 * size, right: 0.8 * size, top: 0.8 * size, bottom: -0.8 * size, near: 0.1, far: 6 * size });
      this.key.position.set(-0.9 * size, -0.7 * size, 1.9 * size);
      this.key.shadow.camera.updateProjectionMatrix();
    }

    /** Draw every robot's way as a ribbon on the floor, whose shader knows the time. */
    _trails() {
      const { THREE } = MeshCat;
      const { track } = this;
      const width = 0.09 * track.episode.robot.radius;
      this.trails = track.episode.colours.map((colour, i) => {
        const geometry = new THREE.BufferGeometry();
        const place = new Float32Array(6 * track.steps);
        const time = new Float32Array(2 * track.steps);
        const { position } = track.episode.unit;
        let [nx, ny] = [0, 0];
        for (let step = 0; step < track.steps; step++) {
          const here = 3 * (step * track.robots + i);
          const ahead = 3 * (Math.min(step + 1, track.steps - 1) * track.robots + i);
          const [dx, dy] = [track.pose[ahead] - track.pose[here], track.pose[ahead + 1] - track.pose[here + 1]];
          const length = Math.hypot(dx, dy);
          if (length > 8) [nx, ny] = [-dy / length, dx / length]; // else it stands, or trembles
          for (const side of [0, 1]) {
            const offset = (side ? -1 : 1) * width;
            place.set([track.pose[here] * position + offset * nx, track.pose[here + 1] * position + offset * ny, 0.0012 + 0.00002 * i], 3 * (2 * step + side));
            time[2 * step + side] = step * track.episode.period;
          }
        }
        const index = [];
        for (let step = 0; step + 1 < track.steps; step++) {
          const a = 2 * step;
          index.push(a, a + 1, a + 2, a + 1, a + 3, a + 2);
        }
        geometry.setAttribute("position", new THREE.BufferAttribute(place, 3));
        geometry.setAttribute("time", new THREE.BufferAttribute(time, 1));
        geometry.setIndex(index);
        const material = new THREE.ShaderMaterial({
          ...TRAIL_SHADER,
          uniforms: {
            now: { value: 0 },
            fade: { value: TRAIL_SECONDS },
            strength: { value: this.colours ? this.colours.trail : 0.75 },
            colour: { value: new THREE.Color(colour) },
          },
          transparent: true,
          depthWrite: false,
          side: THREE.DoubleSide,
        });
        const mesh = new THREE.Mesh(geometry, material);
        mesh.frustumCulled = false;
        this.viewer.set_object(["trails", `${i}`], mesh);
        return mesh;
      });
    }

    /** Draw a dashed outline where the box stood at the start. */
    _start() {
      const { THREE } = MeshCat;
      if (!this.track.steps || this.box === undefined) return;
      const body = this.viewer.scene_tree.find(["box", "body", "<object>"]).object.geometry.parameters;
      const [w, h] = [body.width / 2, body.height / 2];
      const [x, y, heading] = this.track.poses(0).box;
      const corners = [[w, h], [-w, h], [-w, -h], [w, -h], [w, h]].map(
        ([a, b]) => new THREE.Vector3(x + a * Math.cos(heading) - b * Math.sin(heading), y + a * Math.sin(heading) + b * Math.cos(heading), 0.0014),
      );
      const line = new THREE.Line(
        new THREE.BufferGeometry().setFromPoints(corners),
        new THREE.LineDashedMaterial({ color: 0x9a7440, dashSize: 0.012, gapSize: 0.008 }),
      );
      line.computeLineDistances();
      this.viewer.set_object(["start"], line);
    }

    // -- camera

    _fill() {
      const [width, height] = [this.holder.clientWidth, this.holder.clientHeight];
      if (!width || !height) return;
      this.viewer.renderer.setSize(width, height);
      this.viewer.camera.aspect = width / height;
      this.viewer.camera.updateProjectionMatrix();
      if (!this.moved && this.track) this.look();
      this.viewer.set_dirty();
    }

    /** Look at the whole arena from the south, as near as it fits. The camera's own frame has y upwards. */
    look() {
      const { THREE } = MeshCat;
      const { camera, controls } = this.viewer;
      const half = (this.track.episode.arena / 2) * 1.05;
      const corners = [-half, half].flatMap((x) => [-half, half].flatMap((y) => [0, 0.05].map((z) => new THREE.Vector3(x, z, -y))));
      const [turn, rise] = camera.aspect < 1.1 ? [0, 1.0] : [0, 0.86];
      const direction = new THREE.Vector3(Math.sin(turn) * Math.cos(rise), Math.sin(rise), Math.cos(turn) * Math.cos(rise));
      const target = new THREE.Vector3();
      let distance = 3 * half;
      for (let turn = 0; turn < 12; turn++) {
        camera.position.copy(target).addScaledVector(direction, distance);
        camera.lookAt(target);
        const matrix = new THREE.Matrix4().compose(camera.position, camera.quaternion, new THREE.Vector3(1, 1, 1)).invert();
        const seen = corners.map((corner) => corner.clone().applyMatrix4(matrix).applyMatrix4(camera.projectionMatrix));
        const [low, high] = [Math.min(...seen.map((p) => p.y)), Math.max(...seen.map((p) => p.y))];
        const wide = Math.max(...seen.map((p) => Math.abs(p.x)));
        distance *= Math.max(wide / 0.95, (high - low) / 2 / 0.86);
        target.z -= ((low + high) / 2) * distance * Math.tan((camera.fov * Math.PI) / 360) * 0.8;
      }
      controls.target.copy(target);
      this.follow = null;
      this._moved(false);
      this.viewer.set_dirty();
    }

    /** Come near a robot and stay with it. */
    watch(robot) {
      const { THREE } = MeshCat;
      const { camera, controls } = this.viewer;
      const direction = new THREE.Vector3().subVectors(camera.position, controls.target).normalize();
      camera.position.copy(controls.target).addScaledVector(direction, 16 * this.track.episode.robot.radius);
      this.follow = robot;
      this._moved(true);
    }

    _moved(moved) {
      this.moved = moved;
      if (this.onMove) this.onMove(moved);
    }

    _go([x, y]) {
      const { THREE } = MeshCat;
      const { camera, controls } = this.viewer;
      const step = new THREE.Vector3(x, 0.02, -y).sub(controls.target);
      controls.target.add(step);
      camera.position.add(step);
    }

    close() {
      this.watching.disconnect();
      this.viewer.animate = () => {};
      this.viewer.renderer.dispose();
      this.viewer.renderer.forceContextLoss();
    }
  }

  // ---- plots ---------------------------------------------------------------------------------------------------------

  /** Series over time: those before the cursor strong, those after it faint. A drag moves the time. */
  class Plot {
    constructor(parent, seek) {
      this.root = element("figure", "sw-plot", undefined, parent);
      this.caption = element("figcaption", "", undefined, this.root);
      const frame = element("div", "sw-frame", undefined, this.root);
      this.drawing = svg("svg", { role: "img", preserveAspectRatio: "none" }, frame);
      this.top = element("span", "sw-top", "", frame);
      this.axis = element("div", "sw-axis", undefined, this.root);
      this.seek = seek;
      const drag = (event) => {
        if (event.type === "pointerdown") this.drawing.setPointerCapture(event.pointerId);
        if (!event.buttons || !this.duration) return;
        const { left, width } = this.drawing.getBoundingClientRect();
        this.seek(clamp(((event.clientX - left) / width) * this.duration, 0, this.duration));
      };
      for (const type of ["pointerdown", "pointermove"]) this.drawing.addEventListener(type, drag);
    }

    /** series: [{name, colour, values, unit, digits}]; stacked: one on top of the other. */
    draw(title, series, duration, end, stacked) {
      Object.assign(this, { series, duration, end });
      this.caption.replaceChildren(element("span", "sw-plot-title", title));
      this.readings = series.map(({ name, colour }) => {
        const item = element("span", "sw-reading", undefined, this.caption);
        element("i", "", undefined, item).style.background = colour;
        if (name) item.append(`${name} `);
        return element("b", "", "", item);
      });
      const [width, height] = [PLOT_BINS, 60];
      this.drawing.replaceChildren();
      this.drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
      const clip = `sw-clip-${(Plot.count = (Plot.count || 0) + 1)}`;
      this.past = svg("rect", { x: 0, y: 0, width: 0, height }, svg("clipPath", { id: clip }, this.drawing));
      const bins = series.map(({ values }) => Plot.binned(values));
      const n = bins[0] ? bins[0].length : 0;
      const sums = bins.map((_, k) => Array.from({ length: n }, (_, i) => (stacked ? bins.slice(0, k + 1).reduce((sum, b) => sum + b[i], 0) : bins[k][i])));
      const highest = Math.max(1e-9, ...sums.flat()) * 1.08;
      this.top.textContent = n ? `${(highest / 1.08).toPrecision(2)}${series[0].unit}` : "";
      this._ticks(duration, width, height);
      const x = (i) => ((((i + 0.5) / Math.max(n, 1)) * end) / duration) * width;
      const y = (value) => height - (Math.max(value, 0) / highest) * height;
      for (const place of ["future", "past"]) {
        const group = svg("g", { class: `sw-${place}`, ...(place === "past" ? { "clip-path": `url(#${clip})` } : {}) }, this.drawing);
        sums.forEach((sum, k) => {
          if (!n) return;
          const top = sum.map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(2)}`);
          const under = (k && stacked ? sums[k - 1] : sum.map(() => 0)).map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(2)}`);
          svg("path", { class: "sw-area", fill: series[k].colour, d: `M${top.join("L")}L${under.reverse().join("L")}Z` }, group);
          svg("path", { class: "sw-line", stroke: series[k].colour, d: `M${top.join("L")}` }, group);
        });
      }
      this.cursor = svg("line", { class: "sw-cursor", y1: 0, y2: height }, this.drawing);
    }

    /** Rule and label the time at about four round places. */
    _ticks(duration, width, height) {
      this.axis.replaceChildren();
      const every = [1, 5, 10, 15, 30, 60, 120, 300, 600].find((step) => duration / step <= 4) || duration;
      for (let t = 0; t <= duration + 1e-6; t += every) {
        const x = t / duration;
        if (t > 0 && x < 1) svg("line", { class: "sw-tick", x1: x * width, x2: x * width, y1: 0, y2: height }, this.drawing);
        element("span", "", t + every > duration + 1e-6 ? `${t} s` : `${t}`, this.axis).style.left = `${100 * x}%`;
      }
    }

    static binned(values) {
      const n = Math.min(PLOT_BINS, values.length);
      return Array.from({ length: n }, (_, i) => {
        const part = values.slice(Math.floor((i * values.length) / n), Math.floor(((i + 1) * values.length) / n));
        return part.reduce((sum, value) => sum + value, 0) / part.length;
      });
    }

    show(t, step) {
      const x = (t / this.duration) * PLOT_BINS;
      this.past.setAttribute("width", x);
      this.cursor.setAttribute("x1", x);
      this.cursor.setAttribute("x2", x);
      this.series.forEach(({ values, unit, digits }, k) => {
        this.readings[k].textContent = values.length ? values[Math.min(step, values.length - 1)].toFixed(digits) + unit : "";
      });
    }
  }

  // ---- a stage: one episode with all that belongs to it -----------------------------------------------------------------

  class Stage {
    constructor(parent, player) {
      this.root = element("section", "sw-stage", undefined, parent);
      this.inner = element("div", "sw-inner", undefined, this.root);
      const scene = element("div", "sw-scene", undefined, this.inner);
      this.side = element("aside", "sw-side", undefined, this.inner);
      const title = element("header", "sw-title", undefined, this.side);
      this.title = element("h2", "", undefined, title);
      this.subtitle = element("p", "", undefined, title);
      this.warning = element("p", "sw-warning", undefined, this.side);
      this.facts = element("dl", "sw-facts", undefined, this.side);
      this.plots = [new Plot(this.side, (t) => player.seek(t)), new Plot(this.side, (t) => player.seek(t))];
      this.team = element("div", "sw-team", undefined, this.side);
      try {
        this.scene = new Scene(scene);
      } catch (error) {
        element("p", "sw-no-scene", `The scene needs WebGL, which this browser does not give: ${error.message}`, scene);
      }
      const legend = element("ul", "sw-legend", undefined, scene);
      const named = (name, text) => {
        const item = element("li", "", undefined, legend);
        element("i", `sw-mark-${name}`, undefined, item);
        item.append(text);
        return item;
      };
      named("signal", "RF signal");
      named("touch", "box sensor");
      this.bumper = named("bumper", "bumper");
      named("target", "target wall");
      this.home = element("button", "sw-camera", "whole arena", scene);
      this.home.type = "button";
      this.home.addEventListener("click", () => {
        this.scene.look();
        this._mark(null);
      });
      if (this.scene) this.scene.onMove = (moved) => (this.home.hidden = !moved);
    }

    load(episode, commands) {
      this.track = new Track(episode);
      this.title.textContent = episode.title;
      this.subtitle.textContent = episode.subtitle;
      this.warning.textContent = episode.warning || "";
      this.warning.hidden = !episode.warning;
      this.bumper.hidden = episode.robot.bumper !== "sprung";
      this._facts();
      this._team();
      if (this.scene) this.scene.load(this.track, episode.scene || commands);
      this._plots();
    }

    append(chunk) {
      this.track.append(chunk);
      if (this.scene) this.scene.fresh();
      this._plots();
    }

    finish(outcome) {
      Object.assign(this.track.episode, outcome);
      this._facts();
    }

    _facts() {
      this.facts.replaceChildren();
      for (const [label, value] of this.track.episode.facts || []) {
        const pair = element("div", "", undefined, this.facts);
        element("dt", "", label, pair);
        element("dd", "", value, pair);
      }
    }

    _team() {
      this.team.replaceChildren();
      this.rows = this.track.episode.colours.map((colour, i) => {
        const row = element("button", "sw-robot", undefined, this.team);
        row.type = "button";
        row.title = `follow robot ${i + 1}`;
        element("span", "sw-badge", `${i + 1}`, row).style.setProperty("--robot", colour);
        const meter = element("span", "sw-meter", undefined, row);
        const signal = element("i", "", undefined, meter);
        const touch = element("span", "sw-touch", undefined, row);
        const dots = [0, 1, 2, 3].map(() => element("i", "", undefined, touch));
        const home = element("span", "sw-home", "", row);
        row.addEventListener("click", () => {
          if (!this.scene) return;
          const again = this.scene.follow === i;
          if (again) this.scene.look();
          else this.scene.watch(i);
          this._mark(again ? null : i);
          this.show(this.now);
        });
        return { row, signal, dots, home };
      });
    }

    _mark(robot) {
      this.rows.forEach(({ row }, i) => row.setAttribute("aria-pressed", i === robot));
    }

    _plots() {
      const { track } = this;
      const { episode } = track;
      const style = getComputedStyle(this.root);
      const colour = (name) => style.getPropertyValue(`--sw-${name}`).trim();
      const [terms, gap] = this.plots;
      const colours = [colour("signal"), colour("touch"), colour("target"), colour("ink-soft")];
      terms.root.hidden = episode.terms.length === 0;
      const parts = episode.terms.map((name, k) => ({ name, colour: colours[k % colours.length], values: track.terms[k], unit: "", digits: 1 }));
      terms.draw(`${episode.explained} now`, parts, episode.horizon, track.end, true);
      const distance = Float32Array.from(track.gap, (value) => 100 * value * episode.unit.gap);
      gap.draw("box to target wall", [{ name: "", colour: colour("target"), values: distance, unit: " cm", digits: 1 }], episode.horizon, track.end, false);
    }

    show(t) {
      this.now = t;
      if (this.scene) this.scene.show(t);
      const at = this.track.at(t);
      for (const plot of this.plots) if (!plot.root.hidden) plot.show(Math.min(t, this.track.episode.horizon), at.step);
      if (!this.track.steps) return;
      this.rows.forEach(({ signal, dots, home }, i) => {
        signal.style.width = `${(100 * this.track.signal(at, i).level).toFixed(0)}%`;
        dots.forEach((dot, k) => dot.classList.toggle("sw-on", this.track.touched(at, i, k) > 0));
        const time = (this.track.episode.homing || [])[i];
        const came = time !== null && time !== undefined && time <= t + 1e-6;
        home.textContent = came ? `home at ${time.toFixed(1)} s` : "";
      });
    }

    theme() {
      if (this.scene) this.scene.theme();
      this._plots();
      this.show(this.now || 0);
    }

    close() {
      if (this.scene) this.scene.close();
      this.root.remove();
    }
  }

  // ---- the player ----------------------------------------------------------------------------------------------------

  const ICONS = { play: "M7 4.5v15l12.5-7.5z", pause: "M6.5 4.5h4v15h-4zM13.5 4.5h4v15h-4z" };

  class Player {
    constructor(parent, episodes, options) {
      this.options = options;
      this.stages = [];
      this.speed = options.speed || 4;
      this.time = 0;
      this.playing = false;
      this.root = element("div", "sw-player", undefined, parent);
      this.place = element("div", "sw-stages", undefined, this.root);
      this._transport();
      this.onTheme = () => this.stages.forEach((stage) => stage.theme());
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", this.onTheme);
      this.load(episodes);
      if (options.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
    }

    /** Show other episodes from their start, paused. */
    load(episodes) {
      this.pause();
      while (this.stages.length > episodes.length) this.stages.pop().close();
      while (this.stages.length < episodes.length) this.stages.push(new Stage(this.place, this));
      this.root.classList.toggle("sw-many", episodes.length > 1);
      this.stages.forEach((stage, k) => stage.load(episodes[k], this.options.scene));
      this.duration = Math.max(0, ...episodes.map((episode) => episode.horizon));
      this.slider.max = this.duration;
      this._marks();
      this.seek(0);
    }

    /** Add control steps to an episode that still runs. */
    append(chunk, stage = 0) {
      this.stages[stage].append(chunk);
      this.stages[stage].show(this.time);
    }

    /** Say how an episode that still ran has ended. */
    finish(outcome, stage = 0) {
      this.stages[stage].finish(outcome);
      this._marks();
    }

    /** Say in a stage what is wrong. */
    warn(message, stage = 0) {
      if (!this.stages[stage]) return void element("p", "sw-warning", message, this.place);
      this.stages[stage].warning.textContent = message;
      this.stages[stage].warning.hidden = false;
    }

    /** Return until when there is something to show. */
    get end() {
      return Math.min(this.duration, Math.max(0, ...this.stages.map((stage) => stage.track.end)));
    }

    seek(t) {
      this.time = clamp(t, 0, this.duration);
      for (const stage of this.stages) stage.show(this.time);
      this.slider.value = this.time;
      this.slider.style.setProperty("--done", `${(100 * this.time) / (this.duration || 1)}%`);
      this.slider.setAttribute("aria-valuetext", clock(this.time));
      this.clock.textContent = clock(this.time);
    }

    play() {
      if (this.time >= this.duration) this.seek(0);
      if (this.playing) return;
      this.playing = true;
      this._button();
      let before = performance.now();
      const frame = (now) => {
        if (!this.playing) return;
        const ahead = this.time + (clamp(now - before, 0, 200) / 1000) * this.speed;
        before = now;
        this.seek(Math.min(ahead, this.end));
        if (this.time >= this.duration) {
          this.pause();
          if (this.options.ended) this.options.ended();
        } else requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }

    pause() {
      this.playing = false;
      if (this.button) this._button();
    }

    /** Return for each stage every robot's and the box's x, y, heading at t, as stored. */
    poses(t) {
      return this.stages.map((stage) => stage.track.poses(t));
    }

    /** Return the same as it stands in the scenes now. */
    shown() {
      return this.stages.map((stage) => stage.scene.shown());
    }

    close() {
      this.pause();
      matchMedia("(prefers-color-scheme: dark)").removeEventListener("change", this.onTheme);
      for (const stage of this.stages) stage.close();
      this.root.remove();
    }

    // -- controls

    _transport() {
      const bar = element("div", "sw-transport", undefined, this.root);
      this.button = element("button", "sw-play", undefined, bar);
      this.button.type = "button";
      this.icon = svg("path", {}, svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, this.button));
      this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
      const track = element("div", "sw-track", undefined, bar);
      this.marks = element("div", "sw-marks", undefined, track);
      this.slider = element("input", "sw-slider", undefined, track);
      Object.assign(this.slider, { type: "range", min: 0, max: 1, step: 0.01, value: 0 });
      this.slider.setAttribute("aria-label", "time");
      this.slider.addEventListener("input", () => {
        this.pause();
        this.seek(Number(this.slider.value));
      });
      this.clock = element("output", "sw-clock", "", bar);
      const speed = element("select", "sw-speed", undefined, bar);
      speed.setAttribute("aria-label", "speed");
      for (const times of SPEEDS) element("option", "", `${times}×`, speed).value = times;
      speed.value = this.speed;
      speed.addEventListener("change", () => (this.speed = Number(speed.value)));
      this.root.tabIndex = -1;
      this.root.addEventListener("keydown", (event) => this._key(event));
      this._button();
    }

    _key(event) {
      if (["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName)) return;
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (event.key === " ") this.playing ? this.pause() : this.play();
      else if (step) this.seek(this.time + step);
      else if (event.key === "Home") this.seek(0);
      else return;
      event.preventDefault();
    }

    _button() {
      this.icon.setAttribute("d", ICONS[this.playing ? "pause" : "play"]);
      this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
    }

    /** Mark on the slider when robots came home, in their colours, and when the box touched the wall. */
    _marks() {
      this.marks.replaceChildren();
      const mark = (t, kind, title, colour) => {
        const made = element("i", `sw-${kind}`, undefined, this.marks);
        made.style.left = `${(100 * t) / this.duration}%`;
        made.title = title;
        if (colour) made.style.background = colour;
      };
      for (const { track } of this.stages) {
        const { homing, push, colours } = track.episode;
        if (this.stages.length === 1) (homing || []).forEach((t, i) => t !== null && mark(t, "came", `robot ${i + 1} at the source, ${t.toFixed(1)} s`, colours[i]));
        if (push !== null && push !== undefined) mark(push, "pushed", `box at the wall, ${push.toFixed(1)} s`);
      }
    }
  }

  return { mount: (parent, episodes, options = {}) => new Player(parent, episodes, options) };
})();
