// SPDX-License-Identifier: BSD-3-Clause
// An episode in meshcat's viewer: robots and movables that move, trails, signals, light and camera.

const LABEL_HEIGHT = 0.07; // of an emitter's name above it [m]
const LABEL_GAP = 14; // between a name and the emitter that it stands beside or below [pixels]
const WAVE_SECONDS = 2.4; // from the emitter to the end of its range
const GREYEST = 0.15; // share of the floor's light that the blackest patch keeps: shadows are seen on it

const THEMES = {
  light: { floor: "#f3f0e8", wall: "#cfd3d6", target: "#86c5bc", reached: "#0fa08f", grid: [0, 0.09], trail: 0.8, ambient: 0.62, key: 0.4 },
  dark: { floor: "#39434c", wall: "#56626c", target: "#2b7f75", reached: "#2fd0bd", grid: [255, 0.06], trail: 0.9, ambient: 0.58, key: 0.48 },
};

/** Meshcat's viewer, which draws nothing before it has something to draw; `before` is called before each frame. */
class Viewer extends MeshCat.Viewer {
  render() {
    if (!this.before) return;
    this.before();
    super.render();
  }
}

/** One episode in meshcat's viewer; `view` is what of it is wanted to be seen. */
class Scene {
  constructor(parent, view, moved) {
    this.view = view;
    this.holder = element("div", "sw-view", undefined, parent);
    this.viewer = new Viewer(this.holder);
    this.viewer.gui.domElement.remove();
    this.viewer.set_3d_pane_size = () => this._fill();
    this.viewer.hide_background();
    this.viewer.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.viewer.renderer.localClippingEnabled = true;
    for (const name of ["Grid", "Axes"]) this.viewer.set_property([name], "visible", false);
    this._light();
    this.viewer.before = () => {
      this.viewer.controls.update();
      this._face();
    };
    this.camera = new Camera(this.viewer, this.holder, moved);
    this.labels = element("div", "sw-labels", undefined, parent);
    this.watching = new ResizeObserver(() => this._fill());
    this.watching.observe(this.holder);
  }

  load(track, commands) {
    const { viewer } = this;
    this.track = track;
    for (const name of ["arena", "obstacles", "movables", "goals", "emitters", "robots", "trails", "start", "beams"]) viewer.delete_path([name]);
    for (const command of commands) viewer.handle_command_bytearray(bytes(command));
    const find = (...path) => viewer.scene_tree.find(path).object;
    const { planes } = track.episode.arena;
    this.movables = track.episode.movables.map((_, i) => ({ body: find("movables", `${i}`), top: find("movables", `${i}`, "top") }));
    this.labels.replaceChildren();
    this.emitters = track.episode.emitters.map(({ label, position }, i) => ({
      height: position[2],
      label: element("span", "sw-label", label, this.labels),
      node: find("emitters", `${i}`),
      range: find("emitters", `${i}`, "range"),
      waves: [0, 1].map((k) => find("emitters", `${i}`, "range", `wave${k}`)),
    }));
    const touch = track.sense("touch");
    const halos = ["rf", "light"].map((device) => track.sense(device)).filter(Boolean);
    this.robots = track.episode.colours.map((_, i) => ({
      body: find("robots", `${i}`),
      number: find("robots", `${i}`, "number"),
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
    this.theme();
    this.apply();
    this.look();
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
    if (this.follow !== null) this.camera.go(robots[this.follow]);
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

  /** Draw every robot's trail. */
  _trails() {
    const { track, view } = this;
    this.trails = track.episode.colours.map((colour, i) => {
      const mesh = trail(track, i, colour, this.colours ? this.colours.trail : 0.75, view.trail || 1);
      mesh.visible = view.trail > 0;
      this.viewer.set_object(["trails", `${i}`], mesh);
      return mesh;
    });
  }

  /** Draw where each movable stood at the start. */
  _start() {
    if (!this.track.steps) return;
    const start = this.track.poses(0).movables;
    this.track.episode.movables.forEach((movable, i) => this.viewer.set_object(["start", `${i}`], outline(movable, start[i])));
  }

  // -- what is seen of it

  /** Show what is wanted of rays, field and trails, and look from where that is wanted. */
  apply() {
    const { view, camera } = this;
    this.beams.mesh.visible = view.rays;
    for (const { range } of this.emitters) range.visible = view.field;
    for (const mesh of this.trails) {
      mesh.visible = view.trail > 0;
      mesh.material.uniforms.fade.value = view.trail || 1;
    }
    if (camera.fromAbove !== view.above) {
      camera.fromAbove = view.above;
      this.look();
    }
    this.viewer.set_dirty();
  }

  look() {
    this.camera.look(this.track.episode.arena);
  }

  watch(robot) {
    this.camera.watch(robot, this.track.episode.robot.radius);
  }

  get follow() {
    return this.camera.follow;
  }

  /** Return a picture of the scene as it is now; good until the next frame. */
  picture() {
    this.viewer.render();
    return this.viewer.renderer.domElement;
  }

  /** Before each frame: labels are where their emitters are, and robots' numbers stand upright. */
  _face() {
    if (!this.track) return;
    const robots = this.robots.map(({ body }) => this._disc(body.position)).filter(Boolean);
    this.emitters.forEach(({ node, label, height }) => {
      const place = this._beside(node.position, height + LABEL_HEIGHT, label, robots);
      label.hidden = !place;
      if (place) label.style.transform = `translate(${place.map((value) => `${value.toFixed(1)}px`).join(",")})`;
    });
    for (const { body, number } of this.robots) number.rotation.set(0, 0, this.camera.turn - body.rotation.z);
  }

  /** Return where in the view a robot is, and how large: x, y, radius [pixels]; null: nowhere. */
  _disc({ x, y }) {
    const { radius, height } = this.track.episode.robot;
    const [middle, side] = [this.camera.project(x, y, height / 2), this.camera.project(x + radius, y, height / 2)];
    return middle && side && [...middle, Math.hypot(side[0] - middle[0], side[1] - middle[1])];
  }

  /** Return where a label's corner is to be: above its emitter, or, if it covers a robot there, where it covers none. */
  _beside({ x, y }, z, label, robots) {
    const [above, foot] = [this.camera.project(x, y, z), this.camera.project(x, y, 0)];
    if (!above || !foot) return null;
    const [width, height, middle] = [label.offsetWidth, label.offsetHeight, (above[1] + foot[1]) / 2];
    const corners = [
      [above[0] - width / 2, above[1] - height],
      [above[0] + LABEL_GAP, middle - height / 2],
      [above[0] - LABEL_GAP - width, middle - height / 2],
      [foot[0] - width / 2, foot[1] + LABEL_GAP],
    ];
    const isFree = ([left, top]) => robots.every(([cx, cy, r]) => cx + r < left || cx - r > left + width || cy + r < top || cy - r > top + height);
    return corners.find(isFree) || corners[0];
  }

  _fill() {
    const [width, height] = [this.holder.clientWidth, this.holder.clientHeight];
    if (!width || !height) return;
    this.viewer.renderer.setSize(width, height);
    this.viewer.camera.aspect = width / height;
    this.viewer.camera.updateProjectionMatrix();
    if (!this.camera.isMoved && this.track) this.look();
    this.viewer.render(); // at once: another size has emptied the canvas
  }

  close() {
    this.watching.disconnect();
    this.camera.close();
    this.viewer.animate = () => {};
    this.viewer.renderer.dispose();
    this.viewer.renderer.forceContextLoss();
  }
}
