// SPDX-License-Identifier: BSD-3-Clause
// Series over time, beside the scene.

const PLOT_BINS = 300;

/** Series over time: those before the cursor strong, those after it faint. A drag moves the time. */
class Plot {
  constructor(parent, seek) {
    this.root = element("figure", "sw-plot", undefined, parent);
    this.caption = element("figcaption", "", undefined, this.root);
    const frame = element("div", "sw-frame", undefined, this.root);
    this.drawing = svg("svg", { role: "img", preserveAspectRatio: "none" }, frame);
    this.top = element("span", "sw-top", "", frame);
    this.axis = element("div", "sw-axis", undefined, this.root);
    this.seek = seek;
    const drag = (event) => {
      if (event.type === "pointerdown") this.drawing.setPointerCapture(event.pointerId);
      if (!event.buttons || !this.duration) return;
      const { left, width } = this.drawing.getBoundingClientRect();
      this.seek(clamp(((event.clientX - left) / width) * this.duration, 0, this.duration));
    };
    for (const type of ["pointerdown", "pointermove"]) this.drawing.addEventListener(type, drag);
  }

  /** series: [{name, colour, values, unit, digits}]; stacked: one on top of the other. */
  draw(title, series, duration, end, stacked) {
    Object.assign(this, { series, duration, end });
    this.drawing.setAttribute("aria-label", `${title}, over the time`);
    this.caption.replaceChildren(element("span", "sw-plot-title", title));
    this.readings = series.map(({ name, colour }) => {
      const item = element("span", "sw-reading", undefined, this.caption);
      element("i", "", undefined, item).style.background = colour;
      if (name) item.append(`${name} `);
      return element("b", "", "", item);
    });
    const [width, height] = [PLOT_BINS, 60];
    this.drawing.replaceChildren();
    this.drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const clip = `sw-clip-${(Plot.count = (Plot.count || 0) + 1)}`;
    this.past = svg("rect", { x: 0, y: 0, width: 0, height }, svg("clipPath", { id: clip }, this.drawing));
    const bins = series.map(({ values }) => Plot.binned(values));
    const n = bins[0] ? bins[0].length : 0;
    const sums = bins.map((_, k) => Array.from({ length: n }, (_, i) => (stacked ? bins.slice(0, k + 1).reduce((sum, b) => sum + b[i], 0) : bins[k][i])));
    const most = Math.max(0, ...sums.flat());
    const highest = 1.08 * (most || 1);
    this.top.textContent = n ? `${Number(most.toPrecision(2))}${series[0].unit}` : "";
    this._ticks(duration, width, height);
    const x = (i) => ((((i + 0.5) / Math.max(n, 1)) * end) / duration) * width;
    const y = (value) => height - (Math.max(value, 0) / highest) * height;
    for (const place of ["future", "past"]) {
      const group = svg("g", { class: `sw-${place}`, ...(place === "past" ? { "clip-path": `url(#${clip})` } : {}) }, this.drawing);
      sums.forEach((sum, k) => {
        if (!n) return;
        const top = sum.map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(2)}`);
        const under = (k && stacked ? sums[k - 1] : sum.map(() => 0)).map((value, i) => `${x(i).toFixed(1)},${y(value).toFixed(2)}`);
        svg("path", { class: "sw-area", fill: series[k].colour, d: `M${top.join("L")}L${under.reverse().join("L")}Z` }, group);
        svg("path", { class: "sw-line", stroke: series[k].colour, d: `M${top.join("L")}` }, group);
      });
    }
    this.cursor = svg("line", { class: "sw-cursor", y1: 0, y2: height }, this.drawing);
  }

  /** Rule and label the time at about four round places. */
  _ticks(duration, width, height) {
    this.axis.replaceChildren();
    const every = [1, 5, 10, 15, 30, 60, 120, 300, 600].find((step) => duration / step <= 4) || duration;
    for (let t = 0; t <= duration + 1e-6; t += every) {
      const x = t / duration;
      if (t > 0 && x < 1) svg("line", { class: "sw-tick", x1: x * width, x2: x * width, y1: 0, y2: height }, this.drawing);
      element("span", "", t + every > duration + 1e-6 ? `${t} s` : `${t}`, this.axis).style.left = `${100 * x}%`;
    }
  }

  static binned(values) {
    const n = Math.min(PLOT_BINS, values.length);
    return Array.from({ length: n }, (_, i) => {
      const part = values.slice(Math.floor((i * values.length) / n), Math.floor(((i + 1) * values.length) / n));
      return part.reduce((sum, value) => sum + value, 0) / part.length;
    });
  }

  show(t, step) {
    const x = (t / this.duration) * PLOT_BINS;
    this.past.setAttribute("width", x);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.series.forEach(({ values, unit, digits }, k) => {
      this.readings[k].textContent = values.length ? values[Math.min(step, values.length - 1)].toFixed(digits) + unit : "";
    });
  }
}
