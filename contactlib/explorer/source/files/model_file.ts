// Model files: the TOML that contactlib.load_model reads, in and out.

import { stringify } from "smol-toml";

import type { Control } from "../physics/run";
import { atLoad, type Vehicle } from "../physics/vehicle";
import { contactOf, contactSection, kHatOf, slopeReductionOf } from "./derived";
import { type Limits, pageLimits } from "./limits";
import { checkKeys, ModelError, parseToml, shown, type Table, textOf } from "./reading";
import { checkLaw, oneOf, readNumbers, readProfile } from "./sections";

export { ModelError } from "./reading";

/** What a model file says of its two runs [s, N.m, 1, N.m/s]. */
export interface Runs {
  torque_control: { time: number[]; torque: number[] };
  creep_control: {
    time: number[];
    creepage: number[];
    proportional_gain: number;
    integral_gain: number;
    torque_min: number;
    torque_max: number;
  };
}

/** A model file: the vehicle that the page shows, and the runs that it keeps. */
export interface Model {
  vehicle: Vehicle;
  runs: Runs;
}

const HOLD = 20; // length of the runs of a file that is written [s]
const SHOWN = "this page shows models";
const NEEDED = [
  "name", "source", "contact", "friction", "wheelset", "resistance", "run", "torque_control",
  "creep_control",
];

/** Read a model file. Throws a ModelError of one line that names key, value and limit. */
export function readModel(text: string, limits: Limits = pageLimits()): Model {
  const data = parseToml(text);
  refuseOthers(data);
  checkKeys("", data, [...NEEDED, "law"], NEEDED);
  checkLaw(data);
  const friction = readNumbers("friction", data, limits);
  const { saturation_creepage, slope_reduction, ...body } = readNumbers("wheelset", data, limits);
  const layer = { saturation_creepage, slope_reduction };
  oneOf("friction", friction, ["weakening_length", "k_hat"]);
  if (saturation_creepage !== null) oneOf("wheelset", layer, Object.keys(layer));
  const bare = {
    name: textOf("name", data["name"]),
    source: textOf("source", data["source"]),
    ...contactOf(readNumbers("contact", data, limits)),
    static_friction: friction["static"],
    kinetic_friction: friction["kinetic"],
    k_hat: 0,
    slip_rate_residual: friction["slip_rate_residual"],
    slip_rate_decay: friction["slip_rate_decay"],
    ...body,
    slope_reduction: 1,
    ...readNumbers("resistance", data, limits),
    ...readNumbers("run", data, limits),
  } as Vehicle;
  const vehicle = {
    ...bare,
    k_hat: kHatOf(bare, friction, limits),
    slope_reduction: slopeReductionOf(bare, layer),
  };
  return { vehicle, runs: readRuns(data, limits) };
}

function refuseOthers(data: Table): void {
  if (Object.hasOwn(data, "axes")) {
    throw new ModelError(
      "this is a sweep, not a model: the command 'contactlib sweep' runs it; " + SHOWN,
    );
  }
  if (Object.hasOwn(data, "vehicle")) {
    throw new ModelError(
      `this is a scenario of the vehicle ${shown(data["vehicle"])}, not a model: the command ` +
        `'contactlib simulate' runs it; ${SHOWN}`,
    );
  }
}

function readRuns(data: Table, limits: Limits): Runs {
  const torque = readProfile("torque_control", "torque", data, limits);
  const creep = readProfile("creep_control", "creepage", data, limits);
  const numbers = creep.numbers as Omit<Runs["creep_control"], "time" | "creepage">;
  if (numbers.torque_min >= numbers.torque_max) {
    throw new ModelError(
      `creep_control.torque_min = ${numbers.torque_min} is out of range: must be < torque_max = ` +
        `${numbers.torque_max}`,
    );
  }
  return {
    torque_control: { time: torque.time, torque: torque.value },
    creep_control: { time: creep.time, creepage: creep.value, ...numbers },
  };
}

/**
 * A file that contactlib.load_model reads to this vehicle, whose nominal load is `normalLoad` [N].
 *
 * Its runs hold the control's torque and creepage. Throws a ModelError where Python would refuse
 * the file.
 */
export function writeModel(
  vehicle: Vehicle,
  normalLoad: number,
  control: Control,
  limits: Limits = pageLimits(),
): string {
  const v = atLoad(vehicle, normalLoad);
  const { proportional_gain, integral_gain, torque_max } = control;
  const time = [0, HOLD];
  const data = {
    name: v.name,
    source: v.source,
    contact: contactSection(v),
    friction: {
      static: v.static_friction,
      kinetic: v.kinetic_friction,
      k_hat: v.k_hat,
      slip_rate_residual: v.slip_rate_residual,
      slip_rate_decay: v.slip_rate_decay,
    },
    wheelset: {
      radius: v.radius,
      inertia: v.inertia,
      mass: v.mass, // left out if null
      damping: v.damping,
      slope_reduction: v.slope_reduction,
      minimum_speed: v.minimum_speed,
    },
    resistance: {
      constant: v.constant,
      linear: v.linear,
      quadratic: v.quadratic,
      grade: v.grade,
    },
    run: { initial_speed: v.initial_speed },
    torque_control: { time, torque: time.map(() => control.drive_torque) },
    creep_control: {
      time,
      creepage: time.map(() => control.creepage),
      proportional_gain,
      integral_gain,
      torque_min: 0,
      torque_max,
    },
  };
  const text = `# In SI units\n${stringify(data)}`;
  readModel(text, limits);
  return text;
}
