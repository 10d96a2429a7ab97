/* Elements of the page by their id; index.html has them all. */

export function find<T extends HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`the page has no element ${id}`);
  return found as T;
}

/** Where the chart of a figure is drawn. */
export const plot = (id: string): HTMLElement => find(id).querySelector<HTMLElement>(".plot") as HTMLElement;
