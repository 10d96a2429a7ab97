/** States that a constant torque can hold at one speed, and gains of creep control for the rest. */
import type { Curves, Plant } from "./plant";
import { root } from "./roots";
import { type TorqueCurve, type Turn, torqueCurve } from "./torque_curve";
import { fallsWithSlipSpeed } from "./vehicle";

/** Where a slow torque ramp leaves the stable branch, and where it returns to it. */
export interface Fold {
  /** The first maximum of the quasi-steady torque [1, N.m]. */
  creepage: number;
  drive_torque: number;
  /** End of the run-away branch under a falling torque [1, N.m]; the creepage may be infinite. */
  return_creepage: number;
  return_torque: number;
}

/** Fold of a torque curve in traction; null if the torque never falls. */
function foldOf(curve: TorqueCurve): Fold | null {
  const { plant, speed, friction, turns, last } = curve;
  const at = turns.findIndex((turn) => !turn.rises);
  const fold = turns[at];
  if (fold === undefined) return null;
  // The run-away ends where the torque is as high again, on the branch that leads there.
  let back: Turn | undefined;
  for (let i = at + 1; i < turns.length; i++) {
    const turn = turns[i]!;
    if (turn.rises) back = turn;
    else if (turn.drive_torque > fold.drive_torque) break;
    else back = undefined;
  }
  return {
    creepage: fold.creepage,
    drive_torque: fold.drive_torque,
    return_creepage: back?.creepage ?? Infinity,
    return_torque: back?.drive_torque ?? Math.max(0, plant.torque(last, speed, friction)),
  };
}

/** A steady creepage under a constant torque [1, N.m], and the growth rate of a deviation [1/s]. */
export interface SteadyState {
  creepage: number;
  drive_torque: number;
  pole: number;
  stable: boolean;
}

/** All steady states under a torque [N.m] at creepages from zero on, by rising creepage. */
export function steadyStates(
  plant: Plant,
  driveTorque: number,
  speed: number,
  friction = 1,
): SteadyState[] {
  return statesOf(torqueCurve(plant, speed, friction), driveTorque);
}

/** The same on a torque curve. */
export function statesOf(curve: TorqueCurve, driveTorque: number): SteadyState[] {
  const { plant, speed, friction, turns, last } = curve;
  const excess = (creepage: number): number =>
    plant.torque(creepage, speed, friction) - driveTorque;
  const found: number[] = [];
  const ends = [0, ...turns.map((turn) => turn.creepage), last];
  const values = ends.map(excess);
  for (let i = 1; i < ends.length; i++) {
    const [a, b, fa, fb] = [ends[i - 1]!, ends[i]!, values[i - 1]!, values[i]!];
    if (fa === 0) found.push(a);
    else if (fb !== 0 && fa > 0 !== fb > 0) found.push(root(excess, a, b, fa, fb));
  }
  return found.map((creepage) => {
    const { drive_torque, pole } = plant.balance(creepage, speed, friction);
    return { creepage, drive_torque, pole, stable: pole < 0 };
  });
}

/**
 * Creepage at which the wheel grips under a torque [N.m]: before the curve's first turn, or zero if
 * rolling takes more than the torque; null if grip does not hold it.
 */
export function gripOf(curve: TorqueCurve, driveTorque: number): number | null {
  const { plant, speed, friction, turns } = curve;
  if (driveTorque <= plant.torque(0, speed, friction)) return 0;
  const creepage = statesOf(curve, driveTorque)[0]?.creepage ?? Infinity;
  return creepage <= (turns[0]?.creepage ?? Infinity) ? creepage : null;
}

const NEAR_POINTS = 220;
const FAR_POINTS = 180;
const BEYOND = 1.15; // torque at the curve's end over the fold's [1]

/**
 * The curve from zero through the fold and along the return branch until the torque is higher than
 * at the fold; a hundred times zeta0 if there is no return branch.
 */
export function sCurve(
  plant: Plant, speed: number, friction = 1,
): { fold: Fold | null; states: Curves } {
  const curve = torqueCurve(plant, speed, friction);
  const fold = foldOf(curve);
  const scale = plant.scales(friction).saturation_creepage;
  const near = 3 * Math.max(scale, fold?.creepage ?? 0);
  const end = Math.max(endOf(curve, fold, scale), 2 * near);
  const marks = [fold?.creepage, fold?.return_creepage].filter(
    (mark) => mark !== undefined && mark < Infinity,
  ) as number[];
  for (let i = 0; i < NEAR_POINTS; i++) marks.push((near * i) / NEAR_POINTS);
  for (let i = 0; i <= FAR_POINTS; i++) marks.push(near * (end / near) ** (i / FAR_POINTS));
  const creepage = Float64Array.from(marks).sort();
  return { fold, states: plant.curves(creepage, speed, friction) };
}

/** Creepage at which to end the curve [1]. */
function endOf(curve: TorqueCurve, fold: Fold | null, scale: number): number {
  if (fold === null) return 100 * scale;
  if (fold.return_creepage === Infinity) return Math.max(100 * scale, 10 * fold.creepage);
  const again = statesOf(curve, BEYOND * fold.drive_torque).find(
    (state) => state.creepage > fold.return_creepage,
  );
  return again?.creepage ?? Math.max(100 * scale, 10 * fold.return_creepage);
}

/**
 * Smallest gain Kp of T = T0 + Kp (zeta_ref - zeta) that holds a creepage [1] in balance at a speed
 * [m/s]: the larger of the bounds from determinant and trace of the closed loop [N.m]. It is
 * not above zero where a constant torque holds it too, and infinite where no gain does.
 */
export function creepControlGain(
  plant: Plant,
  creepage: number,
  speed: number,
  friction = 1,
): number {
  const { radius: r, inertia: j, damping: b, mass: m } = plant.vehicle;
  const contact = plant.force(creepage, speed, friction);
  const fall = -contact.force_gradient * speed;
  if (m === null) return r * fall - (b * speed) / r;
  const stretch = 1 + creepage;
  const slope = plant.rates(creepage, speed, contact).resistance_slope;
  const growth = slope - forceBySpeed(plant, stretch, contact);
  const turning = 1 + (j * stretch) / (m * r ** 2);
  const trace = r * fall * turning - (speed / r) * (b + (j * growth) / m);
  const loss = r * fall * (slope + (b * stretch) / r ** 2) - ((b * speed) / r) * growth;
  if (growth > 0) return Math.max(loss / growth, trace);
  return growth * trace >= loss ? trace : Infinity;
}

/** dQ/dV at fixed creepage [N.s/m]: zero unless friction falls with slip speed. */
function forceBySpeed(
  plant: Plant,
  stretch: number,
  contact: { force_by_speed: number; force_gradient: number },
): number {
  if (!fallsWithSlipSpeed(plant.vehicle)) return 0; // where the difference would be rounding errors
  return contact.force_by_speed + stretch * contact.force_gradient;
}

/**
 * Largest gain Kp [N.m] with which u = -Kp y holds y = g/(s - p) u, for a pole p [1/s] and a gain g
 * [1/(N.m.s)]; p/g if none does. y is sampled every `step` [s] and used `samples` steps later.
 *
 * With a = exp(p step) and b = (a - 1)/p the loop is z^n (z - a) + g Kp b = 0. A root exp(i phi)
 * asks for n phi + arg(exp(i phi) - a) = pi and g Kp b = |exp(i phi) - a|.
 */
export function largestGain(pole: number, gain: number, samples: number, step: number): number {
  const growth = Math.expm1(pole * step); // a - 1
  const b = pole === 0 ? step : growth / pole;
  if (samples === 0) return (2 + growth) / (b * gain);
  const re = (phi: number): number => -2 * Math.sin(0.5 * phi) ** 2 - growth;
  const turned = (phi: number): number =>
    samples * phi + Math.atan2(Math.sin(phi), re(phi)) - Math.PI;
  const least = 1e-6 / samples;
  if (turned(least) >= 0) return pole / gain; // with a small gain the root already moves the wrong way
  const phi = root(turned, least, Math.PI);
  return Math.max(pole, Math.hypot(Math.sin(phi), re(phi)) / b) / gain;
}

/**
 * Longest delay [s] in whole samples with which a gain above the least one [N.m] holds a pole [1/s];
 * infinite if no gain is needed, NaN if none holds it even without delay.
 */
export function longestDelay(pole: number, gain: number, least: number, step: number): number {
  if (least <= 0 && pole <= 0) return Infinity;
  const holds = (samples: number): boolean => largestGain(pole, gain, samples, step) > least;
  if (!holds(0)) return NaN;
  // Without sampling the delay is atan2(w, p)/w with w^2 = (g Kp)^2 - p^2: 1/p at most, or else pi/w.
  const last = pole > 0 ? 1 / pole : Math.PI / Math.sqrt((gain * least) ** 2 - pole ** 2);
  let low = 0, high = Math.ceil(last / step) + 1;
  while (high - low > 1) {
    const middle = Math.floor(0.5 * (low + high));
    if (holds(middle)) low = middle;
    else high = middle;
  }
  return low * step;
}
