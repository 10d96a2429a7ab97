/* The numbers beside the picture. */

import { creepControlGain, largestGain, longestDelay } from "../physics/stability";
import type { Clearing } from "../physics/clearing";
import { SAMPLE } from "../physics/run";
import { weakeningLength as weakening } from "../physics/vehicle";
import { digits, duration, percent } from "./format";
import type { Moment } from "./view";

const ZONE_LIMIT = 0.5; // of the weakening zone over the semi-width: beyond it the limit law is not good

interface Shown {
  label: string;
  help: string;
  text: string;
  unit: string;
  kind?: "stable" | "unstable" | "warn";
}

/** Everything that is shown of a moment. */
export function numbers({ run, shown, control }: Moment): Shown[] {
  const { plant, fold } = shown;
  const held = control.mode === "creep";
  const at = held ? control.creepage : run.creepage;
  const pole = plant.pole(at, run.speed, run.friction);
  const gain = plant.gain(run.speed);
  const highest = largestGain(pole, gain, Math.round(control.delay / SAMPLE), SAMPLE);
  const lowest = Math.max(0, creepControlGain(plant, at, run.speed, run.friction));
  const longest = longestDelay(pole, gain, lowest, SAMPLE);
  const contact = plant.force(run.creepage, run.speed, run.friction);
  const where = held ? "at the reference" : "here";
  const empty = !(lowest < highest);
  const mega = (v: number): string => digits(1e-6 * v);
  return [
    { label: "creepage \u03b6", help: "(omega r - V)/V", text: percent(run.creepage), unit: "" },
    { label: "drive torque T", help: "acting on the wheelset",
      text: digits(1e-3 * run.driveTorque), unit: "kN m" },
    { label: "Q / P", help: "traction coefficient: creep force over normal load",
      text: digits(contact.traction_coefficient), unit: "" },
    { label: `pole ${where}`, help: "rate at which a small change of the creepage grows at constant torque",
      text: digits(pole), unit: "1/s", kind: pole < 0 ? "stable" : "unstable" },
    { label: "critical torque", help: "the fold: no torque beyond it can be held",
      text: fold === null ? "none" : digits(1e-3 * fold.drive_torque, 5),
      unit: fold === null ? "" : "kN m" },
    { label: "comes back at", help: "torque at which a run-away ends on the way down",
      text: fold === null || !Number.isFinite(fold.return_creepage) ? "never"
        : digits(1e-3 * fold.return_torque, 4),
      unit: fold !== null && Number.isFinite(fold.return_creepage) ? "kN m" : "" },
    { label: "gains Kp that hold it",
      help: `that hold the wheel ${where} with a delay of ${duration(control.delay)} and without integral gain`,
      text: empty ? "none" : `${mega(lowest)} \u2013 ${mega(highest)}`, unit: empty ? "" : "MN m",
      ...(empty ? { kind: "warn" as const } : {}) },
    { label: "longest delay", help: `with which any gain holds the wheel ${where}: about 1/pole`,
      text: Number.isNaN(longest) ? "none" : longest === Infinity ? "any" : duration(longest), unit: "",
      ...(held && !(control.delay <= longest) ? { kind: "warn" as const } : {}) },
    { label: "K at this load", help: "intensity of the drop of friction, Eq. (17)",
      text: digits(contact.k_hat), unit: "" },
    { label: "\u03b6\u2080 at this load", help: "saturation creepage: where Carter's law slides, Eq. (15)",
      text: percent(contact.saturation_creepage), unit: "" },
    { label: "process zone", help: "length of the weakening zone over the semi-width; the law is the limit of a short one",
      text: digits(contact.process_zone_ratio), unit: "a",
      ...(contact.process_zone_ratio > ZONE_LIMIT ? { kind: "warn" as const } : {}) },
    { label: "weakening length", help: "slip over which friction falls, from K",
      text: digits(1e6 * weakening(plant.vehicle)), unit: "\u00b5m" },
  ];
}

/** Warnings of what the picture does not hold for. */
export function warnings({ run, shown, control }: Moment): string {
  const contact = shown.plant.force(run.creepage, run.speed, run.friction);
  const { process_zone_ratio: zone } = shown.plant.scales(); // of the dry rail: no patch makes it blink
  const found: string[] = [];
  if (zone > ZONE_LIMIT) {
    found.push(`The weakening zone is ${digits(zone)} semi-widths long. The ` +
      `law shown is the limit of a short zone, good up to ${ZONE_LIMIT}: raise f_s/f_d or lower K.`);
  }
  if (control.mode === "creep" && run.driveTorque >= control.torque_max) {
    found.push("Creep control is at its largest torque.");
  }
  if (contact.k_hat_limited > 0) {
    found.push("K is beyond the table's largest value, at which it is held.");
  }
  if (contact.force_limited > 0) {
    found.push("The law gives more than static friction: the force is held at f_s P.");
  }
  return found.join(" ");
}

/** What a wet patch does to the wheel, before it comes. */
export function clearingText(found: Clearing | null, length: number): string {
  if (found === null) return "Good friction does not hold this torque: there is nothing to clear.";
  if (!Number.isFinite(found.time)) return "Critical clearing time: none. A patch of any length is survived.";
  const outcome = length < found.distance ? "shorter: the wheel will come back" : "longer: the wheel will run away";
  return `Critical clearing time ${duration(found.time)} (${digits(found.distance, 3)} m). This patch is ${outcome}.`;
}

/** The numbers in the page; only texts that changed are touched. */
export class Numbers {
  private readonly cells = new Map<number, { term: HTMLElement; value: HTMLElement; unit: HTMLElement }>();

  constructor(private readonly list: HTMLElement) {}

  show(all: Shown[]): void {
    all.forEach((shown, i) => {
      let cell = this.cells.get(i);
      if (cell === undefined) {
        const box = document.createElement("div"), term = document.createElement("dt");
        const data = document.createElement("dd"), value = document.createElement("span");
        const unit = document.createElement("small");
        data.append(value, " ", unit);
        box.append(term, data);
        this.list.append(box);
        cell = { term, value, unit };
        this.cells.set(i, cell);
      }
      const { term, value, unit } = cell, box = term.parentElement as HTMLElement;
      if (term.textContent !== shown.label) term.textContent = shown.label;
      if (value.textContent !== shown.text) value.textContent = shown.text;
      if (unit.textContent !== shown.unit) unit.textContent = shown.unit;
      if (box.title !== shown.help) box.title = shown.help;
      const kind = shown.kind ?? "", data = value.parentElement as HTMLElement;
      if (data.className !== kind) data.className = kind;
    });
  }
}
