/* Rows of controls, one for each value: a slider, and a field for the exact number. */

import type { Limit } from "../files/declared";
import { decimal } from "../files/reading";
import { allows, limitText } from "../physics/limits";
import { made } from "./elements";
import { plain, rounded } from "./format";

export interface RowSpec {
  id: string;
  label: string;
  unit: string;
  /** SI value of one unit shown. */
  scale: number;
  /** Ends of the slider, SI; the field takes all that `limit` allows. */
  min: number;
  max: number;
  /** Whether the slider is logarithmic. */
  log?: boolean;
  limit: Limit;
  help: string;
  read(): number;
  write(value: number): void;
}

const STEPS = 250; // of a slider

export class Row {
  private readonly slider: HTMLInputElement;
  private readonly field: HTMLInputElement;
  private readonly problem: HTMLElement;
  readonly element: HTMLElement;
  private chosen = NaN; // value that a visitor has set, which is shown as it is

  get id(): string {
    return this.spec.id;
  }

  constructor(private spec: RowSpec) {
    const { id, label, unit, help } = spec;
    this.field = made("input", { type: "text", inputMode: "decimal", id: `${id}-field`,
      autocomplete: "off" });
    this.field.setAttribute("aria-label", unit === "" ? label : `${label}, ${unit}`);
    this.field.setAttribute("aria-describedby", `${id}-help ${id}-problem`);
    this.slider = made("input", { type: "range", min: "0", max: String(STEPS), step: "1",
      id: `${id}-slider` });
    this.slider.setAttribute("aria-describedby", `${id}-help`);
    this.problem = made("span", { className: "problem", id: `${id}-problem` });
    this.problem.setAttribute("role", "alert");
    this.element = made("div", { className: "row", title: help },
      made("label", { htmlFor: this.slider.id }, label), this.field,
      made("span", { className: "unit" }, unit), this.slider, this.problem,
      made("span", { id: `${id}-help`, hidden: true }, help)); // read as a description only
    this.slider.addEventListener("input", () => {
      this.take(this.at(Number(this.slider.value) / STEPS));
      this.show();
    });
    this.field.addEventListener("change", () => this.typed());
    this.field.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.settle(true);
    });
    this.field.addEventListener("focus", () => {
      if (this.refused) return;
      this.field.value = plain(this.spec.read() / this.spec.scale); // all digits, to edit or replace
      this.field.select();
    });
    // What was refused stays with its problem, so that both can be read.
    this.field.addEventListener("blur", () => this.refused || this.show(true));
    this.show();
  }

  /** Other ends of the slider. */
  span(min: number, max: number): void {
    Object.assign(this.spec, { min, max });
    this.show();
  }

  /** Show what holds now, in place of what was refused; `anyhow`: also of what is being typed. */
  settle(anyhow = false): void {
    if (anyhow || document.activeElement !== this.field) this.refuse("");
    this.show(anyhow);
  }

  /** Show the present value; `anyhow`: also in place of what was refused or is being typed. */
  show(anyhow = false): void {
    const { spec } = this, value = spec.read(), here = value / spec.scale;
    const shown = Math.abs(value - this.chosen) <= 1e-9 * Math.abs(value) ? plain(here) : rounded(here);
    const kept = this.refused || document.activeElement === this.field;
    if (anyhow || !kept) this.field.value = shown;
    const place = Math.min(Math.max(this.place(value), 0), 1);
    this.slider.value = String(Math.round(STEPS * place));
    this.slider.setAttribute("aria-valuetext", `${shown} ${spec.unit}`.trim());
  }

  private place(value: number): number {
    const { min, max, log } = this.spec;
    return log ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
  }

  /** Value at a place of the slider, as round in its unit as the step allows. */
  private at(place: number): number {
    const { min, max, log, scale } = this.spec;
    const value = log ? min * (max / min) ** place : min + (max - min) * place;
    if (place === 0 || place === 1) return value;
    const step = (log ? value * Math.log(max / min) : max - min) / STEPS / scale;
    const round = 10 ** Math.floor(Math.log10(step));
    return Math.round(value / scale / round) * round * scale;
  }

  private typed(): void {
    const { label, unit, scale, limit } = this.spec, value = scale * number(this.field.value);
    if (Number.isNaN(value)) {
      this.refuse(`${label}: "${this.field.value}" is not a number`);
    } else if (!allows(limit, value)) {
      this.refuse(`${label} must be ${limitText(limit, (bound) => plain(bound / scale))} ${unit}`.trim());
    } else if (this.take(value)) {
      this.show(true);
    }
  }

  /** Write a value, unless it is refused. */
  private take(value: number): boolean {
    try {
      this.spec.write(value);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.refuse(error.message);
      return false;
    }
    this.refuse("");
    this.chosen = this.spec.read();
    return true;
  }

  private get refused(): boolean {
    return this.problem.textContent !== "";
  }

  private refuse(why: string): void {
    this.field.setAttribute("aria-invalid", String(why !== ""));
    this.problem.textContent = why;
  }
}

/** The number that was typed, with a point or a comma; NaN if it is ambiguous. */
function number(typed: string): number {
  const text = typed.trim().replace("\u2212", "-");
  return /^-?[1-9]\d{0,2}(,\d{3})+$/.test(text) ? NaN : decimal(text.replace(",", "."));
}
