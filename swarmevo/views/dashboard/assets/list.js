// SPDX-License-Identifier: BSD-3-Clause
// The list of runs: one link for each, which stays the same element while the run goes on, so that focus stays too.
"use strict";

const SwarmevoList = (() => {
  const { element } = SwarmevoCharts;

  class List {
    constructor(parent) {
      this.parent = parent;
      this.rows = new Map();
    }

    /** Show runs in their order; `chosen` is the id of the one that is shown beside. */
    update(runs, chosen) {
      const left = new Set(this.rows.keys());
      runs.forEach((run, place) => {
        left.delete(run.id);
        if (!this.rows.has(run.id)) this.rows.set(run.id, this._row(run.id));
        const row = this.rows.get(run.id);
        fill(row, run);
        if (this.parent.children[place] !== row.item) this.parent.insertBefore(row.item, this.parent.children[place] || null);
      });
      for (const id of left) {
        this.rows.get(id).item.remove();
        this.rows.delete(id);
      }
      this.mark(chosen);
    }

    mark(chosen) {
      for (const [id, row] of this.rows) {
        if (id === chosen) row.link.setAttribute("aria-current", "true");
        else row.link.removeAttribute("aria-current");
      }
    }

    _row(id) {
      const item = element("li"), link = element("a", "", undefined, item);
      link.href = `#run=${id}`;
      const head = element("span", "head", undefined, link);
      const row = { item, link, name: element("b", "", undefined, head), state: element("span", "state", undefined, head) };
      row.bar = element("span", "bar", undefined, link);
      element("i", "", undefined, row.bar);
      row.done = element("span", "soft", undefined, link);
      row.faults = element("span", "faults", undefined, link);
      row.said = element("span", "said", undefined, link);
      return row;
    }
  }

  function fill(row, run) {
    row.name.textContent = run.name;
    show(row.state, run);
    row.bar.hidden = run.state === "broken" || run.state === "opening";
    row.bar.firstChild.style.width = `${100 * run.share}%`;
    row.done.textContent = [run.done, run.left].filter(Boolean).join(", ");
    row.faults.textContent = run.faults ? `${run.faults} failed episode${run.faults > 1 ? "s" : ""}` : "";
    row.said.textContent = run.state === "broken" ? run.said : "";
  }

  /** Show a run's state in an element: as a word, and by its colour. */
  function show(place, run) {
    place.textContent = run.state;
    place.className = `state ${run.state}`;
  }

  return { List, show };
})();
