// A state of the page in its address: "#vehicle=roller_rig&k_hat=0.5&mode=creep", with what differs
// from the shipped model that it names. Read as text and numbers, nothing else.

import type { Control } from "../physics/run";
import type { Vehicle } from "../physics/vehicle";
import { pagePresets, type Presets, type Settings } from "./defaults";
import { allows, type Limits, limitText, pageLimits } from "./limits";
import { decimal, shown } from "./reading";
import { settingLimit, TOGETHER } from "./setting_limits";

const TEXTS = ["name", "source"]; // of a vehicle
const CHOICES: Readonly<Record<string, string[]>> = {
  contact: ["line", "elliptic"],
  mode: ["torque", "creep"],
};
const LONGEST = 4000; // characters of an address

type Value = number | string | null;

/** The settings by their keys in the address; none occurs twice. */
function flat(settings: Settings): Record<string, Value> {
  const { vehicle, normalLoad, speed, control, patch, playback } = settings;
  return {
    ...vehicle,
    load: normalLoad,
    speed,
    ...control,
    patch_friction: patch.friction,
    patch_length: patch.length,
    playback,
  };
}

function unflat(values: Record<string, Value>, preset: Settings): Settings {
  const pick = (part: object) =>
    Object.fromEntries(Object.keys(part).map((key) => [key, values[key] ?? null]));
  return {
    preset: preset.preset,
    vehicle: pick(preset.vehicle) as unknown as Vehicle,
    normalLoad: values["load"] as number,
    speed: values["speed"] as number,
    control: pick(preset.control) as unknown as Control,
    patch: {
      friction: values["patch_friction"] as number,
      length: values["patch_length"] as number,
    },
    playback: values["playback"] as number,
  };
}

/** The part of the page's address that says these settings, to the last bit. */
export function toAddress(settings: Settings, presets: Presets = pagePresets()): string {
  const preset = presets[settings.preset];
  if (preset === undefined) throw new Error(`no shipped model ${shown(settings.preset)}`);
  const before = flat(preset);
  const changed = Object.entries(flat(settings)).filter(([key, value]) => value !== before[key]);
  const parts = changed.map(([key, value]) => `${key}=${encodeURIComponent(value ?? "none")}`);
  return `#${[`vehicle=${settings.preset}`, ...parts].join("&")}`;
}

/** The settings that an address says, and one line for each thing in it that cannot be used. */
export interface FromAddress {
  settings: Settings;
  problems: string[];
}

/**
 * Settings of an address. What cannot be used is left as the preset has it, and told of; without
 * a vehicle in the address the preset is the first one.
 */
export function fromAddress(
  hash: string,
  presets: Presets = pagePresets(),
  limits: Limits = pageLimits(),
): FromAddress {
  const problems: string[] = [];
  const given = hash.length > LONGEST ? [] : pairs(hash, problems);
  if (hash.length > LONGEST) {
    problems.push(`the address has ${hash.length} characters: must be <= ${LONGEST}`);
  }
  const names = Object.keys(presets);
  const wanted = given.find(([key]) => key === "vehicle")?.[1] ?? names[0]!;
  const known = names.includes(wanted);
  if (!known) problems.push(`vehicle = ${shown(wanted)} must be one of: ${names.join(", ")}`);
  const preset = presets[known ? wanted : names[0]!]!;
  const values = flat(preset);
  const seen = new Set<string>();
  for (const [key, text] of given) {
    if (seen.has(key)) {
      problems.push(`${shown(key)} is given twice: the first is taken`);
      continue;
    }
    seen.add(key);
    if (key === "vehicle") continue;
    const problem = take(key, text, values, limits);
    if (problem !== null) problems.push(problem);
  }
  const before = flat(preset);
  for (const { keys, must, holds } of TOGETHER) {
    if (holds(values as Record<string, number>)) continue;
    problems.push(`${keys.map((key) => `${key} = ${values[key]}`).join(", ")}: must be ${must}`);
    for (const key of keys) values[key] = before[key]!;
  }
  return { settings: unflat(values, preset), problems };
}

/** Keys and texts of an address. */
function pairs(hash: string, problems: string[]): [string, string][] {
  const found: [string, string][] = [];
  for (const part of hash.replace(/^#/, "").split("&").filter(Boolean)) {
    const at = part.indexOf("=");
    try {
      if (at < 1) throw new URIError();
      found.push([part.slice(0, at), decodeURIComponent(part.slice(at + 1))]);
    } catch {
      problems.push(`${shown(part)} must be a key, =, and a value`);
    }
  }
  return found;
}

/** Put one value of an address among the others; the answer is what is wrong with it, if it is. */
function take(
  key: string,
  text: string,
  values: Record<string, Value>,
  limits: Limits,
): string | null {
  if (!Object.hasOwn(values, key)) return `${shown(key)} is not a known key`;
  if (TEXTS.includes(key)) {
    values[key] = text;
    return null;
  }
  if (Object.hasOwn(CHOICES, key)) {
    if (!CHOICES[key]!.includes(text)) {
      return `${key} = ${shown(text)} must be one of: ${CHOICES[key]!.join(", ")}`;
    }
    values[key] = text;
    return null;
  }
  if (key === "mass" && text === "none") {
    values[key] = null;
    return null;
  }
  const limit = settingLimit(key, limits);
  if (limit === undefined) return `${key} has no limits in this page`;
  const number = decimal(text);
  if (Number.isNaN(number)) return `${key} = ${shown(text)} is not a number in ${limit.unit}`;
  if (!allows(limit, number)) {
    return `${key} = ${number} is out of range: must be ${limitText(limit)}`;
  }
  values[key] = number;
  return null;
}
