// Sections of a model file: which keys they have, which they need, and what the others are if left
// out. As contactlib/scenario's section classes have it.

import type { Limits } from "./limits";
import { checkKeys, ModelError, numberOf, shown, type Table, tableOf, textOf } from "./reading";

/** Numbers of a section by key, in SI units; null where the file leaves out what it may. */
export type Numbers = Readonly<Record<string, number | null | undefined>>;

const LEFT_OUT: Readonly<Record<string, Numbers>> = {
  contact: {
    semi_width: null,
    radius: null,
    radius_x: null,
    radius_y: null,
    semi_axis_x: null,
    semi_axis_y: null,
  },
  friction: { weakening_length: null, k_hat: null, slip_rate_residual: 1, slip_rate_decay: 0 },
  wheelset: {
    mass: null,
    damping: 0,
    saturation_creepage: null,
    slope_reduction: null,
    minimum_speed: 0.1,
  },
  resistance: { constant: 0, linear: 0, quadratic: 0, grade: 0 },
};

function keysOf(section: string, limits: Limits): string[] {
  const prefix = `${section}.`;
  const keys = Object.keys(limits).filter((key) => key.startsWith(prefix));
  return keys.map((key) => key.slice(prefix.length));
}

/** The keys of a section that may have lists, and its other numbers. */
function readKeys(section: string, data: Table, limits: Limits, lists: readonly string[]) {
  const table = tableOf(section, data[section]);
  const known = keysOf(section, limits);
  const leftOut = LEFT_OUT[section] ?? {};
  checkKeys(`${section}.`, table, known, []);
  const numbers: Record<string, number | null | undefined> = { ...leftOut };
  const listed: Record<string, number[]> = {};
  for (const [key, value] of Object.entries(table)) {
    const where = `${section}.${key}`;
    if (!lists.includes(key)) {
      numbers[key] = numberOf(where, value, limits);
    } else if (Array.isArray(value) && value.length > 0) {
      listed[key] = value.map((entry: unknown) => numberOf(where, entry, limits));
    } else {
      throw new ModelError(`${where} = ${shown(value)} must be a list of at least one number`);
    }
  }
  const needed = known.filter((key) => !Object.hasOwn(leftOut, key));
  checkKeys(`${section}.`, table, known, needed);
  return { numbers, listed };
}

/** Numbers of a section that has no lists. */
export function readNumbers(section: string, data: Table, limits: Limits): Numbers {
  return readKeys(section, data, limits, []).numbers;
}

/** Breakpoints of what a control asks for over time [s], and the other numbers of its section. */
export function readProfile(section: string, values: string, data: Table, limits: Limits) {
  const { numbers, listed } = readKeys(section, data, limits, ["time", values]);
  const time = listed["time"] ?? [];
  const value = listed[values] ?? [];
  if (time.length !== value.length) {
    throw new ModelError(
      `${section}.time has ${time.length} and ${values} ${value.length} entries: both must have ` +
        "as many",
    );
  }
  const falls = time.some((at, i) => at < (time[i - 1] ?? -Infinity) || at === time[i - 2]);
  if (falls) {
    throw new ModelError(
      `${section}.time = ${shown(time)} must rise, and repeat a place at most once`,
    );
  }
  return { time, value, numbers };
}

/** Refuse any law but the one whose table the page has. */
export function checkLaw(data: Table): void {
  if (data["law"] === undefined) return;
  const law = tableOf("law", data["law"]);
  const kind = law["kind"] === undefined ? "carter_griffith" : textOf("law.kind", law["kind"]);
  if (kind !== "carter_griffith") {
    throw new ModelError(`law.kind = ${shown(kind)}: this page shows "carter_griffith" only`);
  }
  checkKeys("law.", law, ["kind"], []);
}

/** Which of these keys a section gives; refuses more or fewer than one of them. */
export function oneOf(section: string, numbers: Numbers, keys: string[]): string {
  const given = keys.filter((key) => numbers[key] !== null);
  if (given.length === 1 && given[0] !== undefined) return given[0];
  throw new ModelError(
    `${section}.${keys.join(" and ")}: give exactly one of them, not ${given.length}`,
  );
}
