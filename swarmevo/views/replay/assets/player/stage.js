// SPDX-License-Identifier: BSD-3-Clause
// A stage: one episode with all that belongs to it, the scene, its caption, plots and robots.

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
    this.legend = element("ul", "sw-legend", undefined, scene);
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
    this._legend();
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
      const dots = Array.from({ length: this.track.episode.robot.touch }, () => element("i", "", undefined, touch));
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
    gap.root.hidden = !episode.distance;
    gap.draw(episode.distance, [{ name: "", colour: colour("target"), values: distance, unit: " cm", digits: 1 }], episode.horizon, track.end, false);
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
