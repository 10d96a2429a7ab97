/* What the charts show: the curves, which change with a parameter only, and the moment. */

import type { Control, Run } from "../physics/run";
import type { Curves, Fold, Plant, Point } from "../physics/plant";
import { isStable } from "../physics/stability";

/** Curves at one speed. */
export interface Picture {
  plant: Plant;
  speed: number; // [m/s]
  fold: Fold | null;
  largest: { torque: number; force: number }; // the fold's torque, or without it the largest [N.m, N]
  peak: number; // creepage of the largest force [1]
  base: number; // least end of an axis of creepage [1]
  axes: Axes;
  ends: [number, number]; // of a logarithmic one, for a wheel that grips [1]
  dry: Curves; // from 0 to the horizon
  wet: Curves | null;
  wetFriction: number;
  states: Curves; // along the S-curve
}

/** Creepages that the axes have to contain beside those of the curve [1]. */
export interface Reach {
  border: number; // of the grip under the present torque
  upper: number; // largest at which that torque can hold the wheel
  wheel: number; // of the wheel, as long as its trail is drawn
}

/** Ends of the axes of creepage [1]. */
export interface Axes {
  far: number; // of grip and its border
  horizon: number; // of the wheel as well
  highest: number; // of the logarithmic one of the S-curve
}

/** The moment that is drawn. */
export interface Moment {
  run: Run;
  control: Control;
  shown: Picture;
  /** Steady states under the present torque, on the friction under the wheel. */
  rests: Point[];
  /** Simulated time that the charts look back [s]. */
  span: number;
}

/** Part of the span that the wheel's trail lasts in the phase portrait. */
export const TRAILED = 0.4;

/** Points of a curve from zero to `base`; others go on to the horizon. */
export const POINTS = 260;

const STATES = 300; // of the S-curve
const MAX_CREEPAGE = 10; // that the S-curve ends at, if nothing is beyond [1]

/** Curves of a plant at one speed, on good friction and, if it differs, on that of a patch. */
export function picture(plant: Plant, speed: number, wetFriction: number, reach: Reach): Picture {
  const fold = plant.fold(speed), saturation = plant.scales().saturation_creepage;
  const { creepage: strongest, force } = plant.peak(speed), { slope } = plant.at(0, speed);
  // A layer lowers the slope, so that the force bends where its tangent at zero reaches the peak.
  const bend = (force * plant.vehicle.radius) / slope;
  const base = Math.max(3 * saturation, 5 * bend, 2.6 * (fold?.creepage ?? 0));
  const ends = axes(base, reach), { far, horizon, highest } = ends;
  const even = Array.from({ length: POINTS }, (_, i) => (base * i) / (POINTS - 1));
  const beyond = horizon > base ? Array.from({ length: POINTS }, (_, i) =>
    base * (horizon / base) ** ((i + 1) / POINTS)) : [];
  const creepage = Float64Array.of(...even, ...beyond);
  const dry = plant.curves(creepage, speed);
  const wet = wetFriction === 1 ? null : plant.curves(creepage, speed, wetFriction);
  const largest = { torque: fold?.drive_torque ?? Math.max(...dry.torque.subarray(0, POINTS)), force };
  const peak = Math.min(strongest, far), scale = fold?.creepage ?? saturation;
  const gripping: [number, number] = [1 / roundUp(5 / scale), roundUp(5 * scale)];
  const marks = [fold?.creepage, fold?.return_creepage].filter((at) => at !== undefined && at < highest);
  for (let i = 0; i <= STATES; i++) marks.push(gripping[0] * (highest / gripping[0]) ** (i / STATES));
  const states = plant.curves(Float64Array.from(marks as number[]).sort(), speed);
  return {
    plant, speed, fold, largest, peak, base, axes: ends, ends: gripping, dry, wet, wetFriction, states,
  };
}

/** Ends of the axes that contain all of this, in steps, so that they seldom change. */
export function axes(base: number, { border, upper, wheel }: Reach): Axes {
  const far = stretched(base, 1.2 * border);
  return {
    far,
    horizon: stretched(far, 1.1 * wheel),
    highest: Math.max(MAX_CREEPAGE, roundUp(1.2 * Math.max(upper, wheel))),
  };
}

/** The smallest of 1, 2, 5, 10, ... times a length that is not below a value. */
function stretched(length: number, value: number): number {
  let end = length;
  for (let i = 0; end < value; i++) end *= [2, 2.5, 2][i % 3]!;
  return end;
}

/** The smallest of 1 and 3 times powers of ten that is not below a number. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return value <= power * (1 + 1e-9) ? power : value <= 3 * power ? 3 * power : 10 * power;
}

/** Values of stable states, and of others; both have the points where that changes. */
export function byStability(values: Float64Array, { slope }: Curves): (number | null)[][] {
  const holds = (i: number): boolean => isStable({ slope: slope[i]! });
  return [true, false].map((stable) => Array.from(values, (value, i) =>
    holds(i) === stable || holds(Math.max(i - 1, 0)) === stable ? value : null));
}
