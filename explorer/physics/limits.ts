/** Limits of numbers. */

/** A bound that is left out is infinite. */
export interface Limits {
  above?: number;
  at_least?: number;
  below?: number;
  at_most?: number;
}

const BOUNDS: [keyof Limits, sign: string, holds: (value: number, bound: number) => boolean][] = [
  ["above", ">", (value, bound) => value > bound],
  ["at_least", ">=", (value, bound) => value >= bound],
  ["below", "<", (value, bound) => value < bound],
  ["at_most", "<=", (value, bound) => value <= bound],
];

/** Whether a number is finite and within its limits. */
export function allows(limits: Limits, value: number): boolean {
  return Number.isFinite(value) &&
    BOUNDS.every(([name, , holds]) => limits[name] === undefined || holds(value, limits[name]));
}

/** The limits in words and in some unit, such as "finite and > 0". */
export function limitText(limits: Limits, shown: (bound: number) => string = String): string {
  const given = BOUNDS.filter(([name]) => limits[name] !== undefined);
  return ["finite", ...given.map(([name, sign]) => `${sign} ${shown(limits[name]!)}`)].join(" and ");
}

/** One line on how a number breaks its limits, as it was given; null if it does not. */
export function outOfRange(
  name: string, value: number, limits: Limits, given = String(value),
): string | null {
  if (allows(limits, value)) return null;
  return `${name} = ${given} is out of range: must be ${limitText(limits)}`;
}

/** Throw that line as a RangeError. */
export function demand(name: string, value: number, limits: Limits): void {
  const problem = outOfRange(name, value, limits);
  if (problem !== null) throw new RangeError(problem);
}
