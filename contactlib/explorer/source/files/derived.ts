// What a vehicle has of what its model file says in one of several ways.

import {
  contactModulus,
  lateralSemiAxis,
  saturationCreepage,
  type Vehicle,
  weakeningLength,
} from "../physics/vehicle";
import { ellipsePressure, semiAxes } from "./hertz";
import { allows, type Limits, limitText } from "./limits";
import { ModelError } from "./reading";
import type { Numbers } from "./sections";

type HertzianContact = Pick<
  Vehicle,
  | "contact" | "semi_width" | "peak_pressure"
  | "normal_load" | "youngs_modulus" | "poisson_ratio"
>;

const PAIRS = [
  ["semi_width", "radius"],
  ["radius_x", "radius_y"],
  ["semi_axis_x", "semi_axis_y"],
];

/** The contact of the one pair of keys that [contact] gives. */
export function contactOf(section: Numbers): HertzianContact {
  const given = PAIRS.flat().filter((key) => section[key] !== null);
  if (!PAIRS.some((pair) => pair.join() === given.join())) {
    const pairs = PAIRS.map((pair) => pair.join(" and ")).join(", or ");
    throw new ModelError(
      `contact.${pairs}: give exactly one of these pairs, not ${given.join(" and ") || "nothing"}`,
    );
  }
  const { normal_load, youngs_modulus, poisson_ratio } = section as Record<string, number>;
  const elastic = { normal_load, youngs_modulus, poisson_ratio } as Vehicle;
  const modulus = contactModulus(elastic);
  const [first, second] = given.map((key) => section[key]) as [number, number];
  const isLine = given[0] === "semi_width";
  const [a, b] =
    given[0] === "radius_x"
      ? semiAxes(first, second, elastic.normal_load, modulus)
      : [first, second];
  const pressure = isLine
    ? (a * modulus) / (2 * second) // Eq. (5)
    : ellipsePressure(a, b, elastic.normal_load);
  if (!(a > 0 && Number.isFinite(a) && pressure > 0 && Number.isFinite(pressure))) {
    throw new ModelError(
      `contact.${given.join(" and ")} = ${first} and ${second} give a semi-width of ${a} m and ` +
        `a pressure of ${pressure} Pa: must be finite and > 0`,
    );
  }
  return {
    ...elastic,
    contact: isLine ? "line" : "elliptic",
    semi_width: a,
    peak_pressure: pressure,
  };
}

/** k_hat as [friction] gives it, or that of the weakening length, which grows like its square. */
export function kHatOf(vehicle: Vehicle, section: Numbers, limits: Limits): number {
  const { static_friction, kinetic_friction } = vehicle;
  const falls = static_friction > kinetic_friction;
  if (static_friction < kinetic_friction) {
    throw new ModelError(
      `friction.static = ${static_friction} is out of range: must be >= friction.kinetic = ` +
        `${kinetic_friction}`,
    );
  }
  const given = section["k_hat"] ?? null;
  const length = section["weakening_length"] ?? null;
  if (given !== null) {
    if (falls || given === 0) return given;
    throw new ModelError(
      `friction.k_hat = ${given} needs friction.static = ${static_friction} > friction.kinetic`,
    );
  }
  if (length === null || !falls) return 0;
  const kHat = Math.sqrt(length / weakeningLength({ ...vehicle, k_hat: 1 }));
  const limit = limits["friction.k_hat"]!;
  if (allows(limit, kHat)) return kHat;
  throw new ModelError(
    `friction.weakening_length = ${length} gives k_hat = ${kHat}, out of range: must be ` +
      limitText(limit),
  );
}

/** Slope reduction as [wheelset] gives it, or that of the saturation creepage, or none. */
export function slopeReductionOf(vehicle: Vehicle, section: Numbers): number {
  const wanted = section["saturation_creepage"] ?? null;
  if (wanted === null) return section["slope_reduction"] ?? 1;
  const clean = saturationCreepage(vehicle);
  if (wanted < clean * (1 - 1e-12)) {
    throw new ModelError(
      `wheelset.saturation_creepage = ${wanted} is out of range: must be >= ` +
        `${clean.toPrecision(6)}, that of clean surfaces`,
    );
  }
  return Math.min(1, clean / wanted);
}

/** What [contact] says of a vehicle. */
export function contactSection(v: Vehicle): Record<string, number> {
  const { semi_width: a, peak_pressure: p0, normal_load, youngs_modulus, poisson_ratio } = v;
  const shape =
    v.contact === "line"
      ? { semi_width: a, radius: (a * contactModulus(v)) / (2 * p0) } // Eq. (5)
      : { semi_axis_x: a, semi_axis_y: lateralSemiAxis(v) };
  return { ...shape, normal_load, youngs_modulus, poisson_ratio };
}
