// SPDX-License-Identifier: BSD-3-Clause
// Keys for whichever player is seen, wherever the focus is: Space plays and pauses, arrows go a second on or back.

const KEY_SECONDS = { ArrowLeft: -1, ArrowRight: 1 };
const TAKES_SPACE = "button, summary, select, a[href], [role=button], textarea, input:not([type=range])";
const TAKES_ARROWS = "select, textarea, .scroll, pre, input:not([type=range]):not([type=checkbox])";

/** All players of the page; the one that was touched last is first. */
const Keys = {
  players: [],

  add(player) {
    if (!Keys.players.length) document.addEventListener("keydown", Keys.press);
    Keys.players.push(player);
    for (const event of ["pointerdown", "focusin"]) player.root.addEventListener(event, () => Keys.prefer(player));
    // A press with the pointer leaves the focus to the player: the next Space plays, and presses no button again.
    player.root.addEventListener("click", (event) => event.detail && event.target.closest("button, label") && player.root.focus({ preventScroll: true }));
    player.root.addEventListener("change", (event) => event.target.tagName === "SELECT" && player.root.focus({ preventScroll: true }));
  },

  prefer(player) {
    Keys.players = [player, ...Keys.players.filter((other) => other !== player)];
  },

  remove(player) {
    Keys.players = Keys.players.filter((other) => other !== player);
    if (!Keys.players.length) document.removeEventListener("keydown", Keys.press);
  },

  press(event) {
    const { target, key } = event;
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
    const player = Keys.players.find(({ root }) => root.contains(target)) || Keys.players.find(isSeen);
    if (!player) return; // the page scrolls
    const takes = (selector) => target instanceof Element && target.closest(selector);
    if (key === " " && !takes(TAKES_SPACE)) player.playing ? player.pause() : player.play();
    else if (key in KEY_SECONDS && !takes(TAKES_ARROWS)) player.seek(player.time + KEY_SECONDS[key]);
    else if (key === "Home" && player.root.contains(target)) player.seek(0);
    else return;
    event.preventDefault();
  },
};

/** Whether most of a player's scenes is in the window. */
function isSeen({ place }) {
  const { top, bottom } = place.getBoundingClientRect();
  const seen = Math.min(bottom, innerHeight) - Math.max(top, 0);
  return seen > 0.5 * Math.min(bottom - top, innerHeight);
}
