/** The fold of the steady states, and gains of creep control for those that a torque cannot hold. */
import type { Curves, Plant, Point } from "./plant";

/** Where a slow torque ramp leaves the stable branch, and where it returns to it. */
export interface Fold {
  /** The first maximum of the quasi-steady torque [1, N.m]. */
  creepage: number;
  drive_torque: number;
  /** End of the run-away branch under a falling torque [1, N.m]; the creepage may be infinite. */
  return_creepage: number;
  return_torque: number;
}

/** Whether a state holds under a constant torque. */
export const isStable = ({ pole }: Point): boolean => pole < 0;

/** Fold of a curve of these turns; null if the torque never falls. */
function foldOf(turns: Point[]): Fold | null {
  const fold = turns[0]!, end = turns.at(-1)!;
  if (turns.length === 1) return null;
  // The run-away ends where the torque is as high again, on the branch that leads there.
  const higher = turns.findIndex(({ torque }) => torque > fold.torque);
  const landing = higher < 0 ? turns.length - 1 : higher, back = turns[landing - 1]!;
  const returns = landing > 1 && turns[landing]!.torque > back.torque;
  return {
    creepage: fold.creepage,
    drive_torque: fold.torque,
    return_creepage: returns ? back.creepage : Infinity,
    return_torque: returns ? back.torque : Math.max(0, end.torque),
  };
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
  const fold = foldOf(plant.turns(speed, friction));
  const scale = plant.scales(friction).saturation_creepage;
  const near = 3 * Math.max(scale, fold?.creepage ?? 0);
  let end = 100 * scale;
  if (fold !== null && fold.return_creepage === Infinity) end = Math.max(end, 10 * fold.creepage);
  else if (fold !== null) {
    const again = plant.steady(BEYOND * fold.drive_torque, speed, friction)
      .find(({ creepage }) => creepage > fold.return_creepage);
    end = again?.creepage ?? Math.max(end, 10 * fold.return_creepage);
  }
  end = Math.max(end, 2 * near);
  const marks = fold === null ? [] : [fold.creepage, fold.return_creepage].filter(Number.isFinite);
  for (let i = 0; i < NEAR_POINTS; i++) marks.push((near * i) / NEAR_POINTS);
  for (let i = 0; i <= FAR_POINTS; i++) marks.push(near * (end / near) ** (i / FAR_POINTS));
  return { fold, states: plant.curves(Float64Array.from(marks).sort(), speed, friction) };
}

/**
 * Smallest gain Kp of T = T0 + Kp (zeta_ref - zeta) that holds a creepage [1] in balance at a speed
 * [m/s]: the larger of the bounds from determinant and trace of the closed loop [N.m]. It is
 * not above zero where a constant torque holds it too, and infinite where no gain does.
 */
export function creepControlGain(
  plant: Plant, creepage: number, speed: number, friction = 1,
): number {
  const rates = plant.rates(creepage, speed, friction);
  const omega = ((1 + creepage) * speed) / plant.vehicle.radius;
  const { "jacobian[0][0]": a, "jacobian[0][1]": b, "jacobian[1][0]": c, "jacobian[1][1]": d } = rates;
  // With T = -Kp zeta the trace is a + d - g Kp, and the determinant a d - b c + g Kp decay.
  const gain = plant.gain(speed), trace = (a + d) / gain;
  const [loss, decay] = [difference(b * c, a * d), difference(-d, (c * omega) / speed)];
  if (decay > 0) return Math.max(loss / (gain * decay), trace);
  return gain * decay * trace >= loss ? trace : Infinity;
}

/** Difference of two numbers; zero where it would be rounding errors alone. */
function difference(from: number, taken: number): number {
  const found = from - taken;
  return Math.abs(found) > 1e-12 * Math.abs(taken) ? found : 0;
}

/** Place between two others where a function changes sign, by halvings. */
export function crossing(f: (x: number) => number, low: number, high: number, closest = 0): number {
  const above = f(high) > 0;
  for (;;) {
    const middle = 0.5 * (low + high);
    if (high - low <= closest * high || middle <= low || middle >= high) return middle;
    if (f(middle) > 0 === above) high = middle;
    else low = middle;
  }
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
  const phi = crossing(turned, least, Math.PI);
  return Math.max(pole, Math.hypot(Math.sin(phi), re(phi)) / b) / gain;
}

/**
 * Longest delay [s] in whole samples with which a gain above the least one [N.m] holds a pole [1/s];
 * infinite if no gain is needed, NaN if none holds it even without delay.
 */
export function longestDelay(pole: number, gain: number, least: number, step: number): number {
  if (least <= 0 && pole <= 0) return Infinity;
  const lacks = (samples: number): number => least - largestGain(pole, gain, samples, step);
  if (lacks(0) >= 0) return NaN;
  // Without sampling the delay is atan2(w, p)/w with w^2 = (g Kp)^2 - p^2: 1/p at most, or else pi/w.
  const last = pole > 0 ? 1 / pole : Math.PI / Math.sqrt((gain * least) ** 2 - pole ** 2);
  let low = 0, high = Math.ceil(last / step) + 1;
  while (high - low > 1) {
    const middle = Math.floor(0.5 * (low + high));
    if (lacks(middle) < 0) low = middle;
    else high = middle;
  }
  return low * step;
}
