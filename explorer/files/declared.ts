// Limits and units of all numbers: those of a model file are Python's own declarations, which the
// build puts into the page.

import { embeddedData } from "../kernel/embedded";
import { LONGEST_DELAY } from "../physics/control";
import type { Limits } from "../physics/limits";

/** Unit and limits of a number [in SI units]. */
export interface Limit extends Limits {
  unit: string;
}

/** A key of a model file; without a default it is needed. */
export interface Key extends Limit {
  default?: number | null;
}

type ByName<Value> = Readonly<Record<string, Value>>;

export const {
  units: UNITS, spellings: SPELLINGS, sections: SECTIONS, conditions: CONDITIONS,
  replaced_by: REPLACED_BY, contacts: CONTACTS, theories: THEORIES,
  longest_ellipse: LONGEST_ELLIPSE, process_zone_limit: PROCESS_ZONE_LIMIT,
} = embeddedData("declarations") as {
  /** Values of units in SI units, by the SI unit. */
  units: ByName<ByName<number>>;
  /** Expressions that turn a spelling of a unit into that above, and what they put there. */
  spellings: readonly (readonly [string, string])[];
  /** Keys of a model file by their section. */
  sections: ByName<ByName<Key>>;
  /** Keys that a condition of the rail fills, by its name and their section. */
  conditions: ByName<ByName<ByName<number>>>;
  /** Keys of a file that replace one of a condition. */
  replaced_by: ByName<readonly string[]>;
  /** Pairs of keys; a contact gives one of them. */
  contacts: readonly (readonly [string, string])[];
  theories: readonly string[];
  /** Largest ratio of the semi-axes, along over across rolling, on a half-space [1]. */
  longest_ellipse: number;
  /** Largest weakening zone over the semi-width for which the limit law is good [1]. */
  process_zone_limit: number;
};

/** Sections whose keys are fields of a vehicle. */
export const OF_VEHICLE = ["friction", "wheelset", "resistance", "run"];

/** Name of a key of those sections in a vehicle. */
export function vehicleField(key: string): string {
  return key === "static" || key === "kinetic" ? `${key}_friction` : key;
}

// Where a name occurs twice the last one is meant: a vehicle's radius is the wheelset's.
const DECLARED: ByName<Limit> = Object.fromEntries(
  ["contact", ...OF_VEHICLE].flatMap((section) =>
    Object.entries(SECTIONS[section]!).map(([key, limit]) => [vehicleField(key), limit]),
  ),
);

// Limits of numbers that no model file has, and narrower limits than a file's: far beyond any vehicle,
// but such that a run can be computed.
const OWN: ByName<[unit: string, at_least: number, at_most: number]> = {
  semi_width: ["m", 1e-6, 1],
  peak_pressure: ["Pa", 1e6, 1e11],
  axle_load: ["N", 1, 1e8],
  youngs_modulus: ["Pa", 1e9, 1e13],
  static_friction: ["1", 1e-4, 10],
  kinetic_friction: ["1", 1e-4, 10],
  radius: ["m", 0.01, 10],
  inertia: ["kg.m2", 1e-3, 1e9],
  mass: ["kg", 1, 1e9],
  damping: ["N.m.s/rad", 0, 1e6],
  slope_reduction: ["1", 1e-3, 1],
  constant: ["N", 0, 1e6],
  linear: ["N.s/m", 0, 1e5],
  quadratic: ["N.s2/m2", 0, 1e4],
  load: ["N", 1, 1e8],
  drive_torque: ["N.m", 0, 1e7],
  torque_rate: ["N.m/s", 0, 1e8],
  creepage: ["1", 0, 10],
  torque_max: ["N.m", 0, 1e7],
  delay: ["s", 0, LONGEST_DELAY],
  kick: ["1", -0.9, 10],
  heat: ["1/K", 0, 1],
  friction_ratio: ["1", 1, 100],
  patch_friction: ["1", 1e-3, 2],
  patch_length: ["m", 1e-6, 1e4],
  patch_time: ["s", 1e-5, 100],
};

const SETTING_LIMITS: ByName<Limit> = {
  ...DECLARED,
  ...Object.fromEntries(Object.entries(OWN).map(([key, [unit, at_least, at_most]]) =>
    [key, { unit, at_least, at_most }])),
  proportional_gain: { unit: "N.m", above: 0 },
  integral_gain: { unit: "N.m/s", at_least: 0 },
  speed: { unit: "m/s", at_least: 0, at_most: 100 },
  playback: { unit: "1", above: 0, at_most: 10 },
};

/** Limit of a number that a visitor can set, by its key in the address. */
export function settingLimit(key: string): Limit {
  const limit = Object.hasOwn(SETTING_LIMITS, key) ? SETTING_LIMITS[key] : undefined;
  if (limit === undefined) throw new Error(`${key} has no limits in this page`);
  return limit;
}

/** Conditions on several numbers: their keys, what must hold, and whether it does. */
const TOGETHER: [keys: string[], must: string, holds: (...values: any[]) => boolean][] = [
  [["static_friction", "kinetic_friction"], "static_friction >= kinetic_friction",
    (held: number, sliding: number) => held >= sliding],
  [["k_hat", "static_friction", "kinetic_friction"], "static_friction > kinetic_friction, or k_hat = 0",
    (kHat: number, held: number, sliding: number) => kHat === 0 || held > sliding],
  [["softening_temperature"], "softening_temperature = 0 or >= 1",
    (melting: number) => melting === 0 || melting >= 1],
  [["softening_temperature", "slip_rate_decay"], "softening_temperature = 0 or slip_rate_decay = 0",
    (melting: number, decay: number) => melting === 0 || decay === 0],
  [["speed", "minimum_speed", "memory"], "speed >= minimum_speed, or memory = true",
    (speed: number, lowest: number, memory: unknown) => speed >= lowest || memory === true],
];

/** The conditions that some values break, one after another: their keys, and a line for each. */
export function* brokenTogether(values: object): Generator<{ keys: string[]; problem: string }> {
  for (const [keys, must, holds] of TOGETHER) {
    const now = keys.map((key) => (values as Record<string, number>)[key]!);
    if (holds(...now)) continue;
    const given = keys.map((key, i) => `${key} = ${now[i]}`).join(", ");
    yield { keys, problem: `${given}: must be ${must}` };
  }
}
