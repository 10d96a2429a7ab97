/* The numbers above the charts. */

import { creepControlGain, largestGain, longestDelay } from "../physics/stability";
import type { Clearing } from "../physics/clearing";
import { type Control, SAMPLE } from "../physics/run";
import { PROCESS_ZONE_LIMIT } from "../files/declared";
import { made, write } from "./elements";
import { digits, duration, percent } from "./format";
import type { Moment } from "./picture";

interface Shown {
  label: string;
  help: string;
  text: string;
  unit: string;
  kind?: "stable" | "unstable" | "warn";
}

/** All numbers of a moment. */
export function numbers({ run, shown, control }: Moment): Shown[] {
  const { plant, fold } = shown;
  const held = control.mode === "creep";
  const at = held ? control.creepage : run.now.creepage;
  const pole = plant.at(at, run.now.speed, run.now.friction).pole;
  const gain = plant.gain(run.now.speed);
  const highest = largestGain(pole, gain, Math.round(control.delay / SAMPLE), SAMPLE);
  const lowest = Math.max(0, creepControlGain(plant, at, run.now.speed, run.now.friction));
  const longest = longestDelay(pole, gain, lowest, SAMPLE);
  const contact = plant.force(run.now.creepage, run.now.speed, run.now.friction);
  const where = held ? "at the reference" : "here";
  const empty = !(lowest < highest);
  const mega = (v: number): string => v < 1e3 ? "0" : digits(1e-6 * v);
  const kilo = (v: number): string => digits(1e-3 * v);
  const moves = !held && kilo(run.now.drive_torque) !== kilo(control.drive_torque);
  return [
    { label: "creepage \u03b6", help: "(omega r - V)/V", text: percent(run.now.creepage), unit: "" },
    { label: "drive torque T", help: "acting on the wheelset, and where it moves to",
      text: kilo(run.now.drive_torque), unit: moves ? `\u2192 ${kilo(control.drive_torque)} kN m` : "kN m" },
    { label: "Q / P", help: "traction coefficient: creep force over normal load",
      text: digits(contact.traction_coefficient), unit: "" },
    { label: `pole ${where}`, help: "rate at which a small change of the creepage grows under constant torque",
      text: digits(pole), unit: "1/s", kind: pole < 0 ? "stable" : "unstable" },
    { label: "critical torque", help: "the fold: the wheel cannot hold any larger torque",
      text: fold === null ? "none" : digits(1e-3 * fold.drive_torque, 5),
      unit: fold === null ? "" : "kN m" },
    { label: "comes back at", help: "falling torque at which a run-away ends",
      text: fold === null || !Number.isFinite(fold.return_creepage) ? "never"
        : digits(1e-3 * fold.return_torque, 4),
      unit: fold !== null && Number.isFinite(fold.return_creepage) ? "kN m" : "" },
    { label: "Kp that hold it [MN m]",
      help: `proportional gains that hold the wheel ${where} with a delay of ${duration(control.delay)} and no integral gain`,
      text: empty ? "none" : `${mega(lowest)} \u2013 ${mega(highest)}`, unit: "",
      ...(empty ? { kind: "warn" as const } : {}) },
    { label: "longest delay", help: `the longest with which some gain holds the wheel ${where}: about 1/pole`,
      text: Number.isNaN(longest) ? "none" : longest === Infinity ? "any" : duration(longest), unit: "",
      ...(held && !(control.delay <= longest) ? { kind: "warn" as const } : {}) },
    { label: "K at this load", help: "intensity of the drop of friction, Eq. (17)",
      text: digits(contact.k_hat), unit: "" },
    { label: "\u03b6\u2080 at this load", help: "saturation creepage: where Carter's law slides, Eq. (15)",
      text: percent(contact.saturation_creepage), unit: "" },
    { label: "process zone", help: "length of the weakening zone over the semi-width; the law is the limit for a short zone",
      text: digits(contact.process_zone_ratio), unit: "a",
      ...(contact.process_zone_ratio > PROCESS_ZONE_LIMIT ? { kind: "warn" as const } : {}) },
    { label: "weakening length", help: "slip distance over which friction falls; follows from K",
      text: digits(1e6 * plant.contact.weakening_length), unit: "\u00b5m" },
  ];
}

/** Warnings about the limits of the law and of the control. */
export function warnings({ run, shown, control }: Moment): string {
  const contact = shown.plant.force(run.now.creepage, run.now.speed, run.now.friction);
  const { process_zone_ratio: zone } = shown.plant.scales(); // on the dry rail, so that no patch makes the warning blink
  const found: string[] = [];
  if (run.stopped !== null) found.push(stopText({ run, shown, control }));
  if (zone > PROCESS_ZONE_LIMIT) {
    found.push(`The weakening zone is ${digits(zone)} semi-widths long. The ` +
      `law shown is the limit of a short zone, below ${PROCESS_ZONE_LIMIT}: raise f_s/f_d or lower K.`);
  }
  if (control.mode === "creep" && run.now.drive_torque >= control.torque_max) {
    found.push("Creep control is at its largest torque.");
  }
  if (contact.k_hat_limited > 0) {
    found.push("K is held at the table's largest value.");
  }
  if (contact.force_limited > 0) {
    found.push("The law gives more than static friction: the force is held at f_s P.");
  }
  return found.join(" ");
}

/** Where a run starts again. */
export const startText = ({ mode }: Control): string =>
  `starts again ${mode === "torque" ? "with grip" : "at the reference"}`;

/** Why time stands still, and how it goes on. */
export function stopText({ run, shown: { plant }, control }: Omit<Moment, "rests" | "span">): string {
  const why = `Time stands still: ${run.stopped}.`;
  if (run.now.speed < plant.vehicle.minimum_speed) return `${why} Play ${startText(control)}.`;
  const { damping, radius } = plant.vehicle, omega = ((1 + run.now.creepage) * run.now.speed) / radius;
  const holding = radius * run.row.creep_force + damping * omega;
  const less = control.mode === "torque" && run.now.drive_torque > holding
    ? `; less than ${digits(1e-3 * holding)} kN m slows the wheel down` : "";
  return `${why} Play goes on from here${less}.`;
}

/** What a wet patch will do to the wheel. */
export function clearingText(found: Clearing | null, length: number): string {
  if (found === null) return "Even good friction does not hold this torque, so a patch makes no difference.";
  if (!Number.isFinite(found.time)) return "Critical clearing time: none. The wheel survives a patch of any length.";
  const outcome = length < found.distance ? "shorter: the wheel will come back" : "longer: the wheel will run away";
  return `Critical clearing time ${duration(found.time)} (${digits(found.distance, 3)} m). This patch is ${outcome}.`;
}

/** The numbers in the page. */
export class Numbers {
  private readonly cells: Record<"term" | "value" | "unit" | "data" | "box", HTMLElement>[] = [];

  constructor(private readonly list: HTMLElement) {}

  show(all: Shown[]): void {
    all.forEach((shown, i) => {
      const { term, value, unit, data, box } = (this.cells[i] ??= this.cell());
      write(term, shown.label);
      write(value, shown.text);
      write(unit, shown.unit);
      if (box.title !== shown.help) box.title = shown.help;
      if (data.className !== (shown.kind ?? "")) data.className = shown.kind ?? "";
    });
  }

  private cell(): Numbers["cells"][number] {
    const term = made("dt"), value = made("span"), unit = made("small");
    const data = made("dd", {}, value, " ", unit), box = made("div", {}, term, data);
    this.list.append(box);
    return { term, value, unit, data, box };
  }
}
