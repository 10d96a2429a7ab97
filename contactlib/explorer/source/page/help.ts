/* The help: what the charts show, and the keys. */

import { pageData } from "../files/page_data";

const TEXTS = [
  "Creepage is how much faster the wheel turns than it rolls. The contact gives a force that rises " +
    "with it, peaks and falls. Where the curve is solid a constant torque holds the wheel; where it is " +
    "dashed a little more creepage means less force, and the wheel runs away.",
  "The large dot is the wheel on every chart. Drag on the chart of steady states to set the torque, " +
    "or under creep control the reference; the sliders and their fields do the same.",
  "Fields take exact numbers. The address keeps the settings: it can be sent to others. A model file " +
    "can be dropped anywhere on the page.",
];

const KEYS: [string, string][] = [
  ["Space", "pause and go on"],
  ["1 \u2026 6", "the experiments"],
  ["K", "kick the wheel"],
  ["W", "put a wet patch under it"],
  ["R", "begin anew"],
  ["\u2190 \u2192", "move the slider that has the focus; Page Up and Page Down in larger steps"],
  ["?", "this help"],
];

/** The licences that the build put into the page, of what its script contains. */
function licences(): HTMLElement {
  const all = document.createElement("details"), title = document.createElement("summary");
  title.textContent = "Licences of what is inside";
  all.append(title);
  for (const [name, text] of Object.entries(pageData("licences") as Record<string, string>)) {
    const licence = document.createElement("pre");
    licence.textContent = `${name}\n\n${text}`;
    all.append(licence);
  }
  return all;
}

export function fillHelp(place: HTMLElement): void {
  const texts = TEXTS.map((text) => {
    const paragraph = document.createElement("p");
    paragraph.textContent = text;
    return paragraph;
  });
  const keys = document.createElement("ul");
  for (const [key, text] of KEYS) {
    const item = document.createElement("li"), cap = document.createElement("kbd");
    cap.textContent = key;
    item.append(cap, ` ${text}`);
    keys.append(item);
  }
  place.append(...texts, keys, licences());
}
