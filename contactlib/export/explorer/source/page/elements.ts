/* Elements of the page: those of index.html by their id, and new ones, of which the help is made. */

import { embeddedData } from "../kernel/embedded";

export function find<T extends HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`the page has no element ${id}`);
  return found as T;
}

/** Where the chart of a figure is drawn. */
export const plot = (id: string): HTMLElement => find(id).querySelector<HTMLElement>(".plot")!;

/** A new element with these properties and children. */
export function made<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag, properties: Partial<HTMLElementTagNameMap[Tag]> = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[Tag] {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

/** Set the text of an element, which costs nothing while it stays the same. */
export function write(place: HTMLElement, text: string): void {
  if (place.textContent !== text) place.textContent = text;
}

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
  ["Space", "pause or go on"],
  ["1 \u2026 6", "the experiments"],
  ["K", "kick the wheel"],
  ["W", "put a wet patch under it"],
  ["R", "start again"],
  ["\u2190 \u2192", "move the slider that has the focus; Page Up and Page Down in larger steps"],
  ["?", "this help"],
];

/** Fill in the help: texts, keys, and the licences that the build put into the page. */
export function fillHelp(place: HTMLElement): void {
  const licences = Object.entries(embeddedData("licences") as Record<string, string>);
  place.append(
    ...TEXTS.map((text) => made("p", {}, text)),
    made("ul", {}, ...KEYS.map(([key, text]) => made("li", {}, made("kbd", {}, key), ` ${text}`))),
    made("details", {}, made("summary", {}, "Licences of the software inside"),
      ...licences.map(([name, text]) => made("pre", {}, `${name}\n\n${text}`))),
  );
}
