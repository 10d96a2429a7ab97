/** Roots of functions of one variable. */

export type Curve = (x: number) => number;

const ROUNDING = 2 * Number.EPSILON;

/**
 * Place between `a` and `b` where `f` changes sign, to rounding. The values at the ends may be given;
 * they must differ in sign, or one be zero.
 *
 * T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149: inverse quadratic
 * interpolation where the last three points allow it, bisection elsewhere.
 * A jump through zero is found as well.
 */
export function root(f: Curve, a: number, b: number, fa = f(a), fb = f(b)): number {
  if (fa === 0) return a;
  if (fb === 0) return b;
  if (fa > 0 === fb > 0 || !(Number.isFinite(fa) && Number.isFinite(fb))) {
    throw new RangeError(`no root is enclosed: f(${a}) = ${fa}, f(${b}) = ${fb}`);
  }
  let [x1, f1, x2, f2] = [a, fa, b, fb]; // the newest point, and the one beyond the root
  let share = 0.5; // of the way from the first to the second
  for (;;) {
    const x = x1 + share * (x2 - x1);
    const value = f(x);
    let [x3, f3] = [x1, f1];
    if (value > 0 !== f1 > 0) [x3, f3, x2, f2] = [x2, f2, x1, f1];
    [x1, f1] = [x, value];
    const nearest = Math.abs(f1) < Math.abs(f2) ? x1 : x2;
    const least = (ROUNDING * Math.abs(nearest) + Number.MIN_VALUE) / Math.abs(x2 - x1);
    if (value === 0 || !(least < 0.5)) return nearest;
    const xi = (x1 - x2) / (x3 - x2);
    const phi = (f1 - f2) / (f3 - f2);
    const trusted = phi ** 2 < xi && (1 - phi) ** 2 < 1 - xi;
    const quadratic =
      (f1 / (f2 - f1)) * (f3 / (f2 - f3)) +
      ((x3 - x1) / (x2 - x1)) * (f1 / (f3 - f1)) * (f2 / (f3 - f2));
    share = trusted ? Math.min(Math.max(quadratic, least), 1 - least) : 0.5;
  }
}

const GOLDEN = (3 - Math.sqrt(5)) / 2;

/**
 * A place between `a` and `b` where `f`, which has the same sign on both sides and is nearer to
 * zero between them, has the other sign; null if it only comes near.
 */
export function otherSide(f: Curve, a: number, b: number): number | null {
  const sign = Math.sign(f(a));
  const height = (x: number): number => sign * f(x);
  let [low, high] = [a, b];
  let [x1, x2] = [low + GOLDEN * (high - low), high - GOLDEN * (high - low)];
  let [y1, y2] = [height(x1), height(x2)];
  while (high - low > 1e-7 * Math.abs(high)) {
    if (y1 < 0) return x1;
    if (y2 < 0) return x2;
    if (y1 < y2) {
      [high, x2, y2] = [x2, x1, y1];
      x1 = low + GOLDEN * (high - low);
      y1 = height(x1);
    } else {
      [low, x1, y1] = [x1, x2, y2];
      x2 = high - GOLDEN * (high - low);
      y2 = height(x2);
    }
  }
  return null;
}
