// SPDX-License-Identifier: BSD-3-Clause
// What all parts of the player use: elements, arrays in base64, numbers as text.

const SVG = "http://www.w3.org/2000/svg";

/** Return a new element. Text is given as text, so nothing in an episode can become markup. */
function element(tag, className, text, parent) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

function svg(tag, attributes, parent) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (parent) parent.append(made);
  return made;
}

function bytes(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

function joined(before, after) {
  const all = new after.constructor(before.length + after.length);
  all.set(before);
  all.set(after, before.length);
  return all;
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const clock = (t) => `${Math.floor(t / 60)}:${(t % 60).toFixed(1).padStart(4, "0")}`;
const isStill = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;
