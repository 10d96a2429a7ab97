/* Rows of controls: a slider for the hand and a field for the exact number, for one value each. */

import { allows, decimal, type Limit, limitText } from "../files";
import { plain } from "./format";

export interface RowSpec {
  id: string;
  label: string;
  unit: string;
  /** SI value of one unit shown. */
  scale: number;
  /** Ends of the slider, SI; the field takes what `limit` allows. */
  min: number;
  max: number;
  /** Whether the slider goes by ratios. */
  log?: boolean;
  limit: Limit;
  help: string;
  read(): number;
  write(value: number): void;
}

const STEPS = 250; // of a slider

export class Row {
  private readonly slider = document.createElement("input");
  private readonly field = document.createElement("input");
  private readonly problem = document.createElement("span");
  readonly element = document.createElement("div");

  get id(): string {
    return this.spec.id;
  }

  constructor(private spec: RowSpec) {
    const { id, label, unit, help } = spec;
    this.element.className = "row";
    this.element.title = help;
    const name = document.createElement("label");
    name.textContent = label;
    name.htmlFor = `${id}-slider`;
    Object.assign(this.field, { type: "text", inputMode: "decimal", id: `${id}-field`,
      autocomplete: "off" });
    this.field.setAttribute("aria-label", unit === "" ? label : `${label}, ${unit}`);
    const units = document.createElement("span");
    units.className = "unit";
    units.textContent = unit;
    Object.assign(this.slider, { type: "range", min: "0", max: String(STEPS), step: "1",
      id: `${id}-slider` });
    this.slider.setAttribute("aria-describedby", `${id}-help`);
    const described = document.createElement("span");
    described.id = `${id}-help`;
    described.hidden = true; // read as a description, not between the controls
    described.textContent = help;
    this.problem.className = "problem";
    this.problem.id = `${id}-problem`;
    this.field.setAttribute("aria-describedby", `${id}-help ${id}-problem`);
    this.problem.setAttribute("role", "alert");
    this.element.append(name, this.field, units, this.slider, this.problem, described);
    this.slider.addEventListener("input", () => {
      this.take(this.at(Number(this.slider.value) / STEPS));
      this.show();
    });
    this.field.addEventListener("change", () => this.typed());
    this.field.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.restore();
    });
    this.field.addEventListener("blur", () => this.show(true)); // what is wrong is still said
    this.show();
  }

  /** Other ends of the slider. */
  span(min: number, max: number): void {
    Object.assign(this.spec, { min, max });
    this.show();
  }

  /** Forget what is being typed. */
  private restore(): void {
    this.refuse("");
    this.show(true);
  }

  /** Show the value as it is now; over what is being typed only if told so. */
  show(anyhow = false): void {
    const { spec } = this, value = spec.read();
    const shown = plain(value / spec.scale);
    if (anyhow || document.activeElement !== this.field) this.field.value = shown;
    const place = Math.min(Math.max(this.place(value), 0), 1);
    this.slider.value = String(Math.round(STEPS * place));
    this.slider.setAttribute("aria-valuetext", `${shown} ${spec.unit}`.trim());
  }

  private place(value: number): number {
    const { min, max, log } = this.spec;
    return log ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
  }

  /** Value at a place of the slider, in numbers of the unit as round as its step allows. */
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
    if (!allows(limit, value)) {
      this.refuse(`${label} must be ${limitText(inUnits(limit, scale))} ${unit}`.trim());
    } else if (this.take(value)) {
      this.show(true);
    }
  }

  /** Write a value, unless it cannot be together with the others. */
  private take(value: number): boolean {
    try {
      this.spec.write(value);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.refuse(error.message);
      return false;
    }
    this.refuse("");
    return true;
  }

  private refuse(why: string): void {
    this.field.setAttribute("aria-invalid", String(why !== ""));
    this.problem.textContent = why;
  }
}

/** The number that was typed, with a point or a comma; NaN if it may be meant in two ways. */
function number(typed: string): number {
  const text = typed.trim().replace("\u2212", "-");
  return /^-?[1-9]\d{0,2}(,\d{3})+$/.test(text) ? NaN : decimal(text.replace(",", "."));
}

/** A limit in the units that are shown. */
function inUnits(limit: Limit, scale: number): Limit {
  const bounds = (["above", "at_least", "below", "at_most"] as const)
    .filter((bound) => limit[bound] !== undefined)
    .map((bound) => [bound, Number(plain((limit[bound] as number) / scale))]);
  return { unit: limit.unit, ...Object.fromEntries(bounds) };
}
