/* Elements of the page: those of index.html by their id, and new ones. */

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
export function write(place: Element, text: string): void {
  if (place.textContent !== text) place.textContent = text;
}

const TOAST = 6000; // for which a message stays [ms]
let toastTimer = 0;

/** Show a message at the foot of the page, for a while. */
export function toast(text: string): void {
  const place = find("toast");
  place.textContent = text;
  clearTimeout(toastTimer);
  toastTimer = window.setTimeout(() => (place.textContent = ""), TOAST);
}
