// SPDX-License-Identifier: BSD-3-Clause
// What of a scene is shown, and what can be done with it: from above, a picture, full screen, a link.

const TRAILS = [[0, "no trails"], [5, "trails of 5 s"], [25, "trails of 25 s"], [Infinity, "whole trails"]];
const TOOLS = {
  above: { name: "from above", icon: "M4 4h16v16H4zM4 9.3h16M4 14.6h16M9.3 4v16M14.6 4v16" },
  picture: { name: "save a picture", icon: "M4 8h3.5L9 5.5h6L16.5 8H20v11H4zM12 10a3.3 3.3 0 1 0 0 6.6a3.3 3.3 0 1 0 0-6.6" },
  link: { name: "copy a link to this moment", icon: "M10 14l4-4M8.5 11l-2.3 2.3a3.2 3.2 0 0 0 4.5 4.5L13 15.5M15.5 13l2.3-2.3a3.2 3.2 0 0 0-4.5-4.5L11 8.5" },
  full: { name: "full screen", icon: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5" },
};

/** Toggles and tools of a player. `view` is changed, then `apply` is called; `tools` are functions by name. */
class Menu {
  constructor(parent, view, apply, tools) {
    Object.assign(this, { view, apply });
    const bar = element("div", "sw-tools", undefined, parent);
    this.buttons = Object.fromEntries(Object.entries(TOOLS).map(([name, tool]) => [name, this._tool(tool, tools[name], bar)]));
    this.buttons.full.hidden = !document.fullscreenEnabled;
    this.root = element("details", "sw-menu", undefined, bar);
    element("summary", "", "show", this.root);
    this.panel = element("div", "sw-panel", undefined, this.root);
    this.boxes = { rays: this._box("rays", "rays and messages"), field: this._box("field", "signal field"), network: this._box("network", "network at work") };
    this._trails();
    this.said = element("output", "sw-said", "", bar);
    this.escape = (event) => {
      if (event.key !== "Escape" || !this.root.open) return;
      this.root.open = false;
      this.root.firstChild.focus();
    };
    document.addEventListener("keydown", this.escape);
    this.outside = (event) => this.root.contains(event.target) || (this.root.open = false);
    document.addEventListener("pointerdown", this.outside);
  }

  _tool({ name, icon }, act, bar) {
    const button = element("button", "sw-tool", undefined, bar);
    button.type = "button";
    button.title = name;
    button.setAttribute("aria-label", name);
    svg("path", { d: icon }, svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, button));
    button.addEventListener("click", act);
    return button;
  }

  _box(name, text) {
    const label = element("label", "", undefined, this.panel);
    const box = element("input", "", undefined, label);
    Object.assign(box, { type: "checkbox", checked: this.view[name] });
    label.append(` ${text}`);
    box.addEventListener("change", () => {
      this.view[name] = box.checked;
      this.apply();
    });
    return { label, box };
  }

  _trails() {
    const select = element("select", "sw-trails", undefined, this.panel);
    select.setAttribute("aria-label", "trails");
    for (const [seconds, text] of TRAILS) element("option", "", text, select).value = seconds;
    select.value = this.view.trail;
    select.addEventListener("change", () => {
      this.view.trail = Number(select.value);
      this.apply();
    });
  }

  /** Offer only what some of these episodes have. */
  load(episodes) {
    const some = (has) => episodes.some(has);
    const has = {
      rays: some(({ senses }) => senses.some(({ device }) => ["infrared", "range_and_bearing"].includes(device))),
      field: some(({ emitters }) => emitters.length > 0),
      network: some(({ networks }) => networks.length > 0),
    };
    for (const [name, { label }] of Object.entries(this.boxes)) label.hidden = !has[name];
  }

  /** Say what a tool has done. */
  say(text) {
    this.said.textContent = text;
    clearTimeout(this.saying);
    this.saying = setTimeout(() => (this.said.textContent = ""), 4000);
  }

  close() {
    document.removeEventListener("pointerdown", this.outside);
    document.removeEventListener("keydown", this.escape);
    clearTimeout(this.saying);
  }
}
