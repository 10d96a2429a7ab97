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
  list: boolean;
  default?: number | null;
}

type ByName<Value> = Readonly<Record<string, Value>>;

export const {
  units: UNITS, spellings: SPELLINGS, sections: SECTIONS, process_zone_limit: PROCESS_ZONE_LIMIT,
} = embeddedData("declarations") as {
  /** Values of units in SI units, by the SI unit. */
  units: ByName<ByName<number>>;
  /** Expressions that turn a spelling of a unit into that above, and what they put there. */
  spellings: readonly (readonly [string, string])[];
  /** Keys of a model file by their section. */
  sections: ByName<ByName<Key>>;
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
  ["contact", "creep_control", ...OF_VEHICLE].flatMap((section) =>
    Object.entries(SECTIONS[section]!).map(([key, limit]) => [vehicleField(key), limit]),
  ),
);

// Far beyond any vehicle, and less than what no run can be computed with: least and largest.
const RUNS: ByName<[number, number]> = {
  semi_width: [1e-6, 1],
  normal_load: [1, 1e8],
  youngs_modulus: [1e9, 1e13],
  static_friction: [1e-4, 10],
  kinetic_friction: [1e-4, 10],
  radius: [0.01, 10],
  inertia: [1e-3, 1e9],
  mass: [1, 1e9],
  damping: [0, 1e6],
  slope_reduction: [1e-3, 1],
  constant: [0, 1e6],
  linear: [0, 1e5],
  quadratic: [0, 1e4],
};

// Below the others stand numbers that no model file has, and those of which the page allows less.
const SETTING_LIMITS: ByName<Limit> = {
  ...DECLARED,
  ...Object.fromEntries(Object.entries(RUNS).map(([key, [at_least, at_most]]) =>
    [key, { unit: DECLARED[key]!.unit, at_least, at_most }])),
  peak_pressure: { unit: "Pa", at_least: 1e6, at_most: 1e11 },
  load: { unit: "N", at_least: 1, at_most: 1e8 },
  speed: { unit: "m/s", above: 0, at_most: 100 },
  drive_torque: { unit: "N.m", at_least: 0, at_most: 1e7 },
  torque_rate: { unit: "N.m/s", at_least: 0, at_most: 1e8 },
  creepage: { unit: "1", at_least: 0, at_most: 10 },
  torque_max: { unit: "N.m", at_least: 0, at_most: 1e7 },
  delay: { unit: "s", at_least: 0, at_most: LONGEST_DELAY },
  kick: { unit: "1", at_least: -0.9, at_most: 10 },
  heat: { unit: "1/K", at_least: 0, at_most: 1 },
  friction_ratio: { unit: "1", at_least: 1, at_most: 100 },
  patch_friction: { unit: "1", at_least: 1e-3, at_most: 2 },
  patch_length: { unit: "m", at_least: 1e-6, at_most: 1e4 },
  patch_time: { unit: "s", at_least: 1e-5, at_most: 100 },
  playback: { unit: "1", above: 0, at_most: 10 },
};

/** Limit of a number that a visitor can set, by its key in the address. */
export function settingLimit(key: string): Limit {
  const limit = Object.hasOwn(SETTING_LIMITS, key) ? SETTING_LIMITS[key] : undefined;
  if (limit === undefined) throw new Error(`${key} has no limits in this page`);
  return limit;
}

type Values = Record<string, number>;

/** Conditions on several numbers. */
const TOGETHER: { keys: string[]; must: string; holds(v: Values): boolean }[] = [
  {
    keys: ["static_friction", "kinetic_friction"],
    must: "static_friction >= kinetic_friction",
    holds: (v) => v["static_friction"]! >= v["kinetic_friction"]!,
  },
  {
    keys: ["k_hat", "static_friction", "kinetic_friction"],
    must: "static_friction > kinetic_friction, or k_hat = 0",
    holds: (v) => v["k_hat"] === 0 || v["static_friction"]! > v["kinetic_friction"]!,
  },
  {
    keys: ["softening_temperature"],
    must: "softening_temperature = 0 or >= 1",
    holds: (v) => v["softening_temperature"] === 0 || v["softening_temperature"]! >= 1,
  },
  {
    keys: ["softening_temperature", "slip_rate_decay"],
    must: "softening_temperature = 0 or slip_rate_decay = 0",
    holds: (v) => v["softening_temperature"] === 0 || v["slip_rate_decay"] === 0,
  },
  {
    keys: ["speed", "minimum_speed"],
    must: "speed >= minimum_speed",
    holds: (v) => v["speed"]! >= v["minimum_speed"]!,
  },
];

/** The conditions that some values break, one after another: their keys, and a line for each. */
export function* brokenTogether(values: object): Generator<{ keys: string[]; problem: string }> {
  for (const { keys, must, holds } of TOGETHER) {
    const now = values as Values;
    if (holds(now)) continue;
    const given = keys.map((key) => `${key} = ${now[key]}`).join(", ");
    yield { keys, problem: `${given}: must be ${must}` };
  }
}
