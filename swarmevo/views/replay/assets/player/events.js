// SPDX-License-Identifier: BSD-3-Clause
// What happens in an episode: chips beside the scene that jump there, a flag in the scene when it happens.

const FLAG_SECONDS = 0.8; // of real time, at least so much of the episode's [s]: 2
const LEAST_FLAG = 2;

/** Return an episode's events, the first first: time, text, and the robot's number and colour if it is a robot's. */
function eventsOf({ homing, push, colours, delivery, at }) {
  const came = (homing || []).map((time, i) => ({ time, text: `robot ${i + 1} ${at}`, short: `${i + 1}`, colour: colours[i] }));
  const all = [...came, { time: push, text: delivery, short: delivery, colour: null }];
  return all.filter(({ time }) => time !== null && time !== undefined).sort((a, b) => a.time - b.time);
}

/** The chips and the flag of a stage. A press on a chip calls `seek` with the event's time. */
class Events {
  constructor(side, scene, seek) {
    this.list = element("ul", "sw-events", undefined, side);
    this.list.setAttribute("aria-label", "what happened");
    this.flag = element("p", "sw-flag", undefined, scene);
    this.seek = seek;
  }

  load(episode) {
    this.events = eventsOf(episode);
    this.list.hidden = this.events.length === 0;
    this.list.replaceChildren();
    this.chips = this.events.map(({ time, text, short, colour }) => {
      const chip = element("button", "sw-chip", undefined, element("li", "", undefined, this.list));
      chip.type = "button";
      chip.title = `${text}, ${time.toFixed(1)} s`;
      chip.setAttribute("aria-label", `${chip.title}: go there`);
      mark(colour, short, chip);
      element("span", "", `${colour ? "" : `${text} `}${time.toFixed(1)} s`, chip);
      chip.addEventListener("click", () => this.seek(time));
      return chip;
    });
    this.shown = undefined;
    this.flag.hidden = true;
  }

  show(t, speed) {
    this.chips.forEach((chip, k) => chip.classList.toggle("sw-over", this.events[k].time <= t + 1e-6));
    const long = Math.max(LEAST_FLAG, FLAG_SECONDS * speed);
    const now = this.events.filter(({ time }) => time <= t + 1e-6 && t < time + long);
    const latest = now[now.length - 1];
    if (latest === this.shown) return;
    this.shown = latest;
    this.flag.hidden = !latest;
    this.flag.replaceChildren();
    if (!latest) return;
    mark(latest.colour, latest.short, this.flag);
    this.flag.append(latest.text);
  }
}

/** Return a robot's badge, or a goal's diamond. */
function mark(colour, number, parent) {
  const badge = element("span", colour ? "sw-badge" : "sw-goal", colour ? number : undefined, parent);
  if (colour) badge.style.setProperty("--robot", colour);
  return badge;
}
