// TOML in, checked numbers out, by the rules of contactlib/scenario/reading.py.

import { parse, TomlError } from "smol-toml";

import { allows, type Limits, limitText } from "./limits";
import { pageData } from "./page_data";

/** A model file that cannot be used; one line says where and why. */
export class ModelError extends Error {
  override name = "ModelError";
}

/**
 * How many SI units one of each unit is, by the SI unit of the quantity: Python's own, which the
 * build puts into the page.
 */
export const UNITS = pageData("units") as Readonly<Record<string, Readonly<Record<string, number>>>>;

/** Contents of a file or of a section of it. */
export type Table = Readonly<Record<string, unknown>>;

const LARGEST_FILE = 1_000_000; // characters
const DECIMAL = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

/** The number that a text is in decimal digits; NaN for anything else. */
export function decimal(text: string): number {
  return DECIMAL.test(text) ? Number(text) : NaN;
}

/** Contents of a TOML file. */
export function parseToml(text: string): Table {
  if (text.length > LARGEST_FILE) {
    throw new ModelError(`the file has ${text.length} characters: must be <= ${LARGEST_FILE}`);
  }
  try {
    return parse(text.replace(/^\ufeff/, ""), { integersAsBigInt: "asNeeded", maxDepth: 20 });
  } catch (error) {
    if (!(error instanceof Error)) throw error;
    const place = error instanceof TomlError ? ` (line ${error.line}, column ${error.column})` : "";
    throw new ModelError(oneLine(error.message.split("\n", 1)[0] ?? "") + place);
  }
}

/** A value of a file as a message shows it: in one line, and not too long. */
export function shown(value: unknown): string {
  const text = JSON.stringify(value, (_, v) => (typeof v === "bigint" ? String(v) : v));
  return oneLine(text ?? String(value));
}

function oneLine(text: string): string {
  const line = text.replace(/[\s\p{Cc}\p{Cf}\p{Zl}\p{Zp}]+/gu, " ");
  return line.length > 120 ? `${line.slice(0, 117)}...` : line;
}

/** Refuse a key that is not known, and the lack of one that is needed. */
export function checkKeys(prefix: string, table: Table, known: string[], needed: string[]): void {
  for (const key of Object.keys(table)) {
    if (!known.includes(key)) {
      const name = oneLine(prefix + key);
      throw new ModelError(`${name} is not a known key; known: ${known.join(", ")}`);
    }
  }
  for (const key of needed) {
    if (!Object.hasOwn(table, key)) throw new ModelError(`${prefix}${key} is missing`);
  }
}

/** A value that is a string. */
export function textOf(where: string, value: unknown): string {
  if (typeof value === "string") return value;
  throw new ModelError(`${where} = ${shown(value)} must be a string`);
}

/** A value that is a section. */
export function tableOf(name: string, value: unknown): Table {
  const isObject = typeof value === "object" && value !== null;
  if (isObject && !Array.isArray(value) && !(value instanceof Date)) return value as Table;
  throw new ModelError(`${name} = ${shown(value)} must be a section: [${name}]`);
}

/** A value in SI units, within the limits of the key `limited`. */
export function numberOf(where: string, value: unknown, limits: Limits, limited = where): number {
  const limit = limits[limited];
  if (limit === undefined) throw new ModelError(`${where} has no limits in this page`);
  let found: number;
  if (typeof value === "string") {
    const [digits = "", ...rest] = value.trim().split(" ");
    const units: Record<string, number> = { [limit.unit]: 1, ...UNITS[limit.unit] };
    const unit = rest.join(" ");
    if (rest.length === 0 || !Object.hasOwn(units, unit)) {
      throw new ModelError(
        `${where} = ${shown(value)} must be a number in ${limit.unit}, or a number and one of: ` +
          Object.keys(units).join(", "),
      );
    }
    found = decimal(digits.replace(/(?<=\d)_(?=\d)/g, "")) * (units[unit] ?? NaN);
    if (Number.isNaN(found)) {
      throw new ModelError(`${where} = ${shown(value)} does not begin with a number`);
    }
  } else if (typeof value === "number" || typeof value === "bigint") {
    found = Number(value);
  } else {
    throw new ModelError(`${where} = ${shown(value)} must be a number in ${limit.unit}`);
  }
  if (allows(limit, found)) return found;
  const given = typeof value === "string" ? shown(value) : String(found);
  throw new ModelError(`${where} = ${given} is out of range: must be ${limitText(limit)}`);
}
