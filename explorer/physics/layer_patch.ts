/** Shear traction of a line contact with a thin elastic layer, on which `contactlib.laws.layer` has the
 * theory: its Eqs. (1) to (3), here with a constant traction in each of a few cells. */

const CELLS = 32, GRADED = 3; // the cells are narrower towards both ends
const STEPS = 40; // of the search for the stick boundary, at most

/** The stick zone from its boundary, 0, to the leading edge, 1: middles and widths of the cells. */
const edges = Float64Array.from({ length: CELLS + 1 }, (_, i) => {
  const part = (2 * i) / CELLS;
  return part <= 1 ? 0.5 * part ** GRADED : 1 - 0.5 * (2 - part) ** GRADED;
});
const width = edges.slice(1).map((edge, i) => edge - edges[i]!);
const middle = edges.slice(1).map((edge, i) => 0.5 * (edge + edges[i]!));

/** Integral of ln|t - s| over a cell. */
function logarithm(t: number, cell: number): number {
  const part = (y: number): number => (y === 0 ? 0 : y * Math.log(Math.abs(y)));
  return part(t - edges[cell]!) - part(t - edges[cell + 1]!) - width[cell]!;
}

/** Potential (1/pi) int r ln|(1 - s)/(t - s)| ds by the traction of each cell. */
const potentialAt = (t: number): Float64Array =>
  width.map((_, cell) => (logarithm(1, cell) - logarithm(t, cell)) / Math.PI);
const potential = Float64Array.from(Array.from(middle, potentialAt).flatMap((row) => [...row])); // by rows
const atStart = potentialAt(0);
const matrix = new Float64Array(CELLS * CELLS); // that is being solved

function dot(a: Float64Array, b: Float64Array, from = 0): number {
  let sum = 0;
  for (let i = 0; i < CELLS; i++) sum += a[from + i]! * b[i]!;
  return sum;
}

/** Solve (Lam + potential) y = b for two b, which become y. The diagonal is large enough. */
function solve(lam: number, one: Float64Array, other: Float64Array): void {
  matrix.set(potential);
  for (let i = 0; i < CELLS; i++) matrix[i * (CELLS + 1)]! += lam;
  for (let i = 0; i < CELLS; i++) {
    const pivot = i * CELLS;
    for (let row = pivot + CELLS, k = i + 1; k < CELLS; k++, row += CELLS) {
      const factor = matrix[row + i]! / matrix[pivot + i]!;
      for (let j = i + 1; j < CELLS; j++) matrix[row + j]! -= factor * matrix[pivot + j]!;
      one[k]! -= factor * one[i]!;
      other[k]! -= factor * other[i]!;
    }
  }
  for (let i = CELLS - 1; i >= 0; i--) {
    const row = i * CELLS;
    for (let j = i + 1; j < CELLS; j++) {
      one[i]! -= matrix[row + j]! * one[j]!;
      other[i]! -= matrix[row + j]! * other[j]!;
    }
    one[i]! /= matrix[row + i]!;
    other[i]! /= matrix[row + i]!;
  }
}

/** The state with the stick boundary c, t^4 = (1 + c)/(1 - c): its creepage over zeta0, and the stick
 * zone with its traction over f_d p0. */
interface State { creepage: number; boundary: number; position: number[]; traction: number[] }

function stateAt(logT: number, kHat: number, lam: number): State {
  const t = Math.exp(logT), s = 1 / (1 + t ** 4), m = t < 1 ? t ** 4 * s : 1 / (1 + t ** -4), d = 2 * s;
  const r = middle.map((at) => 1 - at);
  const sliding = middle.map((at) => Math.sqrt(d * (1 - at) * (2 * m + d * at)));
  const g = sliding.map((p, i) => (0.5 * p * p) / d - dot(potential, sliding, i * CELLS));
  solve(lam / d, r, g);
  // Lam times r and g at the boundary, Eq. (2) at t = 0.
  const r0 = 1 - dot(r, atStart), g0 = m - dot(sliding, atStart) - dot(g, atStart);
  const stiffness = (2 / Math.PI) * dot(r, width);
  const creepage = ((lam / d) * 2 * Math.sqrt(m * s) + g0) / r0 + (kHat * t) / Math.sqrt(stiffness); // Eq. (3)
  const boundary = m - s;
  const traction = Array.from(r, (value, i) => creepage * value - g[i]!);
  return {
    creepage, boundary,
    position: [boundary, ...Array.from(middle, (at) => boundary + d * at), 1],
    traction: [(creepage * r0 - g0) * (d / lam), ...traction, 0],
  };
}

/** The state at a creepage over zeta0 above zero, by the secant method inside a bracket of ln t. */
export function layeredState(x: number, kHat: number, lam: number): State {
  let low = -16, high = 8, at = Math.min(0.5 * Math.log(x / (1 + lam)), 0.9 * high);
  let state = stateAt(at, kHat, lam), before: [number, number] | null = null;
  for (let i = 0; i < STEPS; i++) {
    const off = Math.log(state.creepage / x);
    if (Math.abs(off) < 1e-4 || high - low < 1e-9) break;
    if (off > 0) high = at;
    else low = at;
    const slope: number = before === null ? 2 : (off - before[1]) / (at - before[0]);
    before = [at, off];
    const next: number = at - off / slope;
    at = next > low && next < high ? next : 0.5 * (low + high);
    state = stateAt(at, kHat, lam);
  }
  return state;
}
