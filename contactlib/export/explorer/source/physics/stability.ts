/** Gains and delays of creep control about a state that a torque cannot hold. */
import type { Point } from "./plant";

/** Whether a state holds under a constant torque. */
export const isStable = ({ pole }: Point): boolean => pole < 0;

/**
 * Sampled every `step` [s] and used n samples later, u = -K y holds y = g/(s - p) u while all roots of
 * z^n (z - a) + g K b = 0 are within the unit circle, with a = exp(p step) and b = (a - 1)/p. A root
 * exp(i phi) asks for n phi + arg(exp(i phi) - a) = pi and g K b = |exp(i phi) - a|.
 */
class Loop {
  private readonly growth: number; // a - 1
  private readonly perGain: number; // g b

  constructor(private readonly pole: number, private readonly gain: number, step: number) {
    this.growth = Math.expm1(pole * step);
    this.perGain = gain * (pole === 0 ? step : this.growth / pole);
  }

  /** Size and turn of exp(i phi) - a. */
  private at(phi: number): { size: number; turned: number } {
    const re = -2 * Math.sin(0.5 * phi) ** 2 - this.growth, im = Math.sin(phi);
    return { size: Math.hypot(im, re), turned: Math.atan2(im, re) };
  }

  /** Largest K for n samples; p/g if none holds. */
  largestGain(samples: number): number {
    if (samples === 0) return (2 + this.growth) / this.perGain;
    const beyond = (phi: number): boolean => samples * phi + this.at(phi).turned >= Math.PI;
    let low = 1e-6 / samples, high = Math.PI;
    const least = this.pole / this.gain;
    if (beyond(low)) return least; // with a small gain the root already moves the wrong way
    for (let middle; (middle = 0.5 * (low + high)) > low && middle < high;) {
      if (beyond(middle)) high = middle;
      else low = middle;
    }
    return Math.max(least, this.at(high).size / this.perGain);
  }

  /** The most samples with which some K above the least one holds; NaN if none does without delay. */
  mostSamples(least: number): number {
    const size = this.perGain * least;
    if (size >= 2 + this.growth) return NaN;
    const square = (size ** 2 - this.growth ** 2) / (4 * (1 + this.growth)); // of sin(phi/2)
    if (square < 0 && this.pole <= 0) return Infinity;
    const phi = 2 * Math.asin(Math.sqrt(Math.max(square, 1e-16)));
    return Math.ceil((Math.PI - this.at(phi).turned) / phi) - 1;
  }
}

/**
 * Largest gain [N.m] with which u = -Kp y holds y = g/(s - p) u, for a pole p [1/s] and a gain g
 * [1/(N.m.s)]; p/g if none does. y is sampled every `step` [s] and used `samples` steps later.
 */
export function largestGain(pole: number, gain: number, samples: number, step: number): number {
  return new Loop(pole, gain, step).largestGain(samples);
}

/**
 * Longest delay [s] in whole samples with which a gain above the least one [N.m] holds a pole [1/s];
 * infinite if no gain is needed, NaN if none holds it even without delay.
 */
export function longestDelay(pole: number, gain: number, least: number, step: number): number {
  if (least <= 0 && pole <= 0) return Infinity;
  return new Loop(pole, gain, step).mostSamples(least) * step;
}
