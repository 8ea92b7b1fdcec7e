// SPDX-License-Identifier: BSD-3-Clause
// The hypervolume of a run's trials over the generations.
"use strict";

const SwarmevoLines = (() => {
  const { element, svg, colour, short, ticks } = SwarmevoCharts;
  const MARGIN = { left: 54, right: 18, top: 14, bottom: 46 };
  const DASHES = ["", "7 3", "2 3", "9 3 2 3"]; // with seven colours, 28 trials before two look alike

  /** Courses as lines: of each trial its number, some generations, and the hypervolume then. */
  class Lines {
    constructor(parent) {
      this.parent = parent;
      this.courses = [];
      this.root = svg("svg", { role: "img" }, parent);
      this.legend = element("ul", "legend", undefined, parent);
      this.tip = element("div", "tip", undefined, parent);
      this.tip.hidden = true;
      this.root.addEventListener("pointermove", (event) => this._say(event));
      this.root.addEventListener("pointerleave", () => this._hush());
      new ResizeObserver(() => this.draw()).observe(parent);
    }

    update(courses) {
      this.courses = courses;
      this.width = 0;
      this._legend();
      this.draw();
    }

    draw() {
      const width = this.parent.clientWidth - 20;
      if (width <= 0 || width === this.width || !this.courses.length) return;
      this.width = width;
      this.height = Math.min(Math.max(0.4 * width, 200), 320);
      this.root.setAttribute("viewBox", `0 0 ${width} ${this.height}`);
      const ends = this.courses.map((one) => `trial ${one.trial} ${short(one.hypervolumes.at(-1))}`);
      this.root.setAttribute("aria-label", `Hypervolume over the generations, now: ${ends.join(", ")}`);
      this.root.replaceChildren();
      this._scales();
      this._axes();
      for (const course of this.courses) this._line(course);
      this.cursor = svg("line", { class: "cursor", y1: MARGIN.top, y2: this.height - MARGIN.bottom, visibility: "hidden" }, this.root);
    }

    _scales() {
      const all = this.courses.flatMap((one) => one.hypervolumes);
      this.last = Math.max(1, ...this.courses.map((one) => one.generations.at(-1)));
      const [low, high] = [Math.min(...all), Math.max(...all)];
      const room = 0.06 * (high - low || Math.abs(high) || 1);
      this.low = Math.max(0, low - room);
      this.high = high + room;
      this.levels = ticks(this.low, this.high, this.height / 36);
      this.left = Math.max(MARGIN.left, 28 + 7 * Math.max(...this.levels.map((value) => short(value).length)));
      this.x = (generation) => this.left + (generation / this.last) * (this.width - this.left - MARGIN.right);
      this.y = (value) => this.height - MARGIN.bottom - ((value - this.low) / (this.high - this.low)) * (this.height - MARGIN.top - MARGIN.bottom);
    }

    _axes() {
      const bottom = this.height - MARGIN.bottom, right = this.width - MARGIN.right;
      for (const value of ticks(0, this.last, Math.max(3, this.width / 90)).filter(Number.isInteger)) {
        svg("line", { class: "grid", x1: this.x(value), x2: this.x(value), y1: MARGIN.top, y2: bottom }, this.root);
        svg("text", { x: this.x(value), y: bottom + 17, "text-anchor": "middle" }, this.root, short(value));
      }
      for (const value of this.levels) {
        svg("line", { class: "grid", x1: this.left, x2: right, y1: this.y(value), y2: this.y(value) }, this.root);
        svg("text", { x: this.left - 8, y: this.y(value) + 4, "text-anchor": "end" }, this.root, short(value));
      }
      const middle = (MARGIN.top + bottom) / 2;
      svg("text", { class: "title", x: (this.left + right) / 2, y: this.height - 8, "text-anchor": "middle" }, this.root, "generation");
      svg("text", { class: "title", x: 0, y: 0, "text-anchor": "middle", transform: `translate(11 ${middle}) rotate(-90)` }, this.root, "hypervolume");
    }

    _line({ trial, generations, hypervolumes }) {
      const at = generations.map((generation, k) => `${this.x(generation).toFixed(1)},${this.y(hypervolumes[k]).toFixed(1)}`);
      const style = `stroke: ${colour(trial)}; stroke-dasharray: ${this._dash(trial)}`;
      svg("path", { class: "line", d: `M${at.join("L")}`, style }, this.root);
      const [x, y] = at.at(-1).split(",");
      svg("circle", { class: "end", cx: x, cy: y, r: 4, style: `fill: ${colour(trial)}` }, this.root);
    }

    _dash(trial) {
      return DASHES[Math.floor(trial / 7) % DASHES.length] || "none";
    }

    _legend() {
      this.legend.replaceChildren();
      for (const { trial, hypervolumes } of this.courses) {
        const entry = element("li", "", undefined, this.legend);
        const icon = svg("svg", { viewBox: "0 0 22 14", "aria-hidden": "true" }, entry);
        svg("path", { class: "line", d: "M1,7H21", style: `stroke: ${colour(trial)}; stroke-dasharray: ${this._dash(trial)}` }, icon);
        entry.append(`trial ${trial}: ${short(hypervolumes.at(-1))}`);
      }
    }

    /** Show the values at the generation that is pointed at. */
    _say(event) {
      if (!this.cursor) return;
      const box = this.root.getBoundingClientRect(), scale = box.width / this.width;
      const x = (event.clientX - box.left) / scale;
      const wanted = Math.round(((x - this.left) / (this.width - this.left - MARGIN.right)) * this.last);
      if (wanted < 0 || wanted > this.last) return void this._hush();
      this.tip.replaceChildren();
      element("b", "", `Generation ${wanted}`, this.tip);
      for (const { trial, generations, hypervolumes } of this.courses) {
        const k = generations.findLastIndex((generation) => generation <= wanted);
        if (k >= 0 && wanted <= generations.at(-1)) element("span", "", `trial ${trial}: ${short(hypervolumes[k])}`, this.tip);
      }
      this.tip.hidden = this.tip.childElementCount < 2;
      this.cursor.setAttribute("x1", this.x(wanted));
      this.cursor.setAttribute("x2", this.x(wanted));
      this.cursor.setAttribute("visibility", "visible");
      const place = 10 + this.x(wanted) * scale;
      const beside = place + 14 + this.tip.offsetWidth < this.parent.clientWidth ? place + 14 : place - 14 - this.tip.offsetWidth;
      this.tip.style.left = `${Math.max(4, beside)}px`;
      this.tip.style.top = "16px";
    }

    _hush() {
      this.tip.hidden = true;
      if (this.cursor) this.cursor.setAttribute("visibility", "hidden");
    }
  }

  return { Lines };
})();
