// Model files: the TOML that contactlib.load_model reads, in and out.

import { stringify } from "smol-toml";

import { outOfRange } from "../physics/limits";
import {
  atLoad, contactModulus, forceParameters, lateralSemiAxis, rollingParameters, scalesOf, type Vehicle,
  weakenedOver,
} from "../physics/vehicle";
import {
  brokenTogether, CONDITIONS, CONTACTS, LONGEST_ELLIPSE, OF_VEHICLE, REPLACED_BY, SECTIONS, THEORIES,
  vehicleField,
} from "./declared";
import { kernel } from "../kernel/kernel";
import {
  checkKeys, type Numbers, oneOf, parseToml, readSection, refuse, shown, type Table, tableOf, textOf,
} from "./reading";

const NEEDED = ["contact", "friction", "wheelset"];
const LAW = "carter_griffith"; // the law whose tables the page has
// Keys that a vehicle does not have, which other keys express.
const ALTERNATIVES = ["weakening_length", "saturation_creepage", "rotor_inertia", "gear_ratio"];

/** Read a model file. Throws a ModelError of one line that names key, value and limit. */
export function readModel(text: string): Vehicle {
  const file = parseToml(text);
  refuseOthers(file);
  checkLaw(file);
  const { data, theory, memory } = numbersOnly(withCondition(file));
  checkKeys("", data, ["name", "source", "law", ...Object.keys(SECTIONS)], NEEDED);
  const sections = OF_VEHICLE.map((name) => readSection(name, data));
  const [friction, wheelset] = sections as [Numbers, Numbers];
  oneOf("friction", friction, "weakening_length", "k_hat");
  if (wheelset["saturation_creepage"] !== null) {
    oneOf("wheelset", wheelset, "saturation_creepage", "slope_reduction");
    if (wheelset["layer_compliance"]! > 0) {
      refuse(`wheelset.layer_compliance = ${wheelset["layer_compliance"]} must be 0 with a ` +
        "saturation_creepage: a layer lowers the slope and leaves zeta0 that of clean surfaces");
    }
  }
  const keys = sections.flatMap(Object.entries).filter(([key]) => !ALTERNATIVES.includes(key));
  const vehicle = {
    name: textOf("name", data["name"] ?? "Unnamed"),
    source: textOf("source", data["source"] ?? "not stated"),
    ...contactOf(readSection("contact", data), wheelset["wheels"]!, theory),
    theory: theory ?? THEORIES[0],
    memory,
    ...Object.fromEntries(keys.map(([key, value]) => [vehicleField(key), value])),
    k_hat: 0,
    slope_reduction: 1,
  } as Vehicle;
  if (theory !== undefined && vehicle.contact === "line") {
    refuse(`contact.theory = ${shown(theory)} is for an ellipse, not a line contact`);
  }
  if (wheelset["inertia"] === null) refuse("wheelset.inertia is missing: this page shows wheelsets");
  vehicle.inertia += rotorOf(wheelset);
  vehicle.k_hat = kHatOf(vehicle, friction);
  for (const { problem } of brokenTogether({ ...vehicle, speed: Infinity })) {
    refuse(`friction: ${problem.replaceAll("_friction", "")}`);
  }
  vehicle.slope_reduction = slopeReductionOf(vehicle, wheelset);
  try {
    rollingParameters(vehicle);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    refuse(`contact.${error.message}`);
  }
  return vehicle;
}

/** A file's contents, with the keys of the condition that its friction names; keys of the file win. */
function withCondition(data: Table): Table {
  if (data["friction"] === undefined) return data;
  const { condition, ...friction } = tableOf("friction", data["friction"]);
  if (condition === undefined) return data;
  const name = textOf("friction.condition", condition, Object.keys(CONDITIONS));
  const filled = (section: string, given: Table): Table => ({
    ...Object.fromEntries(Object.entries(CONDITIONS[name]![section]!).filter(([key]) =>
      !REPLACED_BY[key]?.some((other) => Object.hasOwn(given, other)))),
    ...given,
  });
  return {
    ...data, friction: filled("friction", friction),
    ...(data["wheelset"] !== undefined &&
      { wheelset: filled("wheelset", tableOf("wheelset", data["wheelset"])) }),
  };
}

/** A file's contents, and what is no number in [contact], taken out of it. */
function numbersOnly(data: Table): { data: Table; theory: string | undefined; memory: boolean } {
  if (data["contact"] === undefined) return { data, theory: undefined, memory: false };
  const { theory, memory = false, ...contact } = tableOf("contact", data["contact"]);
  if (theory !== undefined) textOf("contact.theory", theory, THEORIES);
  if (typeof memory !== "boolean") refuse(`contact.memory = ${shown(memory)} must be true or false`);
  return { data: { ...data, contact }, theory: theory as string | undefined, memory };
}

function refuseOthers(data: Table): void {
  const [is, command, model] = Object.hasOwn(data, "axes") ? ["a sweep", "sweep", "a wheelset"]
    : Object.hasOwn(data, "demand") ? ["a scenario", "simulate", shown(data["wheelset"])] : [];
  if (is === undefined) return;
  refuse(`the page shows one wheelset, and this is ${is}, which the command 'contactlib ${command}' ` +
    `runs: open the model file of ${model}`);
}

function checkLaw(data: Table): void {
  if (data["law"] === undefined) return;
  const law = tableOf("law", data["law"]);
  const kind = law["kind"] === undefined ? LAW : textOf("law.kind", law["kind"]);
  if (kind !== LAW) refuse(`law.kind = ${shown(kind)}: this page shows "${LAW}" only`);
  checkKeys("law.", law, ["kind"], []);
}

/** The contact of the one pair of keys that [contact] gives. */
function contactOf(section: Numbers, wheels: number, theory: string | undefined): Partial<Vehicle> {
  const given = CONTACTS.flat().filter((key) => section[key] !== null);
  if (!CONTACTS.some((pair) => pair.join() === given.join())) {
    const pairs = CONTACTS.map((pair) => pair.join(" and ")).join(", or ");
    refuse(`contact.${pairs}: give exactly one of these pairs, not ${given.join(" and ") || "nothing"}`);
  }
  const { wheel_load: load, youngs_modulus, poisson_ratio } = section as Record<string, number>;
  const elastic = { axle_load: load! * wheels, youngs_modulus, poisson_ratio } as Vehicle;
  const modulus = contactModulus(elastic);
  const [first, second] = given.map((key) => section[key]) as [number, number];
  const isLine = given[0] === "semi_width";
  const [a, b] = given[0] !== "radius_x" ? [first, second]
    : kernel.semiAxes(first, second, load! / (Math.PI * modulus));
  const pressure = isLine ? (a * modulus) / (2 * second) : (1.5 * load!) / (Math.PI * a * b); // Eqs. (5), (20)
  if (!(a > 0 && Number.isFinite(a) && pressure > 0 && Number.isFinite(pressure))) {
    refuse(`contact.${given.join(" and ")} = ${first} and ${second} give a semi-width of ${a} m and ` +
      `a pressure of ${pressure} Pa: must be finite and > 0`);
  }
  if (theory !== "strips" && !isLine && a / b > LONGEST_ELLIPSE) {
    refuse(`contact.semi_axis_x/semi_axis_y on a half-space = ${a / b}: must be <= ${LONGEST_ELLIPSE}`);
  }
  const contact = isLine ? "line" : "elliptic";
  return { ...elastic, contact, semi_width: a, peak_pressure: pressure };
}

/** k_hat as [friction] gives it, or from the weakening length. */
function kHatOf(vehicle: Vehicle, { k_hat: given, weakening_length: length }: Numbers): number {
  if (given != null) return given;
  const found = scalesOf(weakenedOver(vehicle, length!)).k_hat;
  const problem = outOfRange("k_hat", found, SECTIONS["friction"]!["k_hat"]!);
  return problem === null ? found : refuse(`friction.weakening_length = ${length} gives ${problem}`);
}

/** Inertia of the rotor about the axle, zero without one [kg.m2]. */
function rotorOf({ rotor_inertia: rotor, gear_ratio: ratio }: Numbers): number {
  if (rotor == null && ratio == null) return 0;
  if (rotor != null && ratio != null) return ratio * ratio * rotor;
  const given = rotor == null ? "gear_ratio" : "rotor_inertia";
  refuse(`wheelset.rotor_inertia and gear_ratio go together; given is ${given}`);
}

/** Slope reduction as [wheelset] gives it, or from the saturation creepage; 1 without either. */
function slopeReductionOf(vehicle: Vehicle, section: Numbers): number {
  const { saturation_creepage: saturation, slope_reduction: given } = section;
  if (saturation == null) return given ?? 1;
  const clean = scalesOf(forceParameters(vehicle)).saturation_creepage;
  if (saturation >= clean * (1 - 1e-12)) return Math.min(1, clean / saturation);
  refuse(`wheelset.saturation_creepage = ${saturation} is out of range: must be >= ` +
    `${clean.toPrecision(6)}, that of clean surfaces`);
}

/**
 * A file that contactlib.load_model reads to this vehicle, whose axle load is `axleLoad` [N].
 * Throws a ModelError where Python would refuse the file.
 */
export function writeModel(vehicle: Vehicle, axleLoad: number): string {
  const v = atLoad(vehicle, axleLoad), fields = new Map(Object.entries(v));
  const { semi_width: a, peak_pressure: p0, youngs_modulus, poisson_ratio } = v;
  const wheel_load = v.axle_load / v.wheels;
  const shape = v.contact === "line"
    ? { semi_width: a, radius: (a * contactModulus(v)) / (2 * p0) } // Eq. (5)
    : { semi_axis_x: a, semi_axis_y: lateralSemiAxis(v), theory: v.theory };
  const section = (name: string): Table => {
    const known = Object.keys(SECTIONS[name]!).map((key) => [key, fields.get(vehicleField(key))]);
    return Object.fromEntries(known.filter(([, value]) => value != null));
  };
  const data = {
    name: v.name,
    source: v.source,
    contact: { ...shape, wheel_load, youngs_modulus, poisson_ratio, memory: v.memory },
    ...Object.fromEntries(OF_VEHICLE.map((name) => [name, section(name)])),
  };
  const text = `# In SI units\n${stringify(data)}`;
  readModel(text);
  return text;
}
