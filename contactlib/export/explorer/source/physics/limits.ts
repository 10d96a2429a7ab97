/** Limits of numbers. */

/** A bound that is left out is infinite. */
export interface Limits {
  above?: number;
  at_least?: number;
  below?: number;
  at_most?: number;
}

/** Whether a number is finite and within its limits. */
export function allows(limits: Limits, value: number): boolean {
  return (
    Number.isFinite(value) &&
    value > (limits.above ?? -Infinity) &&
    value >= (limits.at_least ?? -Infinity) &&
    value < (limits.below ?? Infinity) &&
    value <= (limits.at_most ?? Infinity)
  );
}

/** The limits in words, such as "finite and > 0". */
export function limitText({ above, at_least, below, at_most }: Limits): string {
  const bounds = [[">", above], [">=", at_least], ["<", below], ["<=", at_most]] as const;
  const given = bounds.filter(([, bound]) => bound !== undefined);
  return ["finite", ...given.map(([sign, bound]) => `${sign} ${bound}`)].join(" and ");
}

/** One line that says how a number breaks its limits, as it was given; null if it does not. */
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
