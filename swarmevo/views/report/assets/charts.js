// SPDX-License-Identifier: BSD-3-Clause
// Charts of runs, for the pages that have some: each run's Pareto front, whose points say what is known of them and can
// be chosen.
"use strict";

const SwarmevoCharts = (() => {
  const SVG = "http://www.w3.org/2000/svg";
  const COLOURS = ["var(--blue)", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442"]; // Okabe and Ito's
  // One more than colours: the pairs of both begin anew after 56 trials only.
  const SHAPES = [
    "M5,0A5,5 0 1 1 -5,0A5,5 0 1 1 5,0Z",
    "M-4.6,-4.6H4.6V4.6H-4.6Z",
    "M0,-6.4L6.4,0L0,6.4L-6.4,0Z",
    "M0,-6L5.8,4.4H-5.8Z",
    "M0,6L5.8,-4.4H-5.8Z",
    "M-2,-5.6H2V-2H5.6V2H2V5.6H-2V2H-5.6V-2H-2Z",
    "M-5.4,-2.8L-2.8,-5.4L0,-2.6L2.8,-5.4L5.4,-2.8L2.6,0L5.4,2.8L2.8,5.4L0,2.6L-2.8,5.4L-5.4,2.8L-2.6,0Z",
    "M0,-6.6L1.8,-2.3L6.4,-2L2.8,0.9L4.1,5.4L0,2.8L-4.1,5.4L-2.8,0.9L-6.4,-2L-1.8,-2.3Z",
  ];
  const MARGIN = { left: 48, right: 18, top: 14, bottom: 46 };

  /** Return a new element. Text is given as text, so nothing in a run can become markup. */
  function element(tag, className, text, parent) {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    if (parent) parent.append(made);
    return made;
  }

  function svg(tag, attributes, parent, text) {
    const made = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    if (parent) parent.append(made);
    return made;
  }

  /** Whether nothing may move unasked. */
  const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
  const colour = (trial) => COLOURS[trial % COLOURS.length];
  const shape = (trial) => SHAPES[trial % SHAPES.length];
  const short = (value) => Number(value.toPrecision(4)).toString();

  /** Return round numbers that cover low to high in about `count` steps. */
  function ticks(low, high, count) {
    const rough = (high - low || 1) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((k) => k * power).find((size) => size >= rough);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(12)));
    return found;
  }

  /** A run's points as a chart. Calls `choose` with the number of the point that was pressed, and the event. */
  class Chart {
    constructor(parent, run, choose) {
      Object.assign(this, { parent, choose, chosen: null, nodes: [] });
      this.root = svg("svg", { role: "group", "aria-label": "Pareto front" }, parent);
      this.legend = element("ul", "legend", undefined, parent);
      this.beyond = element("p", "beyond", undefined, parent);
      this.tip = element("div", "tip", undefined, parent);
      this.tip.hidden = true;
      this.update(run);
      new ResizeObserver(() => this.draw()).observe(parent);
    }

    /** Show the run as it is now: points may have come, gone or moved. */
    update(run, chosen = null) {
      Object.assign(this, { run, chosen, width: 0 });
      const single = run.objectives.length === 1;
      this.places = run.points.map((p) => (single ? [p.trial, p.values[0]] : [p.values[1], p.values[0]]));
      this.titles = [single ? "trial" : run.objectives[1].label, run.objectives[0].label];
      this._legend();
      this.beyond.textContent = run.beyond;
      this.draw();
    }

    draw() {
      const width = this.parent.clientWidth - 20;
      if (width <= 0 || width === this.width) return;
      this.width = width;
      this.height = Math.min(Math.max(0.78 * width, 250), 430);
      const focused = this.nodes.indexOf(document.activeElement), key = this.nodes[focused]?.dataset.key;
      this.nodes = [];
      this.tip.hidden = true;
      this.root.setAttribute("viewBox", `0 0 ${width} ${this.height}`);
      this.root.style.setProperty("--drawn", `${width}px`); // on paper it is no wider, and its letters no larger
      this.root.replaceChildren();
      this._scales();
      this._axes();
      if (this.run.objectives.length === 2) this._staircase();
      this._points();
      if (this.chosen !== null) this.mark(this.chosen, this.beside);
      const again = this.nodes.find((node) => node.dataset.key === key) ?? this.nodes.at(Math.min(focused, this.nodes.length - 1));
      if (focused >= 0) again?.focus(); // if its point is gone, the focus is not
    }

    /** Mark the point that is chosen, and, if there is one, that which is shown beside it. */
    mark(number, beside = null) {
      Object.assign(this, { chosen: number, beside });
      this.nodes.forEach((node, k) => {
        const isShown = k === number || k === beside;
        node.classList.toggle("chosen", isShown);
        node.setAttribute("aria-pressed", isShown);
      });
    }

    _scales() {
      const span = (values) => {
        const [low, high] = [Math.min(...values), Math.max(...values)];
        const room = 0.06 * (high - low || 1);
        return [low - room, high + room];
      };
      this.low = [0, 1].map((axis) => span(this.places.map((place) => place[axis]))[0]);
      this.high = [0, 1].map((axis) => span(this.places.map((place) => place[axis]))[1]);
      this.levels = ticks(this.low[1], this.high[1], this.height / 60);
      this.left = Math.max(MARGIN.left, 28 + 7 * Math.max(...this.levels.map((value) => short(value).length)));
      const part = (axis, value) => (value - this.low[axis]) / (this.high[axis] - this.low[axis]);
      this.x = (value) => this.left + part(0, value) * (this.width - this.left - MARGIN.right);
      this.y = (value) => this.height - MARGIN.bottom - part(1, value) * (this.height - MARGIN.top - MARGIN.bottom);
    }

    _axes() {
      const bottom = this.height - MARGIN.bottom, right = this.width - MARGIN.right;
      const whole = this.places.every(([x]) => Number.isInteger(x));
      for (const value of ticks(this.low[0], this.high[0], Math.max(3, this.width / 80))) {
        if (whole && !Number.isInteger(value)) continue;
        svg("line", { class: "grid", x1: this.x(value), x2: this.x(value), y1: MARGIN.top, y2: bottom }, this.root);
        svg("text", { x: this.x(value), y: bottom + 17, "text-anchor": "middle" }, this.root, short(value));
      }
      for (const value of this.levels) {
        svg("line", { class: "grid", x1: this.left, x2: right, y1: this.y(value), y2: this.y(value) }, this.root);
        svg("text", { x: this.left - 8, y: this.y(value) + 4, "text-anchor": "end" }, this.root, short(value));
      }
      const middle = (MARGIN.top + bottom) / 2;
      svg("text", { class: "title", x: (this.left + right) / 2, y: this.height - 8, "text-anchor": "middle" }, this.root, this.titles[0]);
      svg("text", { class: "title", x: 0, y: 0, "text-anchor": "middle", transform: `translate(11 ${middle}) rotate(-90)` }, this.root, this.titles[1]);
    }

    /** Draw the edge of what the global front dominates, from one end of the axes to the other. */
    _staircase() {
      const [first, second] = this.run.objectives;
      const sign = second.maximise ? -1 : 1;
      const front = this.places.filter((_, k) => this.run.points[k].front).sort((a, b) => sign * (a[0] - b[0]));
      const worst = [second.maximise ? this.low[0] : this.high[0], first.maximise ? this.low[1] : this.high[1]];
      const path = front.map(([x, y]) => `H${this.x(x)}V${this.y(y)}`);
      svg("path", { class: "front", d: `M${this.x(front[0][0])},${this.y(worst[1])}${path.join("")}H${this.x(worst[0])}` }, this.root);
    }

    _points() {
      const order = this.run.points.map((_, k) => k).sort((a, b) => this.run.points[a].front - this.run.points[b].front);
      for (const k of order) {
        const point = this.run.points[k];
        const name = `individual ${point.genome}, trial ${point.trial}: ${this._values(point).join(", ")}`;
        const at = `translate(${this.x(this.places[k][0])} ${this.y(this.places[k][1])})`;
        const node = svg("g", { class: "point", transform: at, tabindex: 0, role: "button", "aria-label": name, "data-point": k, "data-key": `${point.trial}:${point.genome}` }, this.root);
        svg("circle", { class: "halo", r: 14 }, node);
        svg("path", { class: "mark", d: shape(point.trial), style: `fill: ${colour(point.trial)}` }, node);
        if (point.front) svg("circle", { class: "ring", r: 9 }, node);
        svg("circle", { class: "hit", r: 13 }, node);
        node.addEventListener("click", (event) => this.choose(k, event));
        node.addEventListener("keydown", (event) => {
          if (event.key !== "Enter" && event.key !== " ") return;
          event.preventDefault();
          this.choose(k, event);
        });
        for (const event of ["pointerenter", "focus"]) node.addEventListener(event, () => this._say(k));
        for (const event of ["pointerleave", "blur"]) node.addEventListener(event, () => (this.tip.hidden = true));
        this.nodes[k] = node;
      }
    }

    _values(point) {
      return point.values.map((value, k) => `${this.run.objectives[k].name} ${short(value)}`);
    }

    /** Show what is known of a point beside it. */
    _say(k) {
      const point = this.run.points[k];
      this.tip.replaceChildren();
      element("b", "", `Individual ${point.genome}, trial ${point.trial}`, this.tip);
      for (const [name, value] of point.facts.slice(0, this.run.objectives.length + 3)) element("span", "", `${name}: ${value}`, this.tip);
      this.tip.hidden = false;
      const scale = this.root.getBoundingClientRect().width / this.width;
      const x = 10 + this.x(this.places[k][0]) * scale, y = 12 + this.y(this.places[k][1]) * scale;
      const beside = x + 20 + this.tip.offsetWidth < this.parent.clientWidth ? x + 20 : x - 20 - this.tip.offsetWidth;
      this.tip.style.left = `${Math.max(4, beside)}px`;
      this.tip.style.top = `${Math.max(4, Math.min(y - 20, this.parent.clientHeight - this.tip.offsetHeight - 4))}px`;
    }

    _legend() {
      const trials = [...new Set(this.run.points.map((point) => point.trial))].sort((a, b) => a - b);
      this.legend.replaceChildren();
      for (const trial of trials) {
        const entry = element("li", "", undefined, this.legend);
        const icon = svg("svg", { viewBox: "-7 -7 14 14", "aria-hidden": "true" }, entry);
        svg("path", { d: shape(trial), style: `fill: ${colour(trial)}` }, icon);
        entry.append(`trial ${trial}`);
      }
      const entry = element("li", "", undefined, this.legend);
      const icon = svg("svg", { viewBox: "-7 -7 14 14", "aria-hidden": "true" }, entry);
      svg("circle", { r: 5.5, fill: "none", stroke: "currentColor", "stroke-width": 1.3 }, icon);
      entry.append("global front");
    }
  }

  return { Chart, element, svg, colour, short, ticks, isStill };
})();
