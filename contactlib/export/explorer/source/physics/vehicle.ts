/** A wheelset as a model file describes it, and the kernel's parameters that follow from it. */
import { type Contact, kernel, type Structs } from "../kernel/kernel";
import type { Sections } from "../kernel/structs";

const GRAVITY = 9.80665; // standard gravity [m/s2]

type Key<Section extends keyof Sections> = Sections[Section];

/** Numbers of a vehicle, which are those of a model file in SI units but for what is said here. */
type VehicleNumber =
  | "semi_width" // half the contact's length along rolling, a, at the nominal load
  | "peak_pressure" // p0 at the nominal load
  | "static_friction" // f_s and f_d
  | "kinetic_friction"
  | Extract<Key<"contact">, "normal_load" | "youngs_modulus" | "poisson_ratio"> // load of all wheels
  | Exclude<Key<"friction">, "static" | "kinetic" | "weakening_length"> // at the nominal load
  | Exclude<Key<"wheelset">, "mass" | "saturation_creepage" | "rotor_inertia" | "gear_ratio">
  | Key<"resistance">
  | Key<"run">;

/** A wheelset with its contact, friction and running resistance. */
export interface Vehicle extends Record<VehicleNumber, number> {
  name: string;
  source: string;
  contact: Contact;
  /** Of an ellipse: whether its strips along rolling feel each other. */
  theory: "half_space" | "strips";
  /** Null: the speed is held, as on a roller rig [kg]. */
  mass: number | null;
}

/** Composite modulus E* of two bodies of the vehicle's material [Pa]. */
export function contactModulus(v: Vehicle): number {
  return v.youngs_modulus / (2 * (1 - v.poisson_ratio ** 2)); // Eq. (4)
}

/** Stiffness along rolling over that of strips, and the part of it that is lost up to saturation. */
function scalesOf(v: Vehicle): Record<"stiffness_x" | "softening_x", number> {
  if (v.contact === "line" || v.theory === "strips") return { stiffness_x: 1, softening_x: 0 };
  return kernel.filled("half_space_scales", (to) =>
    kernel.module.half_space_scales_of(v.semi_width / lateralSemiAxis(v), v.poisson_ratio, to));
}

/** Modulus of the stiffness against creepage [Pa]. */
function tangentialModulus(v: Vehicle): number {
  return contactModulus(v) * scalesOf(v).stiffness_x;
}

/** Weakening length Delta that gives the vehicle's k_hat [m]. */
export function weakeningLength(v: Vehicle): number {
  if (v.k_hat === 0) return 0;
  const drop = v.static_friction - v.kinetic_friction;
  if (!(drop > 0)) {
    throw new RangeError(
      `k_hat = ${v.k_hat} needs static_friction = ${v.static_friction} above ` +
        `kinetic_friction = ${v.kinetic_friction}`,
    );
  }
  const toughness = Math.PI * (v.k_hat * v.kinetic_friction) ** 2 * v.semi_width * v.peak_pressure;
  return toughness / (tangentialModulus(v) * drop); // Eq. (17) for Delta
}

/** zeta0 at the nominal load and no slip speed [1]. */
export function saturationCreepage(v: Vehicle): number {
  const clean = (2 * v.kinetic_friction * v.peak_pressure) / tangentialModulus(v); // Eq. (15)
  return clean / v.slope_reduction;
}

/** Power of the load with which the contact's size and pressure grow (Hertz). */
function loadExponent(v: Vehicle): number {
  return v.contact === "line" ? 1 / 2 : 1 / 3;
}

/** Parameters of the kernel's force element, without relaxation. */
export function forceParameters(v: Vehicle): Structs["force_element_parameters"] {
  return {
    radius: v.radius,
    static_friction: v.static_friction,
    kinetic_friction: v.kinetic_friction,
    weakening_length: weakeningLength(v),
    slope_reduction: v.slope_reduction,
    semi_width: v.semi_width,
    peak_pressure: v.peak_pressure,
    contact_modulus: tangentialModulus(v),
    softening: scalesOf(v).softening_x,
    nominal_load: v.normal_load,
    load_exponent: loadExponent(v),
    minimum_speed: v.minimum_speed,
    slip_rate_residual: v.slip_rate_residual,
    slip_rate_decay: v.slip_rate_decay,
    softening_temperature: v.softening_temperature,
    thermal_effusivity: v.thermal_effusivity,
    elliptic: v.contact === "elliptic" ? 1 : 0,
    relaxation_length: 0,
  };
}

/** Parameters of the kernel's equations of motion. */
export function wheelsetParameters(v: Vehicle): Structs["wheelset_parameters"] {
  return {
    radius: v.radius,
    inertia: v.inertia,
    inverse_mass: v.mass === null ? 0 : 1 / v.mass,
    damping: v.damping,
    constant_resistance: v.constant,
    linear_resistance: v.linear,
    quadratic_resistance: v.quadratic,
    grade_acceleration: GRAVITY * v.grade,
    minimum_speed: v.minimum_speed,
  };
}

/** Semi-axis b of the ellipse across rolling, at the nominal load [m]. */
export function lateralSemiAxis(v: Vehicle): number {
  return (1.5 * (v.normal_load / v.wheels)) / (Math.PI * v.semi_width * v.peak_pressure); // Eq. (20)
}

/** The vehicle whose nominal load is another one [N]: its contact grows, its friction stays. */
export function atLoad(vehicle: Vehicle, normalLoad: number): Vehicle {
  if (normalLoad === vehicle.normal_load) return vehicle;
  const growth = (normalLoad / vehicle.normal_load) ** loadExponent(vehicle); // of a and of p0
  return {
    ...vehicle,
    normal_load: normalLoad,
    semi_width: vehicle.semi_width * growth,
    peak_pressure: vehicle.peak_pressure * growth,
    k_hat: vehicle.k_hat / growth, // Eq. (17), with the weakening length as it is
  };
}
