// TOML in, checked numbers out, by the rules of contactlib's Python.

import { parse, TomlError } from "smol-toml";

import { outOfRange } from "../physics/limits";
import { type Limit, SECTIONS, SPELLINGS, UNITS } from "./declared";

/** A model file that cannot be used; its message is one line with the place and the reason. */
export class ModelError extends Error {
  override name = "ModelError";
}

/** Throw it. */
export function refuse(line: string): never {
  throw new ModelError(line);
}

/** Contents of a file or of a section of it. */
export type Table = Readonly<Record<string, unknown>>;

/** Numbers of a section by key; null where the file leaves out what it may. */
export type Numbers = Record<string, number | null>;

const MAX_FILE = 1_000_000; // characters
const NUMBER = /^[+-]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?(?![0-9_])/i;
const DECIMAL = /^[+-]?(\d+(?:\.\d*)?|\.\d+)(e[+-]?\d+)?$/i;

/** A number in decimal digits; NaN for any other text. */
export function decimal(text: string): number {
  return DECIMAL.test(text) ? Number(text) : NaN;
}

/** Contents of a TOML file. */
export function parseToml(text: string): Table {
  if (text.length > MAX_FILE) {
    refuse(`the file has ${text.length} characters: must be <= ${MAX_FILE}`);
  }
  try {
    return parse(text.replace(/^\ufeff/, ""), { integersAsBigInt: "asNeeded", maxDepth: 20 });
  } catch (error) {
    if (!(error instanceof Error)) throw error;
    const place = error instanceof TomlError ? ` (line ${error.line}, column ${error.column})` : "";
    refuse(oneLine(error.message.split("\n", 1)[0] ?? "") + place);
  }
}

/** A value of a file for a message: in one line, and not too long. */
export function shown(value: unknown): string {
  const text = JSON.stringify(value, (_, v) => (typeof v === "bigint" ? String(v) : v));
  return oneLine(text ?? String(value));
}

function oneLine(text: string): string {
  const line = text.replace(/[\s\p{Cc}\p{Cf}\p{Zl}\p{Zp}]+/gu, " ");
  return line.length > 120 ? `${line.slice(0, 117)}...` : line;
}

/** Refuse unknown keys, and missing keys that are needed. */
export function checkKeys(prefix: string, table: Table, known: string[], needed: string[]): void {
  const unknown = Object.keys(table).find((key) => !known.includes(key));
  if (unknown !== undefined) {
    refuse(`${oneLine(prefix + unknown)} is not a known key; known: ${known.join(", ")}`);
  }
  const missing = needed.find((key) => !Object.hasOwn(table, key));
  if (missing !== undefined) refuse(`${prefix}${missing} is missing`);
}

/** A value that must be a string, or one of some. */
export function textOf(where: string, value: unknown, choices?: readonly string[]): string {
  if (typeof value !== "string") refuse(`${where} = ${shown(value)} must be a string`);
  if (choices?.includes(value) === false) {
    refuse(`${where} = ${shown(value)} must be one of: ${choices.join(", ")}`);
  }
  return value;
}

/** A value that must be a section. */
export function tableOf(name: string, value: unknown): Table {
  const isObject = typeof value === "object" && value !== null;
  if (isObject && !Array.isArray(value) && !(value instanceof Date)) return value as Table;
  refuse(`${name} = ${shown(value)} must be a section: [${name}]`);
}

/** Value of a unit, in any spelling, in another; undefined if it is no such unit. */
function unitValue(unit: string, si: string): number | undefined {
  const known: Record<string, number> = { [si]: 1, ...UNITS[si] };
  let plain = unit.trim();
  if (plain === "") return undefined;
  for (const [spelling, meant] of SPELLINGS) {
    if (!Object.hasOwn(known, plain)) plain = plain.replace(new RegExp(spelling, "gu"), meant);
  }
  return Object.hasOwn(known, plain) ? known[plain] : undefined;
}

/** A value in SI units and within its limit. */
function numberOf(where: string, value: unknown, limit: Limit): number {
  let found = NaN, given = "";
  if (typeof value === "string") {
    const text = value.trim(), digits = NUMBER.exec(text)?.[0] ?? "";
    const factor = unitValue(text.slice(digits.length), limit.unit);
    found = decimal(digits);
    given = shown(value);
    if (Number.isNaN(found)) refuse(`${where} = ${given} does not begin with a number`);
    if (factor === undefined) {
      const units = Object.keys({ [limit.unit]: 1, ...UNITS[limit.unit] }).join(", ");
      refuse(`${where} = ${given} must be a number in ${limit.unit}, or a number and one of: ${units}`);
    }
    found *= factor;
  } else if (typeof value === "number" || typeof value === "bigint") {
    found = Number(value);
    given = String(found);
  } else refuse(`${where} = ${shown(value)} must be a number in ${limit.unit}`);
  const problem = outOfRange(where, found, limit, given);
  return problem === null ? found : refuse(problem);
}

/** Numbers of a section. */
export function readSection(name: string, data: Table): Numbers {
  const declared = SECTIONS[name]!, table = tableOf(name, data[name] ?? {}), known = Object.keys(declared);
  checkKeys(`${name}.`, table, known, known.filter((key) => declared[key]!.default === undefined));
  const numbers = known.map((key) => [key, table[key] === undefined ? declared[key]!.default!
    : numberOf(`${name}.${key}`, table[key], declared[key]!)]);
  return Object.fromEntries(numbers) as Numbers;
}

/** Refuse a section that gives none of the keys, or more than one. */
export function oneOf(section: string, numbers: Numbers, ...keys: string[]): void {
  const given = keys.filter((key) => numbers[key] !== null).length;
  if (given !== 1) refuse(`${section}.${keys.join(" and ")}: give exactly one of them, not ${given}`);
}
