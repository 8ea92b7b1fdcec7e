// SPDX-License-Identifier: BSD-3-Clause
// A robot's network as it works: what comes in, what its neurons make of it, what goes out.

const NETWORK_ROW = 13; // pixels, the same as the drawing's units
const NETWORK_WIDE = 296;
const NETWORK_COLUMNS = { inputs: 78, hidden: 160, outputs: 236 };

/** Activations of one robot's network; blue is above 0, vermilion below, the stronger the fuller. */
class Network {
  constructor(parent) {
    this.root = element("figure", "sw-network", undefined, parent);
    const caption = element("figcaption", "", undefined, this.root);
    this.title = element("span", "sw-plot-title", "", caption);
    this.drawing = svg("svg", { role: "img", "aria-label": "network" }, this.root);
  }

  load(track) {
    this.track = track;
    this.robot = null;
  }

  /** Draw a robot's network anew. */
  _draw(robot) {
    this.robot = robot;
    const { networks } = this.track.episode;
    const net = networks[Math.min(robot, networks.length - 1)];
    this.net = net;
    const rows = Math.max(net.inputs.length, net.hidden.length, net.outputs.length);
    const height = NETWORK_ROW * rows + 4;
    this.title.textContent = `network of robot ${robot + 1} now`;
    this.drawing.setAttribute("viewBox", `0 0 ${NETWORK_WIDE} ${height}`);
    this.drawing.setAttribute("aria-label", `network of robot ${robot + 1}: ${net.inputs.length} inputs, ${net.hidden.length} hidden neurons, ${net.outputs.length} outputs`);
    this.drawing.replaceChildren();
    const place = (column, n) => (k) => [NETWORK_COLUMNS[column], height / 2 + (k - (n - 1) / 2) * Math.min((height - 12) / Math.max(n - 1, 1), 3 * NETWORK_ROW)];
    const columns = Object.fromEntries(Object.keys(NETWORK_COLUMNS).map((name) => [name, place(name, net[name].length)]));
    const most = Math.max(1e-9, ...net.links.map(([, , , , weight]) => Math.abs(weight)));
    this.links = net.links.map(([from, i, to, j, weight]) => {
      const isRemembered = to === "hidden" && from !== "inputs";
      const d = (isRemembered ? bent : straight)(columns[from](i), columns[to](j));
      const line = svg("path", { d, fill: "none", "stroke-width": 0.4 + (2.2 * Math.abs(weight)) / most }, this.drawing);
      if (isRemembered) line.setAttribute("stroke-dasharray", "4 2");
      return { line, from, i, weight: weight / most, isRemembered };
    });
    this.nodes = Object.keys(NETWORK_COLUMNS).map((name, column) =>
      net[name].map((label, k) => {
        const [cx, cy] = columns[name](k);
        const node = svg("circle", { cx, cy, r: 4.6 }, this.drawing);
        const [x, anchor] = [[cx - 8, "end"], [cx, "middle"], [cx + 8, "start"]][column];
        const text = svg("text", { x, y: cy + (column === 1 ? -7 : 3.4), "text-anchor": anchor }, this.drawing);
        text.textContent = label;
        return node;
      }),
    );
  }

  show(t, robot) {
    if (this.root.hidden || !this.track.steps) return;
    if (this.robot !== robot) this._draw(robot);
    const at = this.track.at(t);
    const values = this._values(at, robot);
    const before = at.step > 0 && this.links.some(({ isRemembered }) => isRemembered) ? this._values({ step: at.step - 1 }, robot) : null;
    Object.values(values).forEach((of, column) => this.nodes[column].forEach((node, i) => paint(node, "fill", of[i])));
    for (const { line, from, i, weight, isRemembered } of this.links) {
      const heard = isRemembered ? (before?.[from][i] ?? 0) : values[from][i];
      paint(line, "stroke", weight * heard, 0.1);
    }
  }

  /** Return the values of inputs, hidden neurons and outputs, in [-1, 1] or nearly. */
  _values(at, robot) {
    const { track, net } = this;
    const inputs = track.observed(at, robot);
    const bias = net.inputs.length > inputs.length ? [1] : [];
    const outputs = [...track.commands(at, robot), ...track.sent(at, robot)];
    return { inputs: [...inputs, ...bias], hidden: track.activations(at, robot), outputs };
  }
}

/** Return the path of a link between two places. */
function straight([x1, y1], [x2, y2]) {
  return `M${x1} ${y1}L${x2} ${y2}`;
}

/** Return the path of a link of memory: a bow, or a ring around a neuron that hears itself. */
function bent([x1, y1], [x2, y2]) {
  if (x1 === x2 && y1 === y2) return `M${x1 - 7.5} ${y1}a7.5 7.5 0 1 0 15 0a7.5 7.5 0 1 0 -15 0`;
  const bow = x1 === x2 ? 0.35 : 0.2;
  return `M${x1} ${y1}Q${(x1 + x2) / 2 + bow * (y2 - y1)} ${(y1 + y2) / 2 + bow * (x1 - x2)} ${x2} ${y2}`;
}

/** Give an element the colour of a value in [-1, 1]. */
function paint(node, what, value, least = 0.06) {
  node.style[what] = value >= 0 ? "var(--sw-excites)" : "var(--sw-inhibits)";
  node.style[`${what}Opacity`] = clamp(least + (1 - least) * Math.abs(value), least, 1).toFixed(2);
}
