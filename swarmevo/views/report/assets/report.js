// SPDX-License-Identifier: BSD-3-Clause
// The report: gives each run's points to the chart of its Pareto front (charts.js), and the episode of the one chosen to
// the player of replays.
"use strict";

(() => {
  const { Chart, element } = SwarmevoCharts;

  /** A run's chart, stage and the card between them. */
  class Explorer {
    constructor(article, run) {
      this.article = article;
      this.run = run;
      this.stage = this._find("[data-stage]");
      this.player = null;
      this.chart = new Chart(this._find("[data-chart]"), run, (k) => this.choose(k, true));
      const first = run.points.findIndex((point) => point.front);
      if (first >= 0) this.choose(first, false);
    }

    _find(selector) {
      return this.article.querySelector(selector);
    }

    /** Show a point's numbers and network, and its episode from the start. */
    choose(k, play) {
      const point = this.run.points[k];
      this.chart.mark(k);
      this._find("[data-title]").textContent = `Individual ${point.genome}`;
      const facts = this._find("[data-facts]");
      facts.replaceChildren();
      for (const [name, value] of point.facts) {
        element("dt", "", name, facts);
        element("dd", "", value, facts);
      }
      this._find("[data-command]").textContent = point.command;
      this._network(point);
      this._show(point, play);
    }

    _network(point) {
      const place = this._find("[data-network-place]");
      const drawing = this._find(`template[data-network="${point.trial}:${point.genome}"]`);
      place.hidden = !drawing;
      if (drawing) place.querySelector(".picture").replaceChildren(drawing.content.cloneNode(true));
    }

    _show(point, play) {
      if (point.episode === null) {
        this._say("This individual's episode is not in this page. The command beside it makes its replay.");
        return;
      }
      if (!this.player) {
        this.stage.replaceChildren();
        this.player = SwarmevoPlayer.mount(this.stage, [this.run.episodes[point.episode]], { scene: this.run.scene });
      } else this.player.load([this.run.episodes[point.episode]]);
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
  }

  const runs = JSON.parse(document.getElementById("report-data").textContent);
  const articles = [...document.querySelectorAll("article.run")];
  window.swarmevoReport = articles.map((article) => new Explorer(article, runs[article.dataset.run]));
})();
