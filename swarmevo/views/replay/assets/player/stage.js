// SPDX-License-Identifier: BSD-3-Clause
// A stage: one episode with all that belongs to it, the scene, its caption, plots and robots.

class Stage {
  constructor(parent, player) {
    this.player = player;
    this.root = element("section", "sw-stage", undefined, parent);
    this.inner = element("div", "sw-inner", undefined, this.root);
    const front = element("div", "sw-front", undefined, this.inner);
    const scene = element("div", "sw-scene", undefined, front);
    this.canvas = scene;
    scene.setAttribute("role", "group");
    this.legend = element("ul", "sw-legend", undefined, front);
    const below = element("div", "sw-below", undefined, front);
    this.side = element("aside", "sw-side", undefined, this.inner);
    const title = element("header", "sw-title", undefined, this.side);
    this.title = element("h2", "", undefined, title);
    this.subtitle = element("p", "", undefined, title);
    this.warning = element("p", "sw-warning", undefined, this.side);
    this.heading = element("h3", "sw-heading", "in this episode", this.side);
    this.facts = element("dl", "sw-facts", undefined, this.side);
    this.events = new Events(this.side, scene, (t) => player.seek(t));
    this.plots = [new Plot(below, (t) => player.seek(t)), new Plot(below, (t) => player.seek(t))];
    this.network = new Network(below);
    this.team = new Team(this.side, (robot) => this._watch(robot));
    this.home = element("button", "sw-camera", "whole arena");
    this.home.type = "button";
    try {
      this.scene = new Scene(scene, player.view, (moved) => (this.home.hidden = !moved));
    } catch (error) {
      element("p", "sw-no-scene", `The scene needs WebGL, which this browser does not give: ${error.message}`, scene);
    }
    scene.append(this.home, this.events.flag);
    this.home.addEventListener("click", () => {
      this.scene.look();
      this.team.mark(null);
    });
  }

  load(episode, commands) {
    this.track = new Track(episode);
    this.title.textContent = episode.title;
    this.subtitle.textContent = episode.subtitle;
    this.warning.textContent = episode.warning || "";
    this.warning.hidden = !episode.warning;
    this._legend();
    this._facts();
    this._name();
    this.events.load(episode);
    this.network.load(this.track);
    this.team.load(this.track);
    if (this.scene) this.scene.load(this.track, episode.scene || commands);
    this._plots();
    this.apply();
  }

  /** Show of it what is wanted. */
  apply() {
    const { view } = this.player;
    this.network.root.hidden = !view.network || this.track.episode.networks.length === 0;
    if (this.scene) this.scene.apply();
    if (this.now !== undefined) this.show(this.now);
  }

  append(chunk) {
    this.track.append(chunk);
    if (this.scene) this.scene.fresh();
    this._plots();
  }

  finish(outcome) {
    Object.assign(this.track.episode, outcome);
    this._facts();
    this.events.load(this.track.episode);
  }

  /** Say what the canvas shows to who does not see it. */
  _name() {
    const { episode } = this.track;
    const team = `${episode.robots} robot${episode.robots > 1 ? "s" : ""}`;
    this.canvas.setAttribute("aria-label", `${episode.title}: ${team} in their arena, in three dimensions`);
  }

  _legend() {
    this.legend.replaceChildren();
    for (const [mark, text] of this.track.episode.legend) {
      const item = element("li", "", undefined, this.legend);
      element("i", `sw-mark-${mark}`, undefined, item);
      item.append(text);
    }
  }

  _facts() {
    this.facts.replaceChildren();
    this.heading.hidden = !(this.track.episode.facts || []).length;
    for (const [label, value] of this.track.episode.facts || []) {
      const pair = element("div", "", undefined, this.facts);
      element("dt", "", label, pair);
      element("dd", "", value, pair);
    }
  }

  _plots() {
    const { track } = this;
    const { episode } = track;
    const style = getComputedStyle(this.root);
    const colour = (name) => style.getPropertyValue(`--sw-${name}`).trim();
    const [terms, gap] = this.plots;
    const colours = [colour("signal"), colour("touch"), colour("target"), colour("ink-soft")];
    terms.root.hidden = episode.terms.length === 0;
    const digits = track.terms.some((term) => term.some((value) => Math.abs(value) >= 2)) ? 1 : 2;
    const parts = episode.terms.map((name, k) => ({ name, colour: colours[k % colours.length], values: track.terms[k], unit: "", digits }));
    terms.draw(`${episode.explained} now`, parts, episode.horizon, track.end, true);
    const distance = Float32Array.from(track.gap, (value) => 100 * value * episode.unit.gap);
    gap.root.hidden = !episode.distance;
    gap.draw(episode.distance, [{ name: "", colour: colour("target"), values: distance, unit: " cm", digits: 1 }], episode.horizon, track.end, false);
  }

  show(t) {
    this.now = t;
    if (this.scene) this.scene.show(t);
    const at = this.track.at(t);
    for (const plot of this.plots) if (!plot.root.hidden) plot.show(Math.min(t, this.track.episode.horizon), at.step);
    if (!this.track.steps) return;
    this.events.show(t, this.player.speed);
    this.network.show(t, (this.scene && this.scene.follow) || 0);
    this.team.show(t);
  }

  /** Follow a robot, or, if it is followed, no longer. */
  _watch(robot) {
    if (!this.scene) return;
    const again = this.scene.follow === robot;
    if (again) this.scene.look();
    else this.scene.watch(robot);
    this.team.mark(again ? null : robot);
    this.show(this.now);
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
