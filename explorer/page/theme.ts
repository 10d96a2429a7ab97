/* Light and dark theme. Charts take colours by their names in the style sheet. */

export type Colour =
  | "card" | "ink" | "soft" | "faint" | "line" | "stable" | "unstable" | "torque" | "trail"
  | "shade" | "wet" | "wet-ink";

const KEPT = "contactlib-theme";
const root = document.documentElement;
const colours = new Map<string, string>();

/** Colour in the present theme. */
export function colour(name: Colour): string {
  let found = colours.get(name);
  if (found === undefined) {
    found = getComputedStyle(root).getPropertyValue(`--${name}`).trim();
    colours.set(name, found);
  }
  return found;
}

/** Take the visitor's choice, else that of the system; call `changed` at every change. */
export function beginTheme(button: HTMLElement, changed: () => void): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const show = (dark: boolean): void => {
    root.dataset["theme"] = dark ? "dark" : "light";
    button.textContent = dark ? "Light" : "Dark";
    colours.clear();
    changed();
  };
  show(kept() === null ? system.matches : kept() === "dark");
  system.addEventListener("change", () => {
    if (kept() === null) show(system.matches);
  });
  button.addEventListener("click", () => {
    const dark = root.dataset["theme"] !== "dark";
    kept(dark ? "dark" : "light");
    show(dark);
  });
}

/* The stored choice, after another one has been stored if given. A page opened from a file may have
 * no storage: the choice then lasts until the page is closed. */
function kept(other?: string): string | null {
  try {
    if (other !== undefined) localStorage.setItem(KEPT, other);
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}
