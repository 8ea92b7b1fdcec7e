// SPDX-License-Identifier: BSD-3-Clause
// The player of episodes: moves the scene that meshcat's viewer shows, draws the plots beside it, keeps the time.
//
//   const player = SwarmevoPlayer.mount(element, [episode, ...], {autoplay: false, scene: [...]});
//   player.load([episode]); player.play(); player.pause(); player.seek(t); player.poses(t);
//
// An episode is what swarmevo/views/replay/data.py writes. Several are shown side by side with one time for all. Times
// are seconds, places metres, headings radians, world frame: x east, y north, z up. The files of this folder share one
// function's scope, which shared/page.html.jinja puts around them.

const SPEEDS = [1, 2, 4, 8, 16, 32];
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

  /** Return for each stage every robot's and movable's x, y, heading at t, as stored. */
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

  /** Mark on the slider when robots came home, in their colours, and when all movables had been at a goal. */
  _marks() {
    this.marks.replaceChildren();
    const mark = (t, kind, title, colour) => {
      const made = element("i", `sw-${kind}`, undefined, this.marks);
      made.style.left = `${(100 * t) / this.duration}%`;
      made.title = title;
      if (colour) made.style.background = colour;
    };
    for (const { track } of this.stages) {
      const { homing, push, colours, delivery } = track.episode;
      if (this.stages.length === 1) (homing || []).forEach((t, i) => t !== null && mark(t, "came", `robot ${i + 1} at the source, ${t.toFixed(1)} s`, colours[i]));
      if (push !== null && push !== undefined) mark(push, "pushed", `${delivery}, ${push.toFixed(1)} s`);
    }
  }
}

const mount = (parent, episodes, options = {}) => new Player(parent, episodes, options);
