// SPDX-License-Identifier: BSD-3-Clause
// An episode in meshcat's viewer: robots and movables that move, trails, signals, light and camera.

const TRAIL_SECONDS = 25;
const WAVE_SECONDS = 2.4; // from the emitter to the end of its range
const GREYEST = 0.15; // share of the floor's light that the blackest patch keeps: shadows are seen on it

const THEMES = {
  light: { floor: "#f3f0e8", wall: "#cfd3d6", target: "#86c5bc", reached: "#0fa08f", grid: [0, 0.09], trail: 0.8, ambient: 0.62, key: 0.4 },
  dark: { floor: "#39434c", wall: "#56626c", target: "#2b7f75", reached: "#2fd0bd", grid: [255, 0.06], trail: 0.9, ambient: 0.58, key: 0.48 },
};

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
    for (const name of ["arena", "obstacles", "movables", "goals", "emitters", "robots", "trails", "start", "beams"]) viewer.delete_path([name]);
    for (const command of commands) viewer.handle_command_bytearray(bytes(command));
    const find = (...path) => viewer.scene_tree.find(path).object;
    const { planes } = track.episode.arena;
    this.movables = track.episode.movables.map((_, i) => ({ body: find("movables", `${i}`), top: find("movables", `${i}`, "top") }));
    this.emitters = track.episode.emitters.map((_, i) => ({
      node: find("emitters", `${i}`),
      waves: [0, 1].map((k) => find("emitters", `${i}`, "range", `wave${k}`)),
    }));
    const touch = track.sense("touch");
    const halos = ["rf", "light"].map((device) => track.sense(device)).filter(Boolean);
    this.robots = track.episode.colours.map((_, i) => ({
      body: find("robots", `${i}`),
      wheels: ["left", "right"].map((side) => find("robots", `${i}`, side)),
      touch: Array.from({ length: touch ? touch.count : 0 }, (_node, k) => find("robots", `${i}`, "touch", `${k}`)),
      halos: halos.map((sense) => ({ sense, node: find("robots", `${i}`, "halo", sense.device) })),
    }));
    const { wheel, axle } = track.episode.robot;
    for (const robot of this.robots) {
      robot.wheels.forEach((node, side) => node.position.set(0, (side ? -axle : axle) / 2, wheel));
    }
    this._clip(find("goals"), planes);
    this._clip(find("arena", "patches"), planes);
    track.episode.emitters.forEach((_, i) => this._clip(find("emitters", `${i}`, "range"), planes));
    this._shadows(2 * Math.max(...track.episode.arena.bounds.map(Math.abs)));
    this.beams = new Beams(track);
    viewer.set_object(["beams"], this.beams.mesh);
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
    const paint = (path, colour, grey = 1) =>
      this.viewer.scene_tree.find(path).object.traverse((node) => node.material && node.material.color.set(colour).multiplyScalar(grey));
    const { grey, patches } = this.track.episode.ground;
    paint(["arena", "floor"], theme.floor, GREYEST + (1 - GREYEST) * grey);
    patches.forEach((shade, i) => paint(["arena", "patches", `${i}`], theme.floor, GREYEST + (1 - GREYEST) * shade));
    for (const path of [["arena", "walls"], ["obstacles"]]) paint(path, theme.wall);
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
    const { robots, movables } = track.poses(t);
    movables.forEach((pose, i) => this._movable(i, pose, at));
    robots.forEach((pose, i) => this._robot(i, pose, at));
    this.beams.show(robots, at);
    track.episode.emitters.forEach((emitter, i) => this._emitter(i, emitter, movables, t));
    for (const trail of this.trails) trail.material.uniforms.now.value = t;
    const reached = movables.length > 0 && movables.every((_, i) => track.isAtGoal(at, i));
    viewer.scene_tree.find(["goals"]).object.traverse((node) => {
      if (node.material) node.material.color.set(reached ? this.colours.reached : this.colours.target);
    });
    if (this.follow !== null) this._go(robots[this.follow]);
    viewer.set_dirty();
  }

  _movable(i, [x, y, heading], at) {
    const { body, top } = this.movables[i];
    body.position.set(x, y, 0);
    body.rotation.set(0, 0, heading);
    if (this.movables.length < 2) return; // the goal itself tells of the only one
    const there = this.track.isAtGoal(at, i);
    top.traverse((node) => {
      if (!node.material) return;
      node.material.color.set(there ? this.colours.reached : "#ffffff");
      node.material.opacity = there ? 0.8 : 0.16;
    });
  }

  _emitter(i, emitter, movables, t) {
    const { node, waves } = this.emitters[i];
    let [x, y] = emitter.position;
    if (emitter.rides_on !== null) {
      const [carrierX, carrierY, heading] = movables[emitter.rides_on];
      const [cosine, sine] = [Math.cos(heading), Math.sin(heading)];
      [x, y] = [carrierX + cosine * x - sine * y, carrierY + sine * x + cosine * y];
    }
    node.position.set(x, y, 0);
    waves.forEach((wave, k) => {
      const phase = (t / WAVE_SECONDS + k / 2) % 1;
      wave.scale.set(phase * emitter.range, phase * emitter.range, 1);
      wave.traverse((part) => part.material && (part.material.opacity = 0.45 * (1 - phase)));
    });
  }

  _robot(i, [x, y, heading], at) {
    const robot = this.robots[i];
    robot.body.position.set(x, y, 0);
    robot.body.rotation.set(0, 0, heading);
    robot.wheels.forEach((wheel, side) => wheel.rotation.set(0, this.track.wheel(at, i, side), 0));
    const touched = robot.touch.length ? this.track.readings(at, i, this.track.sense("touch")) : [];
    robot.touch.forEach((arc, k) => {
      arc.visible = touched[k] > 0;
      arc.traverse((node) => node.material && (node.material.opacity = 0.35 + 0.65 * touched[k]));
    });
    for (const { sense, node } of robot.halos) {
      const strength = level(sense, this.track.readings(at, i, sense));
      node.visible = strength > 0.01;
      node.scale.setScalar(0.85 + 0.35 * strength);
      node.traverse((part) => part.material && (part.material.opacity = 0.15 + 0.6 * strength));
    }
  }

  /** Return what the scene shows now, as `Track.poses` does. */
  shown() {
    const pose = (node) => [node.position.x, node.position.y, node.rotation.z];
    return { robots: this.robots.map((robot) => pose(robot.body)), movables: this.movables.map(({ body }) => pose(body)) };
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

  /** Keep a node's meshes on the floor inside the walls; a goal's wall is no part of the floor. */
  _clip(node, walls) {
    const { THREE } = MeshCat;
    const planes = walls.map(([a, b, c]) => new THREE.Plane(new THREE.Vector3(a, 0, -b), c)); // y is up here
    node.traverse((mesh) => {
      if (mesh.material && !mesh.geometry.type.startsWith("Box")) mesh.material.clippingPlanes = planes;
    });
  }

  /** Keep the light's shadow on the floor. */
  _shadows(size) {
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

  /** Draw a dashed outline where each movable stood at the start. */
  _start() {
    const { THREE } = MeshCat;
    if (!this.track.steps) return;
    const start = this.track.poses(0).movables;
    this.track.episode.movables.forEach(({ shape, size }, i) => {
      const [w, h] = [size[0] / 2, size[1] / 2];
      const [x, y, heading] = start[i];
      const round = Array.from({ length: 41 }, (_, k) => [w * Math.cos((k * Math.PI) / 20), w * Math.sin((k * Math.PI) / 20)]);
      const rim = shape === "cylinder" ? round : [[w, h], [-w, h], [-w, -h], [w, -h], [w, h]];
      const points = rim.map(
        ([a, b]) => new THREE.Vector3(x + a * Math.cos(heading) - b * Math.sin(heading), y + a * Math.sin(heading) + b * Math.cos(heading), 0.0014),
      );
      const line = new THREE.Line(
        new THREE.BufferGeometry().setFromPoints(points),
        new THREE.LineDashedMaterial({ color: 0x9a7440, dashSize: 0.012, gapSize: 0.008 }),
      );
      line.computeLineDistances();
      this.viewer.set_object(["start", `${i}`], line);
    });
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
    const [west, east, south, north] = this.track.episode.arena.bounds;
    const [middleX, middleY] = [(west + east) / 2, (south + north) / 2];
    const [halfX, halfY] = [((east - west) / 2) * 1.05, ((north - south) / 2) * 1.05];
    const corners = [-halfX, halfX].flatMap((x) => [-halfY, halfY].flatMap((y) => [0, 0.05].map((z) => new THREE.Vector3(middleX + x, z, -middleY - y))));
    const [turn, rise] = camera.aspect < 1.1 ? [0, 1.0] : [0, 0.86];
    const direction = new THREE.Vector3(Math.sin(turn) * Math.cos(rise), Math.sin(rise), Math.cos(turn) * Math.cos(rise));
    const target = new THREE.Vector3(middleX, 0, -middleY);
    let distance = 3 * Math.max(halfX, halfY);
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
