// SPDX-License-Identifier: BSD-3-Clause
// What robots sense at a distance, in the scene: infrared rays that meet something, and who hears whom.

const BEAM_WIDTH = 0.002; // of the arena's extent
const BEAM_COLOURS = { infrared: [0.84, 0.37, 0], heard: [0.17, 0.48, 0.74], message: [1, 0.69, 0] };

const BEAM_SHADER = {
  vertexShader: `
    attribute vec4 colour; varying vec4 shade;
    void main() { shade = colour; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
  fragmentShader: `
    varying vec4 shade;
    void main() { gl_FragColor = shade; }`,
};

/** Ribbons, anew at each moment. Whoever hears another draws half the way to it: both ways make a whole line. */
class Beams {
  constructor(track) {
    const { THREE } = MeshCat;
    this.track = track;
    this.infrared = track.sense("infrared");
    this.heard = track.sense("range_and_bearing");
    const most = track.robots * [this.infrared, this.heard].reduce((sum, sense) => sum + (sense ? sense.yaw.length : 0), 0);
    const attribute = (size) => new THREE.BufferAttribute(new Float32Array(4 * size * most), size);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", attribute(3));
    this.geometry.setAttribute("colour", attribute(4));
    this.geometry.setIndex(Array.from({ length: most }, (_, n) => [0, 1, 2, 1, 3, 2].map((k) => 4 * n + k)).flat());
    const material = new THREE.ShaderMaterial({ ...BEAM_SHADER, transparent: true, depthWrite: false });
    this.mesh = new THREE.Mesh(this.geometry, material);
    this.mesh.frustumCulled = false;
    const { bounds } = track.episode.arena;
    this.width = BEAM_WIDTH * Math.max(bounds[1] - bounds[0], bounds[3] - bounds[2]);
  }

  /** Show what robots at these poses sense at a step. */
  show(robots, at) {
    this.count = 0;
    const then = this.track.poses(at.step * this.track.episode.period).robots; // when they sensed
    robots.forEach((pose, i) => {
      if (this.infrared) this._rays(pose, this.track.readings(at, i, this.infrared));
      if (this.heard) this._ears(robots, i, this.hears(i, then), this.track.readings(at, i, this.heard));
    });
    this.geometry.setDrawRange(0, 6 * this.count);
    for (const name of ["position", "colour"]) this.geometry.attributes[name].needsUpdate = true;
  }

  _rays([x, y, heading], readings) {
    const { yaw } = this.infrared;
    const { radius, height } = this.track.episode.robot;
    readings.forEach((reading, k) => {
      if (reading <= 0) return;
      const [dx, dy] = [Math.cos(heading + yaw[k]), Math.sin(heading + yaw[k])];
      const end = radius + this.reach(reading);
      this._beam([x + radius * dx, y + radius * dy], [x + end * dx, y + end * dy], height / 2, BEAM_COLOURS.infrared, 1);
    });
  }

  /** Return how far away is what an infrared ray reads so much of [m]. */
  reach(reading) {
    const { curve } = this.infrared;
    const next = curve.findIndex(([, least]) => reading >= least);
    if (next < 1) return next === 0 ? 0 : curve[curve.length - 1][0];
    const [[near, most], [far, least]] = [curve[next - 1], curve[next]];
    return near + ((most - reading) / (most - least)) * (far - near);
  }

  _ears(robots, i, others, readings) {
    const { stride } = this.heard;
    const { radius, height } = this.track.episode.robot;
    others.forEach((other, sector) => {
      if (other === null) return;
      const [[x, y], [toX, toY]] = [robots[i], robots[other]];
      const told = readings.subarray(sector * stride + 1, (sector + 1) * stride).some((bit) => bit > 0);
      const share = Math.min(radius / (Math.hypot(toX - x, toY - y) || 1), 0.5);
      const start = [x + share * (toX - x), y + share * (toY - y)];
      this._beam(start, [(x + toX) / 2, (y + toY) / 2], height, told ? BEAM_COLOURS.message : BEAM_COLOURS.heard, told ? 0.95 : 0.6);
    });
  }

  /** Return for each sector of a robot which of the robots it hears, the nearest in range; null: none. */
  hears(i, robots) {
    const { range, yaw } = this.heard;
    const [x, y, heading] = robots[i];
    const nearest = yaw.map(() => [null, range]);
    robots.forEach(([toX, toY], other) => {
      const distance = Math.hypot(toX - x, toY - y);
      const turns = (Math.atan2(toY - y, toX - x) - heading) / (2 * Math.PI) + 0.5 / yaw.length;
      const sector = Math.min(Math.floor((turns - Math.floor(turns)) * yaw.length), yaw.length - 1);
      if (other !== i && distance < nearest[sector][1]) nearest[sector] = [other, distance];
    });
    return nearest.map(([other]) => other);
  }

  _beam([x, y], [toX, toY], z, colour, strength) {
    const { position, colour: shade } = this.geometry.attributes;
    const length = Math.hypot(toX - x, toY - y) || 1;
    const [nx, ny] = [((y - toY) / length) * (this.width / 2), ((toX - x) / length) * (this.width / 2)];
    const corners = [[x + nx, y + ny], [x - nx, y - ny], [toX + nx, toY + ny], [toX - nx, toY - ny]];
    corners.forEach(([cornerX, cornerY], k) => {
      position.setXYZ(4 * this.count + k, cornerX, cornerY, z);
      shade.setXYZW(4 * this.count + k, ...colour, strength);
    });
    this.count++;
  }
}
