// SPDX-License-Identifier: BSD-3-Clause
// The run that is shown: its numbers, front, hypervolume and faults as they change, and the replay of the individual that
// was chosen, which goes on playing meanwhile.
"use strict";

const SwarmevoRun = (() => {
  const { Chart, element, isStill } = SwarmevoCharts;
  const { Lines } = SwarmevoLines;
  const CALM = 1500; // [ms] till when the chart stands still for somebody who points at it or came to it by Tab, and may be about to press
  const HINT = "Choose a point of the front to replay its individual.";

  class Run {
    constructor(article, id) {
      this.article = article;
      this.id = id;
      this.stage = this._find("[data-stage]");
      for (const name of ["chart", "lines", "tiles", "faults"]) this._find(`[data-${name}]`).replaceChildren();
      this._find("[data-chosen]").hidden = true;
      const config = this._find("[data-config]");
      config.open = false;
      config.ontoggle = () => config.open && this._config(config.querySelector("pre"));
      this._hint(HINT);
      const chart = this._find("[data-chart]");
      chart.onpointermove = chart.onpointerdown = () => this._calm(CALM);
      chart.onpointerleave = () => this._calm(0);
      this.heard = new AbortController();
      chart.addEventListener("focusin", () => this._calm(CALM), { signal: this.heard.signal });
    }

    /** Show the run as it is now. */
    update(run) {
      const changed = (name) => JSON.stringify(run[name]) !== JSON.stringify(this.run?.[name]);
      this._text("name", run.name);
      SwarmevoList.show(this._find("[data-state]"), run);
      this._text("done", [run.done, run.left].filter(Boolean).join(", "));
      this._text("about", run.about);
      this._text("said", run.said);
      this._text("reading", run.untaken ? `Reading what is stored: ${run.untaken} generations to go.` : "");
      this._bar(run);
      for (const section of this.article.querySelectorAll("[data-found]")) section.hidden = !run.points?.length;
      if (run.tiles && changed("tiles")) this._tiles(run.tiles);
      if (run.points?.length) {
        this._text("line", run.objectives.length === 2 ? "The line is the global front, that over all trials." : "");
        this._text("undrawn", run.undrawn ? `${run.undrawn} more are not drawn.` : "");
        this._text("reference", run.reference);
        if (changed("points")) this._points(run);
        if (changed("courses")) this._courses(run.courses);
      }
      this._find("[data-faulty]").hidden = !run.faulty?.length;
      if (run.faulty?.length && changed("faulty")) this._faults(run.faulty);
      this.run = run;
    }

    /** Forget what plays. */
    close() {
      this.closed = true;
      this.heard.abort();
      if (this.player) this.player.close();
    }

    _find(selector) {
      return this.article.querySelector(selector);
    }

    _text(name, text) {
      const place = this._find(`[data-${name}]`);
      place.textContent = text || "";
      place.hidden = !text;
    }

    _bar(run) {
      const bar = this._find("[data-bar]"), percent = Math.floor(100 * run.share);
      bar.hidden = run.state === "broken";
      bar.firstChild.style.width = `${100 * run.share}%`;
      bar.setAttribute("aria-valuenow", percent);
    }

    _tiles(tiles) {
      const list = this._find("[data-tiles]");
      list.replaceChildren();
      for (const [name, value, aside] of tiles) {
        const tile = element("div", "tile", undefined, list);
        element("dt", "", name, tile);
        element("dd", "", value, tile);
        element("dd", "aside", aside, tile);
      }
    }

    /** Let the chart change again after a while. */
    _calm(time) {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => {
        this.timer = null;
        if (this.waiting && !this.closed) this._points(this.waiting);
      }, time);
    }

    _points(run) {
      this.waiting = this.timer ? run : null;
      if (this.waiting) return;
      const k = run.points.findIndex((point) => this.chosen && point.trial === this.chosen.trial && point.genome === this.chosen.genome);
      if (!this.chart) {
        this.chart = new Chart(this._find("[data-chart]"), run, (place) => this._choose(this.chart.run.points[place], place));
      } else this.chart.update(run, k < 0 ? null : k);
      if (!this.chosen) return;
      if (k >= 0) this._facts(run.points[k]);
      this._text("left-front", k < 0 ? "It is no longer on the front of its trial: others dominate it now." : "");
    }

    _courses(courses) {
      this.lines = this.lines || new Lines(this._find("[data-lines]"));
      this.lines.update(courses);
    }

    _faults(faults) {
      const rows = this._find("[data-faults]");
      rows.replaceChildren();
      for (const fault of faults) {
        const row = element("tr", "", undefined, rows);
        for (const text of [fault.place, fault.genome, fault.text]) element("td", "", text, row);
      }
    }

    async _config(place) {
      const answer = await ask(`config?run=${this.id}`);
      if (!this.closed) place.textContent = answer.ok ? await answer.text() : "It cannot be read.";
    }

    // ---- the individual that was chosen

    _facts(point) {
      this._text("title", `Individual ${point.genome}`);
      const facts = this._find("[data-facts]");
      facts.replaceChildren();
      for (const [name, value] of point.facts) {
        element("dt", "", name, facts);
        element("dd", "", value, facts);
      }
      this._text("command", point.command);
      this._find("[data-chosen]").hidden = false;
    }

    _choose(point, place) {
      this.chart.mark(place);
      this._facts(point);
      this._text("left-front", "");
      this._find("[data-repeats]").hidden = true;
      this._load(point, {});
    }

    /** Show the most successful episode of an individual's last generation, or that of a repeat; play it where things may move. */
    async _load(point, repeat) {
      const asked = (this.asked = {}), { trial, generation, genome } = point;
      this.chosen = point;
      if (!this.player) this._hint("The episode is simulated once more ...");
      const answer = await ask(`episode?${new URLSearchParams({ run: this.id, trial, generation, genome, ...repeat })}`);
      const episode = await answer.json().catch(() => ({ error: "The dashboard has ended." }));
      if (this.closed || this.asked !== asked) return;
      if (episode.error) return this._hint(episode.error);
      this._repeats(point, episode);
      this._play(episode);
    }

    _repeats(point, episode) {
      const place = this._find("[data-repeats]"), select = place.querySelector("select");
      place.hidden = episode.repeats.length < 2;
      place.querySelector("span").textContent = `Episode of generation ${point.generation}`;
      select.replaceChildren(...episode.repeats.map((line, k) => new Option(line, k, false, k === episode.repeat)));
      select.onchange = () => this._load(point, { repeat: select.value });
    }

    _play(episode) {
      if (!this.player) {
        this.stage.replaceChildren();
        this.player = SwarmevoPlayer.mount(this.stage, [episode], {});
      } else this.player.load([episode]);
      if (!isStill()) this.player.play();
      const { top } = this.stage.getBoundingClientRect();
      if (top < 0 || top > 0.6 * innerHeight) this.stage.scrollIntoView({ block: "start" });
    }

    _hint(text) {
      if (this.player) this.player.close();
      this.player = null;
      this.stage.replaceChildren(element("p", "hint", text));
    }
  }

  const ask = (address) => fetch(address).catch(() => new Response("", { status: 503 }));

  return { Run };
})();
