/** A wheelset as a model file describes it, and the kernel's parameters that follow from it. */
import { embeddedData } from "../kernel/embedded";
import { demand } from "./limits";
import { type Contact, kernel, type Structs } from "../kernel/kernel";
import type { Sections } from "../kernel/structs";

// Standard gravity [m/s2], and the least length of a line contact with memory over its semi-width.
const { gravity, shortest_line: SHORTEST_LINE } =
  embeddedData("declarations") as Record<"gravity" | "shortest_line", number>;

type Key<Section extends keyof Sections> = Sections[Section];

/** Numbers of a vehicle: those of a model file in SI units, unless noted here. */
type VehicleNumber =
  | "semi_width" // half the contact's length along rolling, a, at the nominal load
  | "peak_pressure" // p0 at the nominal load
  | "static_friction" // f_s and f_d
  | "kinetic_friction"
  | "axle_load" // nominal load of all wheels
  | Extract<Key<"contact">, "youngs_modulus" | "poisson_ratio">
  | Exclude<Key<"friction">, "static" | "kinetic" | "weakening_length"> // at the nominal load
  | Exclude<Key<"wheelset">, "mass" | "saturation_creepage" | "rotor_inertia" | "gear_ratio">
  | Key<"resistance">
  | Key<"run">;

/** A wheelset with its contact, friction and running resistance. */
export interface Vehicle extends Record<VehicleNumber, number> {
  name: string;
  source: string;
  contact: Contact;
  /** Of an ellipse: whether its strips along rolling are coupled. */
  theory: "half_space" | "strips";
  /** Whether the force of a run depends on what the contact rolled over. */
  memory: boolean;
  /** Null: the speed is held, as on a roller rig [kg]. */
  mass: number | null;
}

/** Parameters of the kernel's force element; other fields are the vehicle's. */
export type ForceParameters = Structs["force_element_parameters"];

/** Composite modulus E* of two bodies of the vehicle's material [Pa]. */
export function contactModulus(v: Vehicle): number {
  return v.youngs_modulus / (2 * (1 - v.poisson_ratio ** 2)); // Eq. (4)
}

/** zeta0, k_hat and process zone ratio under a load [N], without slip speed; those of the memory only
 * with a table. */
export function scalesOf(
  parameters: ForceParameters, load = parameters.nominal_load, friction = 1, table = 0,
): Structs["contact_scales"] {
  return kernel.filled("contact_scales", (to) =>
    kernel.module.force_element_scales(
      table, kernel.given("force_element_parameters", parameters), load, friction, to));
}

/** Parameters of the force element, without memory, for a weakening length [m]. */
export function weakenedOver(v: Vehicle, weakening_length: number): ForceParameters {
  const line = v.contact === "line";
  // Stiffness along rolling over that of strips, and the part of it that is lost up to saturation.
  const { stiffness_x, softening_x } = line || v.theory === "strips"
    ? { stiffness_x: 1, softening_x: 0 }
    : kernel.filled("half_space_scales", (to) =>
        kernel.module.half_space_scales_of(v.semi_width / lateralSemiAxis(v), v.poisson_ratio, to));
  return {
    ...v,
    weakening_length,
    contact_modulus: contactModulus(v) * stiffness_x,
    softening: softening_x,
    nominal_load: v.axle_load,
    load_exponent: line ? 1 / 2 : 1 / 3, // Hertz
    elliptic: line ? 0 : 1,
    memory: 0,
    body_modulus: contactModulus(v),
    transverse_half_length: lateralSemiAxis(v) * (line ? 2 / 3 : 1),
  };
}

/** The same for the vehicle's k_hat, which grows like the square root of the length. */
export function forceParameters(v: Vehicle): ForceParameters {
  if (v.k_hat === 0) return weakenedOver(v, 0);
  if (!(v.static_friction > v.kinetic_friction)) {
    throw new RangeError(
      `k_hat = ${v.k_hat} needs static_friction = ${v.static_friction} above ` +
        `kinetic_friction = ${v.kinetic_friction}`,
    );
  }
  const parameters = weakenedOver(v, 1);
  return { ...parameters, weakening_length: (v.k_hat / scalesOf(parameters).k_hat) ** 2 };
}

/** The same as the contact moves: with its memory, if it has one. */
export function rollingParameters(v: Vehicle): ForceParameters {
  const parameters = forceParameters(v);
  const length = 2 * (parameters.transverse_half_length / v.semi_width);
  if (v.memory && v.contact === "line" && length < SHORTEST_LINE) {
    throw new RangeError(`memory = true needs a line contact of at least ${SHORTEST_LINE} ` +
      `semi-widths: this one has ${length.toPrecision(3)}`);
  }
  return { ...parameters, memory: v.memory ? 1 : 0 };
}

/** Parameters of the kernel's equations of motion. */
export function wheelsetParameters(v: Vehicle): Structs["wheelset_parameters"] {
  return {
    ...v,
    inverse_mass: v.mass === null ? 0 : 1 / v.mass,
    constant_resistance: v.constant,
    linear_resistance: v.linear,
    quadratic_resistance: v.quadratic,
    grade_acceleration: gravity * v.grade,
  };
}

/** Check the speed of a run [m/s]: only a contact with memory holds a wheel that stands. */
export function checkSpeed({ memory, minimum_speed }: Vehicle, speed: number): void {
  demand(memory ? "speed" : "speed without memory", speed, { at_least: memory ? 0 : minimum_speed });
}

/** Semi-axis b of the ellipse across rolling, at the nominal load [m]. */
export function lateralSemiAxis(v: Vehicle): number {
  return (1.5 * (v.axle_load / v.wheels)) / (Math.PI * v.semi_width * v.peak_pressure); // Eq. (20)
}

/** The vehicle whose nominal load is another one [N]: its contact grows, its friction stays. */
export function atLoad(v: Vehicle, axleLoad: number): Vehicle {
  if (axleLoad === v.axle_load) return v;
  // The saturation creepage grows with the pressure, Eq. (15).
  const parameters = forceParameters(v), there = scalesOf(parameters, axleLoad);
  const growth = there.saturation_creepage / scalesOf(parameters).saturation_creepage;
  return {
    ...v,
    axle_load: axleLoad,
    semi_width: v.semi_width * growth,
    peak_pressure: v.peak_pressure * growth,
    k_hat: there.k_hat,
  };
}
