/** Gains and delays of creep control about a state that a torque cannot hold. */
import { SAMPLE } from "./control";
import type { Point } from "./plant";

/** Whether a constant torque holds a state at its speed. The pole of a free vehicle also contains how
 * slowly it gains speed. */
export const isStable = ({ slope }: Pick<Point, "slope">): boolean => slope > 0;

/**
 * The loop of y = g/(s - p) u and u = -K y, where y is sampled and used n samples later, for a pole p
 * [1/s] and a gain g [1/(N.m.s)]. It is stable while all roots of z^n (z - a) + g K b = 0 are within the
 * unit circle, with a = exp(p step) and b = (a - 1)/p. A root exp(i phi) requires
 * n phi + arg(exp(i phi) - a) = pi and g K b = |exp(i phi) - a|.
 */
export class Loop {
  private readonly growth: number; // a - 1
  private readonly perGain: number; // g b

  constructor(private readonly pole: number, private readonly gain: number) {
    this.growth = Math.expm1(pole * SAMPLE);
    this.perGain = gain * (pole === 0 ? SAMPLE : this.growth / pole);
  }

  /** Size and turn of exp(i phi) - a. */
  private at(phi: number): { size: number; turned: number } {
    const re = -2 * Math.sin(0.5 * phi) ** 2 - this.growth, im = Math.sin(phi);
    return { size: Math.hypot(im, re), turned: Math.atan2(im, re) };
  }

  /** Largest K that holds for n samples [N.m]; p/g if none does. */
  largestGain(samples: number): number {
    if (samples === 0) return (2 + this.growth) / this.perGain;
    const beyond = (phi: number): boolean => samples * phi + this.at(phi).turned >= Math.PI;
    const lowest = this.pole / this.gain;
    let low = 1e-6 / samples, high = Math.PI;
    if (beyond(low)) return lowest; // with a small gain the root already moves the wrong way
    for (let middle; (middle = 0.5 * (low + high)) > low && middle < high;) {
      if (beyond(middle)) high = middle;
      else low = middle;
    }
    return Math.max(lowest, this.at(high).size / this.perGain);
  }

  /** Longest delay [s] in whole samples with which some K above a least one [N.m] holds; infinite if
   * no gain is needed, NaN if none holds even without delay. */
  longestDelay(lowest: number): number {
    const size = this.perGain * lowest;
    if (size >= 2 + this.growth) return NaN;
    const square = (size ** 2 - this.growth ** 2) / (4 * (1 + this.growth)); // of sin(phi/2)
    if (this.pole <= 0 && (lowest <= 0 || square < 0)) return Infinity;
    const phi = 2 * Math.asin(Math.sqrt(Math.max(square, 1e-16)));
    return (Math.ceil((Math.PI - this.at(phi).turned) / phi) - 1) * SAMPLE;
  }
}
