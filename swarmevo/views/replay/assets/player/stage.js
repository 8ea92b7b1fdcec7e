// SPDX-License-Identifier: BSD-3-Clause
// A stage: one episode with all that belongs to it, the scene, its caption, plots and robots.

class Stage {
  constructor(parent, player) {
    this.root = element("section", "sw-stage", undefined, parent);
    this.inner = element("div", "sw-inner", undefined, this.root);
    const scene = element("div", "sw-scene", undefined, this.inner);
    this.legend = element("ul", "sw-legend", undefined, this.inner);
    this.side = element("aside", "sw-side", undefined, this.inner);
    const title = element("header", "sw-title", undefined, this.side);
    this.title = element("h2", "", undefined, title);
    this.subtitle = element("p", "", undefined, title);
    this.warning = element("p", "sw-warning", undefined, this.side);
    this.facts = element("dl", "sw-facts", undefined, this.side);
    this.plots = [new Plot(this.side, (t) => player.seek(t)), new Plot(this.side, (t) => player.seek(t))];
    this.team = new Team(this.side, (robot) => this._watch(robot));
    try {
      this.scene = new Scene(scene);
    } catch (error) {
      element("p", "sw-no-scene", `The scene needs WebGL, which this browser does not give: ${error.message}`, scene);
    }
    this.home = element("button", "sw-camera", "whole arena", scene);
    this.home.type = "button";
    this.home.addEventListener("click", () => {
      this.scene.look();
      this.team.mark(null);
    });
    if (this.scene) this.scene.onMove = (moved) => (this.home.hidden = !moved);
  }

  load(episode, commands) {
    this.track = new Track(episode);
    this.title.textContent = episode.title;
    this.subtitle.textContent = episode.subtitle;
    this.warning.textContent = episode.warning || "";
    this.warning.hidden = !episode.warning;
    this._legend();
    this._facts();
    this.team.load(this.track);
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
