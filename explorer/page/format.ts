/* Numbers as the page shows them: their digits, a true minus, and units. */

/** A number to so many significant digits, in plain decimals where that is readable. */
export function digits(value: number, significant = 3): string {
  if (Number.isNaN(value)) return "\u2013";
  if (!Number.isFinite(value)) return value > 0 ? "\u221e" : "\u2212\u221e";
  const size = Math.abs(value);
  let text: string;
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    text = value.toExponential(significant - 1).replace("e+", "e");
  } else {
    const places = size === 0 ? 0 : Math.max(0, significant - 1 - Math.floor(Math.log10(size)));
    text = value.toFixed(Math.min(places, 8));
  }
  return text.replace("-", "\u2212");
}

/** A number as a visitor may type it: without needless digits, with an ASCII minus. */
export function plain(value: number, significant = 5): string {
  return value === Infinity ? "\u221e" : String(Number(value.toPrecision(significant)));
}

/** The same with three digits, for a value that nobody has chosen. */
export function rounded(value: number): string {
  return plain(value, 3);
}

/** A creepage [1] in per cent. */
export function percent(creepage: number, significant = 3): string {
  return `${digits(100 * creepage, significant)} %`;
}

/** A time [s] in ms or s. */
export function duration(time: number): string {
  if (!Number.isFinite(time)) return digits(time);
  return time < 1 ? `${digits(1e3 * time)} ms` : `${digits(time)} s`;
}
