// SPDX-License-Identifier: BSD-3-Clause
// The team beside the scene: a row for each robot, with a glyph for each of its devices.

const GLYPHS = {
  /** Wedges round the robot, which looks up; one is amber where a message comes from that has a bit set. */
  rose(sense, parent) {
    const drawing = svg("svg", { class: "sw-round", viewBox: "-12 -12 24 24", "aria-hidden": "true" }, parent);
    svg("circle", { r: 3.6 }, drawing);
    const wedges = sense.yaw.map((yaw) => svg("path", { d: wedge(yaw, Math.min(sense.half, 3.1)) }, drawing));
    return (readings) =>
      wedges.forEach((path, k) => {
        const [value, ...message] = readings.subarray(k * sense.stride, (k + 1) * sense.stride);
        path.style.fillOpacity = (value > 0 ? 0.2 + 0.8 * Math.sqrt(value) : 0).toFixed(2);
        path.classList.toggle("sw-told", message.some((bit) => bit > 0));
      });
  },
  level(sense, parent) {
    const bar = element("i", "", undefined, element("span", "sw-meter", undefined, parent));
    return (readings) => (bar.style.width = `${(100 * level(sense, readings)).toFixed(0)}%`);
  },
  needle(_sense, parent) {
    const drawing = svg("svg", { class: "sw-round", viewBox: "-12 -12 24 24", "aria-hidden": "true" }, parent);
    svg("circle", { r: 10.5 }, drawing);
    const line = svg("line", { x1: 0, y1: 0 }, drawing);
    return ([cosine, sine]) => {
      for (const [name, value] of [["x2", -10.5 * sine], ["y2", -10.5 * cosine]]) line.setAttribute(name, value.toFixed(1));
    };
  },
  greys: (sense, parent) => cells(sense.count, parent, (cell, value) => (cell.style.background = `rgb(${Array(3).fill(Math.round(255 * value))})`)),
  bits: (sense, parent) => cells(sense.count, parent, (cell, value) => cell.classList.toggle("sw-on", value > 0)),
  bars: (sense, parent) =>
    cells(sense.count, parent, (cell, value) => {
      cell.style.setProperty("--from", `${50 + 50 * Math.min(value, 0)}%`);
      cell.style.setProperty("--to", `${50 + 50 * Math.max(value, 0)}%`);
    }),
};

function cells(count, parent, set) {
  const all = Array.from({ length: count }, () => element("i", "", undefined, parent));
  return (readings) => all.forEach((cell, k) => set(cell, readings[k]));
}

/** Return a piece of a ring about the robot, as a path; yaw 0 is up, more is to the left. */
function wedge(yaw, half) {
  const at = (r, angle) => `${(-r * Math.sin(angle)).toFixed(2)} ${(-r * Math.cos(angle)).toFixed(2)}`;
  const [from, to] = [yaw - 0.9 * half, yaw + 0.9 * half];
  const large = to - from > Math.PI ? 1 : 0;
  return `M${at(5, from)}L${at(11.5, from)}A11.5 11.5 0 ${large} 0 ${at(11.5, to)}L${at(5, to)}A5 5 0 ${large} 1 ${at(5, from)}Z`;
}

/** A press on a row calls `watch` with the robot's number. */
class Team {
  constructor(parent, watch) {
    this.root = element("div", "sw-team", undefined, parent);
    this.watch = watch;
  }

  load(track) {
    this.track = track;
    const { senses, colours, homing, at } = track.episode;
    this.root.replaceChildren();
    const heads = element("div", "sw-heads", undefined, this.root);
    element("span", "", "robot", heads);
    const head = element("div", "sw-devices", undefined, heads);
    for (const { name } of senses) element("span", "", name, head);
    if (homing) element("span", "", at, head);
    this.rows = colours.map((colour, i) => {
      const row = element("button", "sw-robot", undefined, this.root);
      row.type = "button";
      row.title = `follow robot ${i + 1}`;
      element("span", "sw-badge", `${i + 1}`, row).style.setProperty("--robot", colour);
      const devices = element("span", "sw-devices", undefined, row);
      const glyphs = senses.map((sense) => {
        const place = element("span", `sw-glyph sw-${sense.glyph} sw-of-${sense.device}`, undefined, devices);
        return GLYPHS[sense.glyph](sense, place);
      });
      const home = homing ? element("span", "sw-home", "", devices) : null;
      row.addEventListener("click", () => this.watch(i));
      return { row, glyphs, home };
    });
  }

  /** Mark the robot that is followed; null: none is. */
  mark(robot) {
    this.rows.forEach(({ row }, i) => row.setAttribute("aria-pressed", i === robot));
  }

  show(t) {
    const { track } = this;
    const { senses, homing } = track.episode;
    const at = track.at(t);
    this.rows.forEach(({ glyphs, home }, i) => {
      glyphs.forEach((draw, k) => draw(track.readings(at, i, senses[k])));
      if (!home) return;
      const time = homing[i];
      home.textContent = time !== null && time <= t + 1e-6 ? `${time.toFixed(1)} s` : "";
    });
  }
}
