// SPDX-License-Identifier: BSD-3-Clause
// An episode's numbers: decoded, joined as they come, and between control steps.

const FORMAT = 4; // of an episode, data.py

/** Return a signal's share of the way from silence to the strongest; of a light's sectors the brightest counts. */
const level = ({ least = 0, most = 1 }, readings) => (most > least ? clamp((Math.max(...readings) - least) / (most - least), 0, 1) : 0);

/** Arrays of all control steps so far, and what is between two of them. */
class Track {
  constructor(episode) {
    if (episode.format !== FORMAT) throw new Error(`episode: expected format ${FORMAT}, got ${episode.format}`);
    this.episode = episode;
    this.robots = episode.robots;
    this.steps = 0;
    const none = (type) => new type(0);
    this.pose = this.movables = this.gap = none(Int16Array);
    this.command = this.observation = this.hidden = none(Int8Array);
    this.message = this.at_goal = none(Uint8Array);
    this.terms = episode.terms.map(() => none(Float32Array));
    this.wheels = none(Float32Array); // angles
    for (const chunk of episode.chunks) this.append(chunk);
  }

  append(chunk) {
    const types = { pose: Int16Array, movables: Int16Array, gap: Int16Array, command: Int8Array, observation: Int8Array, hidden: Int8Array, message: Uint8Array, at_goal: Uint8Array };
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

  /** Return every robot's and every movable's x, y, heading at t. */
  poses(t) {
    const { step, next, part } = this.at(t);
    const all = (array, n) => Array.from({ length: n }, (_, i) => this._pose(array, 3 * (step * n + i), 3 * (next * n + i), part));
    return { robots: all(this.pose, this.robots), movables: all(this.movables, this.episode.movables.length) };
  }

  isAtGoal(at, movable) {
    return this.at_goal[at.step * this.episode.movables.length + movable] > 0;
  }

  /** Return a wheel's angle; 0 is left, 1 is right. */
  wheel(at, robot, side) {
    const width = 2 * this.robots;
    const from = this.wheels[at.step * width + 2 * robot + side];
    return from + at.part * (this.wheels[at.next * width + 2 * robot + side] - from);
  }

  /** Return what a robot's device reads, in [-1, 1], or the bits that it sends, 0 or 1. */
  readings(at, robot, sense) {
    if (sense.glyph === "bits") {
      const from = sense.count * (at.step * this.robots + robot);
      return this.message.subarray(from, from + sense.count).map((bit) => bit > 0);
    }
    const from = this.episode.observations * (at.step * this.robots + robot) + sense.first;
    return Float32Array.from(this.observation.subarray(from, from + sense.count), (value) => value / 127);
  }

  /** Return all that a robot observes. */
  observed(at, robot) {
    return this._shares(this.observation, at, robot, this.episode.observations);
  }

  /** Return the activations of a robot's hidden neurons, in [-1, 1]; of a team's networks the largest says how many. */
  activations(at, robot) {
    return this._shares(this.hidden, at, robot, this.episode.hidden);
  }

  commands(at, robot) {
    return this._shares(this.command, at, robot, 2);
  }

  /** Return the bits that a robot sends. */
  sent(at, robot) {
    const { message } = this.episode;
    const from = message * (at.step * this.robots + robot);
    return Array.from(this.message.subarray(from, from + message), (bit) => (bit > 0 ? 1 : 0));
  }

  _shares(array, at, robot, n) {
    const from = n * (at.step * this.robots + robot);
    return Array.from(array.subarray(from, from + n), (value) => value / 127);
  }

  sense(device) {
    return this.episode.senses.find((sense) => sense.device === device);
  }
}
