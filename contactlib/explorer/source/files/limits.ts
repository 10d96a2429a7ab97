// Limits of the numbers in a model file: Python's own, which the build puts into the page.

import { pageData } from "./page_data";

/** Bounds of a number [in SI units]; a bound left out is infinite. */
export interface Limit {
  unit: string;
  above?: number;
  at_least?: number;
  below?: number;
  at_most?: number;
}

/** Limits by section and key, such as "contact.normal_load". */
export type Limits = Readonly<Record<string, Limit>>;

/** The limits that the build put into the page. */
export function pageLimits(): Limits {
  return pageData("limits") as Limits;
}

/** Whether a number is finite and within its bounds. */
export function allows(limit: Limit, value: number): boolean {
  return (
    Number.isFinite(value) &&
    value > (limit.above ?? -Infinity) &&
    value >= (limit.at_least ?? -Infinity) &&
    value < (limit.below ?? Infinity) &&
    value <= (limit.at_most ?? Infinity)
  );
}

/** The bounds in words, such as "finite and > 0". */
export function limitText(limit: Limit): string {
  const bounds: [string, number | undefined][] = [
    [">", limit.above],
    [">=", limit.at_least],
    ["<", limit.below],
    ["<=", limit.at_most],
  ];
  const given = bounds.filter(([, bound]) => bound !== undefined);
  return ["finite", ...given.map(([sign, bound]) => `${sign} ${bound}`)].join(" and ");
}
