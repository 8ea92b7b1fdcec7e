// SPDX-License-Identifier: BSD-3-Clause
// The replay page: gives its episodes to the player (player/), or asks the server for live ones, and offers
// window.swarmevo to whoever films or tests it.
"use strict";
(() => {
  const place = document.getElementById("player");
  const live = "live" in place.dataset;
  const episodes = JSON.parse(document.getElementById("episodes").textContent);
  const wanted = /t=([\d.]+)/.exec(location.hash);
  const player = SwarmevoPlayer.mount(place, episodes, {
    autoplay: !wanted && !live,
    place: live ? undefined : () => "",
    ended: () => live && next(),
  });
  if (wanted) player.seek(Number(wanted[1]));
  addEventListener("hashchange", () => {
    const moment = /t=([\d.]+)/.exec(location.hash);
    if (moment) player.seek(Number(moment[1]));
  });

  // The server sends one episode for each connection: its head, its steps as they are simulated, its outcome.
  function next() {
    const source = new EventSource("episode");
    const on = (name, act) => source.addEventListener(name, (event) => act(JSON.parse(event.data)));
    on("head", (episode) => {
      player.load([episode]);
      player.play();
    });
    on("chunk", (chunk) => player.append(chunk));
    on("outcome", (outcome) => {
      player.finish(outcome);
      source.close();
    });
    on("failed", (message) => {
      source.close();
      player.warn(message);
    });
    source.onerror = () => {
      source.close();
      player.warn("The server has ended; what has come so far stays here.");
    };
  }
  if (live) next();

  window.swarmevo = {
    player,
    seek: (t) => player.seek(t),
    play: () => player.play(),
    pause: () => player.pause(),
    poses: (t, stage = 0) => player.poses(t)[stage],
    shown: (stage = 0) => player.shown()[stage],
  };
})();
