// How an ellipse on a half-space rolls against strips, as contactlib's half_space_scales has it.

import { embeddedData } from "../kernel/embedded";

/** Stiffness over that of strips, and the part of it that is lost up to saturation [1]. */
export interface Scales {
  stiffness: number;
  softening: number;
}

// Chebyshev coefficients of ln(c11), rows in ln(a/b)/3, columns in 4 nu - 1.
const C11 = embeddedData("creep-coefficients") as number[][];
const POINTS = 64;

function chebyshev(coefficients: number[], x: number): number {
  return coefficients.reduce((sum, c, i) => sum + c * Math.cos(i * Math.acos(x)), 0);
}

/** Scales of an ellipse along rolling; fmu/half_space.c has the formulas. */
export function halfSpaceScales(aspect: number, nu: number): Scales {
  const g = Math.min(Math.max(aspect, 0.05), 20);
  const c11 = Math.exp(
    chebyshev(C11.map((row) => chebyshev(row, 4 * nu - 1)), Math.log(g) / 3));
  const stiffness = (c11 * (1 - nu) * 4) / Math.PI ** 2;
  let saturation = 0;
  for (let i = 0; i < POINTS; i++) {
    const square = Math.sin((i * Math.PI) / POINTS) ** 2;
    const circle = g * (1 - square) + square, ellipse = 1 - square + g * square;
    const part = (0.5 * g * square) / (Math.sqrt(circle * ellipse) * ellipse);
    saturation += ((part * Math.PI) / POINTS) * (1 - (nu * square) / circle) / (1 - nu);
  }
  const at = stiffness * saturation;
  return { stiffness, softening: (1 - 1 / at) / at };
}
