// SPDX-License-Identifier: BSD-3-Clause
// The report: gives each run's points to the chart of its Pareto front (charts.js), and the episode of the one chosen to
// the player of replays.
"use strict";

(() => {
  const { Chart, element, isStill } = SwarmevoCharts;

  /** A run's chart, stage and the card between them. Who is shown: one point, or two side by side, the chosen one last. */
  class Explorer {
    constructor(article, run) {
      this.article = article;
      this.run = run;
      this.shown = [];
      this.stage = this._find("[data-stage]");
      this.still = element("figure", "still");
      this.stage.after(this.still);
      this.player = null;
      this.chart = new Chart(this._find("[data-chart]"), run, (k, event) => this._press(k, event));
      this._toggle();
      this.choose(run.opened, false);
    }

    _find(selector) {
      return this.article.querySelector(selector);
    }

    /** Let who is shown stay beside who is chosen next. */
    _toggle() {
      this.together = element("button", "together", "side by side", this._find("[data-chart]"));
      this.together.type = "button";
      this.together.setAttribute("aria-pressed", false);
      this.together.addEventListener("click", () => {
        const isOn = this.together.getAttribute("aria-pressed") !== "true";
        this.together.setAttribute("aria-pressed", isOn);
        if (!isOn && this.shown.length > 1) this.choose(this.shown[1], false);
      });
    }

    _press(k, event) {
      const isShown = k === this.shown[this.shown.length - 1];
      if (event.key === " " && isShown && this.player) this.player.playing ? this.player.pause() : this.player.play();
      else this.choose(k, !isStill(), event.shiftKey || this.together.getAttribute("aria-pressed") === "true");
    }

    /** Show a point's numbers and network, and its episode from the start; `beside` the one that is shown. */
    choose(k, play, beside = false) {
      const others = beside ? this.shown.slice(-1).filter((other) => other !== k) : [];
      this.shown = [...others, k];
      this.chart.mark(k, others.length ? others[0] : null);
      const points = this.shown.map((number) => this.run.points[number]);
      this._facts(points);
      this._find("[data-command]").textContent = points.map((point) => point.command).join("\n");
      this._network(points[points.length - 1]);
      this._show(points, play);
    }

    _facts(points) {
      const place = this._find("[data-facts]");
      place.replaceChildren();
      const table = element("table", "means", undefined, place);
      element("caption", "", "Means over all its episodes", table);
      const heads = element("tr", "", undefined, element("thead", "", undefined, table));
      element("td", "", "", heads);
      for (const point of points) {
        const head = element("th", "", `Individual ${point.genome}`, heads);
        head.scope = "col";
        head.dataset.title = "";
      }
      const body = element("tbody", "", undefined, table);
      const values = points.map((point) => new Map(point.facts));
      for (const name of new Set(points.flatMap((point) => point.facts.map(([fact]) => fact)))) {
        const row = element("tr", "", undefined, body);
        element("th", "", name, row).scope = "row";
        for (const of of values) element("td", "", of.has(name) ? of.get(name) : "", row);
      }
    }

    _network(point) {
      const place = this._find("[data-network-place]");
      const drawing = this._find(`template[data-network="${point.trial}:${point.genome}"]`);
      place.hidden = !drawing;
      if (!drawing) return;
      const picture = place.querySelector(".picture");
      picture.setAttribute("aria-label", `The network of individual ${point.genome}`);
      picture.replaceChildren(drawing.content.cloneNode(true));
    }

    _show(points, play) {
      const episodes = points.filter(({ episode }) => episode !== null).map(({ episode }) => this.run.episodes[episode]);
      if (!episodes.length) {
        this._say("This individual's episode is not in this page. The command beside it makes its replay.");
        return;
      }
      if (!this.player) {
        this.stage.replaceChildren();
        this.player = SwarmevoPlayer.mount(this.stage, episodes, { scene: this.run.scene, place: () => this.place });
      } else this.player.load(episodes);
      if (!play) return;
      this.player.play();
      const { top } = this.stage.getBoundingClientRect();
      if (top < 0 || top > 0.6 * innerHeight) this.stage.scrollIntoView({ block: "start" });
    }

    _say(text) {
      if (this.player) this.player.close();
      this.player = null;
      this.stage.replaceChildren(element("p", "hint", text));
    }

    /** Return who is shown, for the page's address. */
    get place() {
      const points = this.shown.map((k) => this.run.points[k]);
      return `run=${this.article.dataset.run}&shown=${points.map(({ trial, genome }) => `${trial}:${genome}`).join(",")}`;
    }

    /** Show who is named so, at a time. */
    go(names, time) {
      const numbers = names.map((name) => this.run.points.findIndex(({ trial, genome }) => `${trial}:${genome}` === name));
      numbers.filter((k) => k >= 0).forEach((k, i) => this.choose(k, false, i > 0));
      if (this.player && time !== null) this.player.seek(Number(time));
    }

    /** Keep a still frame for print: of now, or, before the episode has begun, of when most had happened. */
    print() {
      this.still.replaceChildren();
      if (!this.player) return;
      const { time } = this.player;
      const happened = this.player.events.map((event) => event.time);
      this.player.seek(time || Math.max(1, ...happened) + 0.5);
      const names = this.shown.map((k) => this.run.points[k].genome).join(" and ");
      const caption = `Individual ${names}, ${this.player.time.toFixed(1)} s`;
      const canvas = this.player.picture();
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", caption);
      this.still.append(canvas);
      element("figcaption", "", caption, this.still);
      for (const stage of this.player.stages) this._told(stage);
      this.player.seek(time);
    }

    /** Say below the still frame what is said beside a stage: an episode's values, and what happened in it. */
    _told({ track: { episode }, events }) {
      const told = element("div", "", undefined, this.still);
      element("h3", "", `${episode.title}, in this episode`, told);
      const list = element("dl", "facts", undefined, told);
      for (const [name, value] of episode.facts) {
        element("dt", "", name, list);
        element("dd", "", value, list);
      }
      element("p", "", events.events.map(({ text, time }) => `${text}, ${time.toFixed(1)} s`).join("; "), told);
    }
  }

  const runs = JSON.parse(document.getElementById("report-data").textContent);
  const articles = [...document.querySelectorAll("article.run")];
  const explorers = articles.map((article) => new Explorer(article, runs[article.dataset.run]));
  window.swarmevoReport = explorers;

  /** Go where the page's address says: a run, who is shown of it, a time. */
  function go() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    const explorer = wanted.has("shown") && explorers[wanted.get("run")];
    if (!explorer) return;
    explorer.go(wanted.get("shown").split(","), wanted.get("t"));
    if (explorers.length > 1) explorer.article.scrollIntoView();
  }
  addEventListener("hashchange", go);
  go();

  // On paper all is open, and the scene stands still.
  let closed = [];
  addEventListener("beforeprint", () => {
    for (const explorer of explorers) explorer.print();
    closed = [...document.querySelectorAll("main details:not([open]):not(.sw-menu)")];
    for (const details of closed) details.open = true;
  });
  addEventListener("afterprint", () => {
    for (const details of closed) details.open = false;
  });
})();
