/** A wheelset as a model file describes it, and the kernel's parameters that follow from it. */
import { embeddedData } from "../kernel/embedded";
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

/** zeta0, k_hat and process zone ratio under a load [N], without slip speed. */
export function scalesOf(
  parameters: ForceParameters, load = parameters.nominal_load, friction = 1,
): Structs["contact_scales"] {
  return kernel.filled("contact_scales", (to) =>
    kernel.module.force_element_scales(
      kernel.given("force_element_parameters", parameters), load, friction, to));
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
    nominal_load: v.normal_load,
    load_exponent: line ? 1 / 2 : 1 / 3, // Hertz
    elliptic: line ? 0 : 1,
    relaxation_length: 0,
    lateral_relaxation_length: 1, // not used without lateral slip
    standing_stiffness: 1, // not used without memory
    initial_slope: 1,
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
  const steady = forceParameters(v);
  if (!v.memory) return steady;
  const line = v.contact === "line", table = kernel.tables[v.contact];
  const [length, standing] = line ? memoryOfLine(v)
    : memoryOfEllipse(v, steady.contact_modulus / contactModulus(v));
  const { k_hat, layer_ratio } = scalesOf(steady);
  const slope = (layer: number): number => kernel.filled("creep_value", (to) =>
    kernel.module.creep_table_evaluate(table, 0, k_hat, layer, to)).slope;
  // A layer adds its compliance, see contactlib/laws/relaxation.py.
  const initial_slope = slope(layer_ratio), clean = slope(0), softer = clean / initial_slope - 1;
  const whole = (length + softer * (line ? 2 / 3 : (3 * Math.PI) / 16)) / (1 + softer);
  const compliance = length / (standing * clean) + layer_ratio / (line ? 4 / Math.PI : 1.5);
  return {
    ...steady,
    relaxation_length: whole * v.semi_width,
    standing_stiffness: whole / initial_slope / compliance,
    initial_slope,
  };
}

/** Relaxation length over the semi-width, and stiffness at standstill over that of its lag, of an
 * ellipse whose stiffness along rolling is so many times that of strips. */
function memoryOfEllipse(v: Vehicle, stiffness: number): [number, number] {
  const g = v.semi_width / lateralSemiAxis(v), { module } = kernel, nu = v.poisson_ratio;
  const { longitudinal: length } = kernel.filled("relaxation_lengths", (to) =>
    module.relaxation_lengths_of(g, nu, to));
  // Mindlin's problem, with the integrals of cos^2 and sin^2 over sqrt(cos^2 + g^2 sin^2).
  const cosine = (g * g * module.hertz_integral(g, 1)) / 3, sine = module.hertz_integral(1, g) / 3;
  const standing = (3 * (1 - nu)) / (cosine + (1 - nu) * sine);
  return [length, (standing * length) / (0.75 * Math.PI * stiffness)];
}

/** The same of a line contact, by the equations of contactlib/laws/relaxation.py. */
function memoryOfLine(v: Vehicle): [number, number] {
  const length = (4 / 3) * (lateralSemiAxis(v) / v.semi_width), nu = v.poisson_ratio;
  if (length < SHORTEST_LINE) {
    throw new RangeError(`memory = true needs a line contact of at least ${SHORTEST_LINE} ` +
      `semi-widths: this one has ${length.toPrecision(3)}`);
  }
  const lag = Math.log(4 * length) - 1.5 + nu / (1 - nu);
  const share = (8 * (1 - 2 * nu)) / (Math.PI ** 2 * (1 - nu) * length);
  const whole = lag + share * (lag + 5 / 3);
  return [whole, whole / (lag + 0.5)];
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

/** Semi-axis b of the ellipse across rolling, at the nominal load [m]. */
export function lateralSemiAxis(v: Vehicle): number {
  return (1.5 * (v.normal_load / v.wheels)) / (Math.PI * v.semi_width * v.peak_pressure); // Eq. (20)
}

/** The vehicle whose nominal load is another one [N]: its contact grows, its friction stays. */
export function atLoad(v: Vehicle, normalLoad: number): Vehicle {
  if (normalLoad === v.normal_load) return v;
  // The saturation creepage grows with the pressure, Eq. (15).
  const parameters = forceParameters(v), there = scalesOf(parameters, normalLoad);
  const growth = there.saturation_creepage / scalesOf(parameters).saturation_creepage;
  return {
    ...v,
    normal_load: normalLoad,
    semi_width: v.semi_width * growth,
    peak_pressure: v.peak_pressure * growth,
    k_hat: there.k_hat,
  };
}
