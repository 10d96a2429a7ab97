/* What the charts show: the curves, which change with a parameter only, and the moment. */

import type { Control, Run } from "../physics/run";
import type { Curves, Fold, Plant, Point } from "../physics/plant";

/** Curves at one speed. */
export interface Picture {
  plant: Plant;
  speed: number; // [m/s]
  fold: Fold | null;
  largest: { torque: number; force: number }; // the fold's torque, or without it the largest [N.m, N]
  peak: number; // creepage of the largest force [1]
  far: number; // end of the axis of creepage [1]
  ends: [number, number]; // of a logarithmic one, for a wheel that grips [1]
  dry: Curves; // from 0 to `far`
  wet: Curves | null;
  wetFriction: number;
  states: Curves; // along the S-curve
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

const POINTS = 260;
const STATES = 300; // of the S-curve

/** Creepage that the S-curve ends at [1]. */
export const MAX_CREEPAGE = 10;

/** Curves of a plant at one speed, on good friction and, if it differs, on that of a patch. */
export function picture(plant: Plant, speed: number, wetFriction: number): Picture {
  const fold = plant.fold(speed), saturation = plant.scales().saturation_creepage;
  const far = Math.max(3 * saturation, 2.6 * (fold?.creepage ?? 0));
  const creepage = Float64Array.from({ length: POINTS }, (_, i) => (far * i) / (POINTS - 1));
  const dry = plant.curves(creepage, speed);
  const wet = wetFriction === 1 ? null : plant.curves(creepage, speed, wetFriction);
  const { creepage: highest, force } = plant.peak(speed);
  const largest = { torque: fold?.drive_torque ?? Math.max(...dry.torque), force };
  const peak = Math.min(highest, far), scale = fold?.creepage ?? saturation;
  const ends: [number, number] = [1 / roundUp(5 / scale), roundUp(5 * scale)];
  const marks = [fold?.creepage, fold?.return_creepage].filter((at) => at !== undefined && at < MAX_CREEPAGE);
  for (let i = 0; i <= STATES; i++) marks.push(ends[0] * (MAX_CREEPAGE / ends[0]) ** (i / STATES));
  const states = plant.curves(Float64Array.from(marks as number[]).sort(), speed);
  return { plant, speed, fold, largest, peak, far, ends, dry, wet, wetFriction, states };
}

/** The smallest of 1 and 3 times powers of ten that is not below a number. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return value <= power * (1 + 1e-9) ? power : value <= 3 * power ? 3 * power : 10 * power;
}

/** Values where the pole is stable, and where it is not; both have the points where it changes. */
export function byStability(values: Float64Array, pole: Float64Array): (number | null)[][] {
  const holds = (i: number): boolean => pole[i]! < 0;
  return [true, false].map((stable) => Array.from(values, (value, i) =>
    holds(i) === stable || holds(Math.max(i - 1, 0)) === stable ? value : null));
}
