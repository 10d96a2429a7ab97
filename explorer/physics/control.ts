import { demand } from "./limits";

/** Control of the run: torque mode and creep mode. The page may change any field at any time. */
export interface Control {
  mode: "torque" | "creep";
  drive_torque: number; // demand in torque mode [N.m]
  torque_rate: number; // largest rate at which the torque moves there [N.m/s]
  creepage: number; // demand in creep mode [1]
  proportional_gain: number; // Kp [N.m]
  integral_gain: number; // Ki [N.m/s]
  torque_max: number; // creep control stays between 0 and this [N.m]
  delay: number; // of the measured creepage [s], rounded to whole samples
}

/** Time between samples of the control, over which the torque is held [s]. */
export const SAMPLE = 2e-4;

/** Longest delay of the measured creepage [s]. */
export const LONGEST_DELAY = 0.5;

const HANDOVER = 0.05; // time constant [s]
const PAST = Math.round(LONGEST_DELAY / SAMPLE) + 1; // creepages that are remembered

type Law = "torque" | "proportional" | "integral";

/** Steady torque at a creepage [N.m]. */
type SteadyTorque = (creepage: number) => number;

/** Sets the drive torque, sample by sample.
 *
 * Creep control is T = T0 + Kp e, e = zeta_ref - zeta, with the measured zeta `delay` old, held
 * within its limits. With integral gain T0 is the integral of Ki e, as in
 * `contactlib.CreepControl`, except that it stops where it would lead further beyond a limit.
 * Without, T0 is the quasi-steady torque of the reference. The reference moves towards its demand by
 * at most one saturation creepage in a second, or by itself if that is more, so that a step of a
 * slider is no kick.
 *
 * No change of mode makes the torque jump: the reference starts from the present creepage, and T0
 * from the present torque; its excess then decays with the time constant `HANDOVER`.
 */
export class TorqueSource {
  torque = 0; // now [N.m]
  reference = 0; // of the creepage, now [1]
  private integral = 0; // without integral gain, what T0 has beyond the steady torque [N.m]
  private steady = 0; // T0 of creep control, now [N.m]
  private law: Law = "torque";
  private readonly past = new Float64Array(PAST);
  private samples = 0;

  /** Begin at a steady creepage and the torque that holds it. */
  start(control: Control, creepage: number, torque: number): void {
    this.torque = torque;
    this.reference = creepage;
    this.law = lawOf(control);
    this.integral = this.law === "integral" ? torque : 0;
    this.past.fill(creepage);
  }

  /** Torque to be held over the next sample, from the creepage at its start [N.m]. */
  sample(
    control: Control, creepage: number, saturation: number, steadyTorque: SteadyTorque,
  ): number {
    this.past[this.samples % PAST] = creepage;
    const law = lawOf(control), before = this.torque;
    if (law !== "torque") this.hold(control, law, saturation, steadyTorque);
    else this.torque = towards(before, control.drive_torque, control.torque_rate * SAMPLE);
    this.law = law;
    this.samples++;
    // In the middle of the sample: steps held over samples then follow the ramp.
    return law === "torque" ? 0.5 * (before + this.torque) : this.torque;
  }

  /** Torque at a creepage that is measured without delay [N.m]. */
  answer(control: Control, creepage: number): number {
    if (this.law === "torque") return this.torque;
    const torque = this.steady + control.proportional_gain * (this.reference - creepage);
    return Math.min(Math.max(torque, 0), control.torque_max);
  }

  private hold(control: Control, law: Law, saturation: number, steadyTorque: SteadyTorque): void {
    const age = Math.round(control.delay / SAMPLE); // [samples]
    const measured = this.past[(this.samples - age + PAST) % PAST]!;
    const gain = control.proportional_gain;
    if (this.law === "torque") this.reference = Math.max(measured, 0);
    const steady = law === "integral" ? 0 : steadyTorque(this.reference);
    const error = this.reference - measured;
    if (this.law !== law) this.integral = this.torque - steady - gain * error;

    this.steady = steady + this.integral;
    const torque = this.steady + gain * error;
    this.torque = Math.min(Math.max(torque, 0), control.torque_max);
    if (law === "proportional") {
      this.integral *= Math.exp(-SAMPLE / HANDOVER);
    } else if ((torque - this.torque) * error <= 0) {
      this.integral += control.integral_gain * error * SAMPLE;
    }
    const rate = Math.max(saturation, this.reference);
    this.reference = towards(this.reference, control.creepage, rate * SAMPLE);
  }
}

function lawOf(control: Control): Law {
  if (control.mode === "torque") return "torque";
  return control.integral_gain > 0 ? "integral" : "proportional";
}

function towards(from: number, to: number, largest: number): number {
  return from + Math.min(Math.max(to - from, -largest), largest);
}

const NOT_NEGATIVE = [
  "torque_rate", "creepage", "proportional_gain", "integral_gain", "torque_max",
] as const;

/** Throw an error of one line if a number of the control is out of range. */
export function checkControl(control: Control): void {
  for (const name of NOT_NEGATIVE) demand(`control.${name}`, control[name], { at_least: 0 });
  demand("control.drive_torque", control.drive_torque, {});
  demand("control.delay", control.delay, { at_least: 0, at_most: LONGEST_DELAY });
}
