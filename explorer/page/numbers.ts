/* The numbers above the charts. */

import { Loop } from "../physics/stability";
import type { Clearing } from "../physics/clearing";
import { type Control, SAMPLE } from "../physics/run";
import { PROCESS_ZONE_LIMIT } from "../files/declared";
import { write } from "./elements";
import { digits, duration, percent } from "./format";
import type { Moment } from "./picture";

interface Shown {
  text: string;
  unit?: string;
  kind?: "stable" | "unstable" | "warn";
  /** In place of those that the page has. */
  label?: string;
  help?: string;
}

/** All numbers of a moment. */
export function numbers({ run, shown, control }: Moment): Shown[] {
  const { plant, fold } = shown;
  const held = control.mode === "creep";
  const at = held ? control.creepage : run.now.creepage;
  const { pole, minimum_gain } = plant.at(at, run.now.speed, run.now.friction);
  const loop = new Loop(pole, plant.gain(run.now.speed));
  const highest = loop.largestGain(Math.round(control.delay / SAMPLE));
  const lowest = Math.max(0, minimum_gain), longest = loop.longestDelay(lowest);
  const contact = plant.force(run.now.creepage, run.now.speed, run.now.friction);
  const where = held ? "at the reference" : "here";
  const empty = !(lowest < highest);
  const mega = (v: number): string => v < 1e3 ? "0" : digits(1e-6 * v);
  const kilo = (v: number): string => digits(1e-3 * v);
  const moves = !held && kilo(run.now.drive_torque) !== kilo(control.drive_torque);
  const returns = fold !== null && Number.isFinite(fold.return_creepage);
  const warn = (wrong: boolean): Pick<Shown, "kind"> => (wrong ? { kind: "warn" } : {});
  return [
    { text: percent(run.now.creepage) },
    { text: kilo(run.now.drive_torque), unit: moves ? `\u2192 ${kilo(control.drive_torque)} kN m` : "kN m" },
    { text: digits(run.now.creep_force / plant.axleLoad) },
    { text: digits(pole), unit: "1/s", kind: pole < 0 ? "stable" : "unstable", label: `pole ${where}` },
    fold === null ? { text: "none" } : { text: digits(1e-3 * fold.drive_torque, 5), unit: "kN m" },
    returns ? { text: digits(1e-3 * fold.return_torque, 4), unit: "kN m" } : { text: "never" },
    { text: empty ? "none" : `${mega(lowest)} \u2013 ${mega(highest)}`, ...warn(empty),
      help: `proportional gains that hold the wheel ${where} with a delay of ` +
        `${duration(control.delay)} and no integral gain` },
    { text: Number.isNaN(longest) ? "none" : longest === Infinity ? "any" : duration(longest),
      help: `the longest with which some gain holds the wheel ${where}: about 1/pole`,
      ...warn(held && !(control.delay <= longest)) },
    { text: digits(contact.k_hat) },
    { text: percent(contact.saturation_creepage) },
    { text: digits(contact.process_zone_ratio), unit: "a",
      ...warn(contact.process_zone_ratio > PROCESS_ZONE_LIMIT) },
    { text: digits(1e6 * plant.contact.weakening_length), unit: "\u00b5m" },
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
  if (run.now.speed < run.motion.slowest) return `${why} Play ${startText(control)}.`;
  const { damping, radius } = plant.vehicle, omega = run.motion.drivetrain.state.omega_left;
  const holding = radius * run.now.creep_force + damping * omega;
  const less = control.mode === "torque" && run.now.drive_torque > holding
    ? `; less than ${digits(1e-3 * holding)} kN m slows the wheel down` : "";
  return `${why} Play goes on from here${less}.`;
}

/** What a wet patch will do to the wheel. */
export function clearingText(found: Clearing | null, length: number): string {
  if (found === null) return "Even good friction does not hold this torque, so a patch makes no difference.";
  if (!Number.isFinite(found.time)) return "Critical clearing time: none. The wheel survives a patch of any length.";
  const outcome = length < found.distance ? "shorter: the wheel will re-adhere" : "longer: the wheel will slip away";
  return `Critical clearing time ${duration(found.time)} (${digits(found.distance, 3)} m). This patch is ${outcome}.`;
}

/** Show numbers in their places of a list, which has one for each. */
export function showNumbers(list: HTMLElement, all: Shown[]): void {
  all.forEach(({ text, unit = "", kind = "", label, help }, i) => {
    const box = list.children[i] as HTMLElement, [term, data] = box.children;
    const [value, small] = data!.children;
    write(value!, text);
    write(small!, unit);
    if (label !== undefined) write(term!, label);
    if (help !== undefined && box.title !== help) box.title = help;
    if (data!.className !== kind) data!.className = kind;
  });
}
