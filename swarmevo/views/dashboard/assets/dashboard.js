// SPDX-License-Identifier: BSD-3-Clause
// The dashboard: listens to its server while it is seen, and gives what comes to the list and to the run that is shown.
// Which run that is stands behind the #: #run=ID; without it, the first one where there is room for both.
"use strict";

(() => {
  const find = (selector) => document.querySelector(selector);
  const list = new SwarmevoList.List(find("[data-runs]"));
  const wide = matchMedia("(min-width: 900px)");
  const states = new Map();
  let listed = null, source = null, shown = null, wanted = null;

  function hash() {
    return /^#run=([0-9a-f]{16})$/.exec(location.hash)?.[1] || "";
  }

  /** Show the run that the address names. */
  function choose() {
    const id = hash() || (wide.matches && listed?.runs[0]?.id) || "";
    document.body.classList.toggle("one", Boolean(hash()));
    if (id !== wanted) {
      wanted = id;
      if (shown) shown.close();
      shown = id ? new SwarmevoRun.Run(find("[data-run]"), id) : null;
      find("[data-run]").hidden = true;
      listen();
    }
    list.mark(id);
    tell();
  }

  /** Say where there is no run to show why. */
  function tell() {
    const place = find("[data-nothing]"), isThere = listed?.runs.some((run) => run.id === wanted);
    let said = "";
    if (listed && wanted && !isThere) said = "This run is gone: its folder was moved or removed.";
    else if (listed && !listed.runs.length) said = `There is no run in ${listed.place} yet. One appears here as soon as swarmevo evolve has begun it.`;
    place.textContent = said;
    place.hidden = !said;
    if (said) find("[data-run]").hidden = true;
  }

  function runs(content) {
    listed = content;
    find("[data-place]").textContent = content.name;
    find("[data-place]").title = content.place;
    find("[data-note]").textContent = content.note || (content.runs.length ? "" : "No run yet.");
    choose();
    list.update(content.runs, wanted);
    for (const run of content.runs) {
      if (states.has(run.id) && states.get(run.id) !== run.state) find("[data-news]").textContent = `${run.name}: ${run.state}`;
      states.set(run.id, run.state);
    }
  }

  function run(content) {
    if (!shown || content.id !== wanted) return;
    find("[data-run]").hidden = false;
    shown.update(content);
    document.title = `${Math.floor(100 * content.share)}% ${content.name} · swarmevo`;
  }

  /** Be told what is new, as long as the page is seen. */
  function listen() {
    if (source) source.close();
    source = null;
    if (document.hidden) return;
    source = new EventSource(`events?run=${wanted || ""}`);
    source.addEventListener("runs", (event) => runs(JSON.parse(event.data)));
    source.addEventListener("run", (event) => run(JSON.parse(event.data)));
    source.onopen = () => (find("[data-lost]").hidden = true);
    source.onerror = () => {
      const place = find("[data-lost]");
      if (place.hidden) place.textContent = `The dashboard's server has ended or cannot be reached. What is shown is of ${new Date().toLocaleTimeString()}.`;
      place.hidden = false;
      if (source.readyState === EventSource.CLOSED) setTimeout(listen, 2000);
    };
  }

  addEventListener("hashchange", choose);
  document.addEventListener("visibilitychange", listen);
  choose();
  if (!source) listen();
  window.swarmevoDashboard = { run: () => shown, listed: () => listed };
})();
