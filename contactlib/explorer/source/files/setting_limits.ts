// Limits of the numbers that a visitor can set.

import { LONGEST_DELAY } from "../physics/control";
import { type Limit, type Limits, pageLimits } from "./limits";

// Of what no model file has: what the run can do, and no patch without end.
const SETTING_LIMITS: Limits = {
  load: { unit: "N", above: 0, at_most: 1e8 },
  speed: { unit: "m/s", above: 0, at_most: 1e3 },
  drive_torque: { unit: "N.m", at_least: 0, at_most: 1e7 },
  torque_rate: { unit: "N.m/s", at_least: 0, at_most: 1e8 },
  creepage: { unit: "1", at_least: 0, at_most: 10 },
  torque_max: { unit: "N.m", at_least: 0, at_most: 1e7 },
  delay: { unit: "s", at_least: 0, at_most: LONGEST_DELAY },
  kick: { unit: "1", at_least: -0.9, at_most: 10 },
  friction_ratio: { unit: "1", at_least: 1, at_most: 100 },
  patch_friction: { unit: "1", at_least: 1e-3, at_most: 2 },
  patch_length: { unit: "m", at_least: 1e-6, at_most: 1e4 },
  playback: { unit: "1", above: 0, at_most: 10 },
};

// Which limits of a model file hold for a number of a vehicle or of a control.
const MODEL_KEYS: Readonly<Record<string, string>> = {
  semi_width: "contact.semi_width",
  normal_load: "contact.normal_load",
  youngs_modulus: "contact.youngs_modulus",
  poisson_ratio: "contact.poisson_ratio",
  static_friction: "friction.static",
  kinetic_friction: "friction.kinetic",
  k_hat: "friction.k_hat",
  slip_rate_residual: "friction.slip_rate_residual",
  slip_rate_decay: "friction.slip_rate_decay",
  radius: "wheelset.radius",
  inertia: "wheelset.inertia",
  mass: "wheelset.mass",
  damping: "wheelset.damping",
  slope_reduction: "wheelset.slope_reduction",
  minimum_speed: "wheelset.minimum_speed",
  constant: "resistance.constant",
  linear: "resistance.linear",
  quadratic: "resistance.quadratic",
  grade: "resistance.grade",
  initial_speed: "run.initial_speed",
  proportional_gain: "creep_control.proportional_gain",
  integral_gain: "creep_control.integral_gain",
};

/** Limit of a number of the settings, by its key in the address. */
export function settingLimit(key: string, limits: Limits = pageLimits()): Limit | undefined {
  if (Object.hasOwn(SETTING_LIMITS, key)) return SETTING_LIMITS[key];
  if (key === "peak_pressure") return { unit: "Pa", above: 0 };
  return Object.hasOwn(MODEL_KEYS, key) ? limits[MODEL_KEYS[key]!] : undefined;
}

/** What must hold between numbers of the settings. */
export const TOGETHER: {
  keys: string[];
  must: string;
  holds(v: Record<string, number>): boolean;
}[] = [
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
    keys: ["speed", "minimum_speed"],
    must: "speed >= minimum_speed",
    holds: (v) => v["speed"]! >= v["minimum_speed"]!,
  },
];
