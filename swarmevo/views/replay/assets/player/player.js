// SPDX-License-Identifier: BSD-3-Clause
// The player of episodes: moves the scene that meshcat's viewer shows, draws the plots beside it, keeps the time.
//
//   const player = SwarmevoPlayer.mount(element, [episode, ...], {autoplay: false, scene: [...], place: () => "..."});
//   player.load([episode]); player.play(); player.pause(); player.seek(t); player.poses(t);
//
// `place` says which episodes these are, for a link, which there is only with it; `scene` is what all share. An episode is what swarmevo/views/replay/data.py writes. Several are shown side by side with one time for all. Times
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
    this.view = { rays: true, field: true, network: false, above: false, trail: 25 };
    this.root = element("div", "sw-player", undefined, parent);
    this.place = element("div", "sw-stages", undefined, this.root);
    this._transport();
    this.onTheme = () => this.stages.forEach((stage) => stage.theme());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", this.onTheme);
    this.load(episodes);
    Keys.add(this);
    if (options.autoplay && !isStill()) this.play();
  }

  /** Show other episodes from their start, paused. */
  load(episodes) {
    this.pause();
    while (this.stages.length > episodes.length) this.stages.pop().close();
    while (this.stages.length < episodes.length) this.stages.push(new Stage(this.place, this));
    this.root.classList.toggle("sw-one", episodes.length === 1);
    this.root.classList.toggle("sw-many", episodes.length > 1);
    this.stages.forEach((stage, k) => stage.load(episodes[k], this.options.scene));
    this.duration = Math.max(0, ...episodes.map((episode) => episode.horizon));
    this.slider.max = this.duration;
    this.menu.load(episodes);
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

  /** Return what happens in the episodes. */
  get events() {
    return this.stages.flatMap(({ track }) => eventsOf(track.episode));
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
    this.menu.close();
    Keys.remove(this);
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
    const tools = { above: () => this._above(), picture: () => this._save(), link: () => this._link(), full: () => this._full() };
    this.menu = new Menu(bar, this.view, () => this._apply(), tools);
    this.menu.buttons.link.hidden = !this.options.place; // of a page whose address means something else
    this.root.tabIndex = -1;
    this._button();
  }

  _apply() {
    for (const stage of this.stages) stage.apply();
  }

  _above() {
    this.view.above = !this.view.above;
    this.menu.buttons.above.setAttribute("aria-pressed", this.view.above);
    this._apply();
  }

  /** Return the scenes as they are now, side by side, on a canvas. */
  picture() {
    const drawn = this.stages.filter(({ scene }) => scene).map(({ scene }) => scene.picture());
    const canvas = document.createElement("canvas");
    canvas.width = drawn.reduce((sum, { width }) => sum + width, 0);
    canvas.height = Math.max(0, ...drawn.map(({ height }) => height));
    const context = canvas.getContext("2d");
    context.fillStyle = getComputedStyle(this.root).getPropertyValue("--sw-sky");
    context.fillRect(0, 0, canvas.width, canvas.height);
    let x = 0;
    for (const one of drawn) {
      context.drawImage(one, x, 0);
      x += one.width;
    }
    return canvas;
  }

  _save() {
    const link = element("a", "");
    link.href = this.picture().toDataURL("image/png");
    const name = this.stages.map(({ track }) => track.episode.title).join(" ").replace(/[^\w.-]+/g, "-");
    link.download = `${name}-${this.time.toFixed(1)}s.png`;
    link.click();
    this.menu.say("saved");
  }

  /** Put where we are into the page's address, and that onto the clipboard. */
  async _link() {
    const place = this.options.place();
    try {
      history.replaceState(null, "", `#${place ? `${place}&` : ""}t=${this.time.toFixed(1)}`);
      await navigator.clipboard.writeText(location.href);
      this.menu.say("copied");
    } catch {
      this.menu.say("it is in the address bar");
    }
  }

  _full() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.root.requestFullscreen();
  }

  _button() {
    this.icon.setAttribute("d", ICONS[this.playing ? "pause" : "play"]);
    this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
  }

  /** Mark on the slider when robots had homed in, in their colours, and when all movables had been at a goal. */
  _marks() {
    this.marks.replaceChildren();
    const mark = (t, kind, title, colour) => {
      const made = element("i", `sw-${kind}`, undefined, this.marks);
      made.style.left = `${(100 * t) / this.duration}%`;
      made.title = title;
      if (colour) made.style.background = colour;
    };
    const isAlone = this.stages.length === 1;
    for (const { track } of this.stages) {
      for (const { time, text, colour } of eventsOf(track.episode)) {
        if (isAlone || !colour) mark(time, colour ? "came" : "pushed", `${text}, ${time.toFixed(1)} s`, colour);
      }
    }
  }
}

const mount = (parent, episodes, options = {}) => new Player(parent, episodes, options);
