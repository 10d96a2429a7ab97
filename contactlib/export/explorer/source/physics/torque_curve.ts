/** Curve of the quasi-steady torque over creepages of traction, described by its turns. */
import type { Plant } from "./plant";
import { otherSide, root } from "./roots";
import { leastLeft } from "./vehicle";

/** Where the torque changes between rising and falling with creepage. */
export interface Turn {
  creepage: number;
  drive_torque: number;
  /** Whether the torque rises beyond it. */
  rises: boolean;
}

/** The curve at one speed and friction; between two turns it only rises or only falls. */
export interface TorqueCurve {
  plant: Plant;
  speed: number;
  friction: number;
  turns: Turn[];
  /** The largest creepage looked at [1]. */
  last: number;
}

const PER_DECADE = 12;
const NEAREST = 1e-5; // node next to the corner, over its creepage

/** Find all turns of the torque at creepages from zero on. */
export function torqueCurve(plant: Plant, speed: number, friction = 1): TorqueCurve {
  // A slope of zero counts as falling, so that a plateau begins with a turn.
  const slope = (creepage: number): number =>
    plant.balance(creepage, speed, friction).slope || -Number.MIN_VALUE;
  const last = lastCreepage(plant, speed, friction);
  const nodes = grid(corner(plant, speed, friction), last);
  const slopes = nodes.map(slope);
  const turns: Turn[] = [];
  const add = (a: number, b: number, fa: number, fb: number): void => {
    const creepage = root(slope, a, b, fa, fb);
    turns.push({
      creepage,
      drive_torque: plant.torque(creepage, speed, friction),
      rises: fb > 0,
    });
  };
  for (let i = 1; i < nodes.length; i++) {
    const [a, b, fa, fb] = [nodes[i - 1]!, nodes[i]!, slopes[i - 1]!, slopes[i]!];
    if (fa > 0 !== fb > 0) {
      add(a, b, fa, fb);
      continue;
    }
    const [c, fc] = [nodes[i + 1], slopes[i + 1]];
    if (c === undefined || fc === undefined || !mayTurn(fa, fb, fc)) continue;
    const hidden = otherSide(slope, a, c);
    if (hidden === null) continue;
    const f = slope(hidden);
    add(a, hidden, fa, f);
    add(hidden, c, f, fc);
    i++;
  }
  return { plant, speed, friction, turns, last };
}

/** Whether a curve through three values of one sign may turn back beyond zero between them. */
function mayTurn(before: number, here: number, after: number): boolean {
  if (here > 0 !== after > 0) return false;
  const [a, b, c] = [Math.abs(before), Math.abs(here), Math.abs(after)];
  // It turns below the least by no more than it rises from there to the others.
  return b <= Math.min(a, c) && 3 * b <= a + c;
}

/** Creepage at which the normalized one is 1, where friction may have fallen with slip speed. */
function corner(plant: Plant, speed: number, friction: number): number {
  const whole = plant.scales(friction).saturation_creepage;
  const excess = (creepage: number): number =>
    Math.log(plant.force(creepage, speed, friction).normalized_creepage);
  const least = whole * leastLeft(plant.vehicle);
  if (!(excess(whole) > 1e-6 && excess(least) < 0)) return whole;
  return root(excess, least, whole);
}

/** Creepages that are dense enough for all layers of the law: it changes within k_hat ** 0.8 of the
 * corner, so the nodes crowd there. */
function grid(corner: number, last: number): number[] {
  const ratio = 10 ** (1 / PER_DECADE);
  const below: number[] = [];
  const above: number[] = [];
  for (let d = NEAREST; d < 1; d *= ratio) below.push(corner * (1 - d));
  for (let d = NEAREST; corner * (1 + d) < last; d *= ratio) above.push(corner * (1 + d));
  return [0, ...below.reverse(), ...above, last];
}

/** A creepage beyond the fall of friction with slip speed, and far in the tail of the law [1]. */
function lastCreepage(plant: Plant, speed: number, friction: number): number {
  const whole = plant.scales(friction).saturation_creepage;
  const fall = plant.vehicle.slip_rate_decay * speed * whole; // over one zeta0
  if (plant.vehicle.softening_temperature > 0) return whole * 1e6; // it falls for ever
  return whole * Math.max(1e5, fall > 0 ? 40 / fall : 0);
}
