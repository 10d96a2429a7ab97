/* What stands still on the charts until a parameter changes: the curves at one speed. */

import { type Fold, sCurve } from "../physics/stability";
import type { Plant } from "../physics/plant";

/** Values over a common grid of creepages. */
export interface Curves {
  force: Float64Array; // Q [N]
  torque: Float64Array; // quasi-steady torque [N.m]
  pole: Float64Array; // [1/s]
}

export interface Picture {
  plant: Plant;
  speed: number; // [m/s]
  fold: Fold | null;
  peak: number; // creepage of the largest force among those shown [1]
  far: number; // end of the axis of creepage [1]
  ends: [number, number]; // of a logarithmic one, for a wheel that grips [1]
  creepage: Float64Array; // from 0 to `far` [1]
  dry: Curves;
  wet: Curves | null;
  wetFriction: number;
  states: { creepage: Float64Array; drive_torque: Float64Array; pole: Float64Array };
}

const POINTS = 260;

/** Curves of a plant at one speed, on good friction and, if it differs, on that of a patch. */
export function picture(plant: Plant, speed: number, wetFriction: number): Picture {
  const { fold, states } = sCurve(plant, speed);
  const saturation = plant.scales().saturation_creepage;
  const far = Math.max(3 * saturation, 2.6 * (fold?.creepage ?? 0));
  const creepage = Float64Array.from({ length: POINTS }, (_, i) => (far * i) / (POINTS - 1));
  const dry = curves(plant, creepage, speed, 1);
  const wet = wetFriction === 1 ? null : curves(plant, creepage, speed, wetFriction);
  const peak = (topOf(dry.force) * far) / (POINTS - 1);
  const scale = fold?.creepage ?? saturation;
  const ends: [number, number] = [1 / roundUp(5 / scale), roundUp(5 * scale)];
  return { plant, speed, fold, peak, far, ends, creepage, dry, wet, wetFriction, states };
}

function curves(plant: Plant, creepage: Float64Array, speed: number, friction: number): Curves {
  const n = creepage.length, gain = plant.gain(speed);
  const found = { force: new Float64Array(n), torque: new Float64Array(n), pole: new Float64Array(n) };
  creepage.forEach((zeta, i) => {
    const { creep_force, drive_torque, slope } = plant.balance(zeta, speed, friction);
    found.force[i] = creep_force;
    found.torque[i] = drive_torque;
    found.pole[i] = -gain * slope;
  });
  return found;
}

/** Place of the highest of even points, by the parabola through it and its neighbours [points]. */
function topOf(values: Float64Array): number {
  const i = values.indexOf(Math.max(...values));
  const [a, b, c] = [values[i - 1], values[i], values[i + 1]];
  if (a === undefined || b === undefined || c === undefined || a - 2 * b + c === 0) return i;
  return i + (0.5 * (a - c)) / (a - 2 * b + c);
}

/** The least of 1 and 3 times a power of ten that is not below a number. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return value <= power * (1 + 1e-9) ? power : value <= 3 * power ? 3 * power : 10 * power;
}

/** Values where the pole is stable, and where it is not; both have the points where it changes. */
export function byStability(
  values: ArrayLike<number>, pole: ArrayLike<number>, scale = 1,
): [(number | null)[], (number | null)[]] {
  const stable: (number | null)[] = [], unstable: (number | null)[] = [];
  for (let i = 0; i < values.length; i++) {
    const value = scale * (values[i] as number);
    const here = (pole[i] as number) < 0, before = i > 0 ? (pole[i - 1] as number) < 0 : here;
    stable.push(here || before ? value : null);
    unstable.push(!here || !before ? value : null);
  }
  return [stable, unstable];
}
