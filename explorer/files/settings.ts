// What a visitor can set: how the page begins with it, and its place in the address, such as
// "#vehicle=roller_rig&k_hat=0.5&mode=creep". The address holds what differs from the shipped model
// that it names. It is read as text and numbers, nothing else.

import { embeddedData } from "../kernel/embedded";
import type { Control } from "../physics/control";
import { outOfRange } from "../physics/limits";
import { Plant } from "../physics/plant";
import type { Vehicle } from "../physics/vehicle";
import { brokenTogether, settingLimit, THEORIES } from "./declared";
import { readModel } from "./model_file";
import { decimal, shown } from "./reading";

/** All that a visitor can set [SI units]. */
export interface Settings {
  /** Name of the shipped model whose values an address leaves out. */
  preset: string;
  vehicle: Vehicle;
  /** Acting load, which may differ from the nominal one [N]. */
  axleLoad: number;
  speed: number;
  control: Control;
  /** A wet patch: its friction over the dry rail's [1], and its length [m]. */
  patch: { friction: number; length: number };
  /** Simulated time per time [1]. */
  playback: number;
}

/** A number to so many significant digits. */
const rounded = (value: number, digits = 2): number => Number(value.toPrecision(digits));

/**
 * The control that a vehicle begins with at a speed: a torque that grips, but so close to the fold
 * that a wet patch takes the grip away, and creep control that may use more than the fold's torque and
 * holds a creepage on the falling branch.
 */
function controlFor(vehicle: Vehicle, speed: number): Control {
  const plant = new Plant(vehicle, vehicle.axle_load), fold = plant.fold(speed);
  const peak = fold?.creepage ?? plant.saturation;
  const critical = fold?.drive_torque ?? plant.torque(peak, speed);
  const drive_torque = rounded(0.9 * critical, 3), creepage = rounded(1.41 * peak);
  const { minimum_gain, pole } = plant.at(creepage, speed);
  const lowest = Number.isFinite(minimum_gain) ? minimum_gain : pole / plant.gain(speed);
  const proportional_gain = rounded(lowest > 0 ? 3 * lowest : critical / creepage);
  return {
    mode: "torque", drive_torque, torque_rate: 1e3, creepage, proportional_gain,
    integral_gain: rounded(2 * proportional_gain), torque_max: rounded(1.3 * critical), delay: 0,
  };
}

/** Settings that a model begins with. */
export function settingsOf(vehicle: Vehicle, preset: string): Settings {
  const speed = Math.max(vehicle.initial_speed, vehicle.minimum_speed);
  return {
    preset, vehicle, axleLoad: vehicle.axle_load, speed, control: controlFor(vehicle, speed),
    patch: { friction: 0.5, length: 0.1 }, playback: 1,
  };
}

/** Settings of the shipped models, by the names of their files. */
export const PRESETS: Readonly<Record<string, Settings>> = Object.fromEntries(
  Object.entries(embeddedData("models") as Record<string, string>).map(
    ([name, text]) => [name, settingsOf(readModel(text), name)],
  ),
);

/** Text of the model file that the command wrote into the page; null without one. */
export function givenModel(): string | null {
  return embeddedData("given-model") as string | null;
}

const TEXTS = ["name", "source"]; // of a vehicle
const CHOICES: Readonly<Record<string, readonly string[]>> = {
  contact: ["line", "elliptic"],
  theory: THEORIES,
  memory: ["false", "true"],
  mode: ["torque", "creep"],
};
const LONGEST = 4000; // characters of an address

type Value = number | string | boolean | null;

type Values = Record<string, Value>;

/** Objects that hold the values of the address, and names there; no key occurs twice. */
function placesOf(settings: Settings): [key: string, owner: Values, name: string][] {
  const { vehicle, control, patch } = settings as unknown as Record<string, Values>;
  const own = (owner: Values): [string, Values, string][] =>
    Object.keys(owner).map((key) => [key, owner, key]);
  const all = settings as unknown as Values;
  return [
    ...own(vehicle!), ["load", all, "axleLoad"], ["speed", all, "speed"], ...own(control!),
    ["patch_friction", patch!, "friction"], ["patch_length", patch!, "length"],
    ["playback", all, "playback"],
  ];
}

/** The values of settings by their keys in the address. */
function flat(settings: Settings): Values {
  return Object.fromEntries(placesOf(settings).map(([key, owner, name]) => [key, owner[name]!]));
}

/** The part of the page's address that holds these settings, to the last bit. */
export function toAddress(settings: Settings): string {
  const before = flat(PRESETS[settings.preset]!);
  const changed = Object.entries(flat(settings)).filter(([key, value]) => value !== before[key]);
  const parts = changed.map(([key, value]) => `${key}=${encodeURIComponent(value ?? "none")}`);
  return `#${[`vehicle=${settings.preset}`, ...parts].join("&")}`;
}

/**
 * Settings of an address, and one line for each part of it that cannot be used: there they keep the
 * preset's value. Without a vehicle in the address the preset is the first one.
 */
export function fromAddress(hash: string): { settings: Settings; problems: string[] } {
  const problems: string[] = [];
  // A plus sign means itself, not a space as in a form.
  const given = [...new URLSearchParams(hash.replace(/^#/, "").replaceAll("+", "%2B"))];
  if (hash.length > LONGEST) {
    problems.push(`the address has ${hash.length} characters: must be <= ${LONGEST}`);
    given.length = 0;
  }
  const names = Object.keys(PRESETS);
  const name = given.find(([key]) => key === "vehicle")?.[1] ?? names[0]!;
  const known = names.includes(name);
  if (!known) problems.push(`vehicle = ${shown(name)} must be one of: ${names.join(", ")}`);
  const preset = PRESETS[known ? name : names[0]!]!;
  const before = flat(preset), values = { ...before }, seen = new Set<string>();
  for (const [key, text] of given) {
    if (seen.has(key)) {
      problems.push(`${shown(key)} is given twice: the first is taken`);
      continue;
    }
    seen.add(key);
    const problem = key === "vehicle" ? null : take(key, text, values);
    if (problem !== null) problems.push(problem);
  }
  for (const { keys, problem } of brokenTogether(values)) {
    problems.push(problem);
    for (const key of keys) values[key] = before[key]!;
  }
  const settings = structuredClone(preset);
  for (const [key, owner, name] of placesOf(settings)) owner[name] = values[key]!;
  return { settings, problems };
}

/** Put one value of an address among the others; returns the problem with it, if there is one. */
function take(key: string, text: string, values: Values): string | null {
  if (!Object.hasOwn(values, key)) return `${shown(key)} is not a known key`;
  const choices = Object.hasOwn(CHOICES, key) ? CHOICES[key]! : null;
  if (choices !== null && !choices.includes(text)) {
    return `${key} = ${shown(text)} must be one of: ${choices.join(", ")}`;
  }
  if (choices !== null || TEXTS.includes(key)) {
    values[key] = typeof values[key] === "boolean" ? text === "true" : text;
  } else if (key === "mass" && text === "none") {
    values[key] = null;
  } else {
    const limit = settingLimit(key), number = decimal(text);
    if (Number.isNaN(number)) return `${key} = ${shown(text)} is not a number in ${limit.unit}`;
    const problem = outOfRange(key, number, limit);
    if (problem !== null) return problem;
    values[key] = number;
  }
  return null;
}
