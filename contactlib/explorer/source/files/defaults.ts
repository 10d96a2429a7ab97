// What the page begins with: the shipped models, and what is chosen for a demonstration of each.

import type { Control } from "../physics/run";
import type { Vehicle } from "../physics/vehicle";
import { type Model, readModel } from "./model_file";
import { pageData } from "./page_data";

/** All that a visitor can set [SI units]. */
export interface Settings {
  /** Name of the shipped model that an address counts its changes from. */
  preset: string;
  vehicle: Vehicle;
  /** Load that acts, which may differ from the nominal one [N]. */
  normalLoad: number;
  speed: number;
  control: Control;
  /** A wet patch: its friction over that before it [1], and its length [m]. */
  patch: { friction: number; length: number };
  /** Simulated time per time [1]. */
  playback: number;
}

/** Settings by the name of a shipped model. */
export type Presets = Readonly<Record<string, Settings>>;

// The gain holds the falling branch of both shipped models at 10 m/s, where poles reach 69 1/s and
// g = 2e-4 1/(N.m.s): it takes 3.5e5 N.m anywhere, and at a creepage of 0.024 at most 1.4e6 N.m
// behind a delay of 5 ms, but 4.9e5 N.m behind 12 ms.
const GAINS = { proportional_gain: 6e5, integral_gain: 6e5 };

// The rig's steady states at the first torque of its file have no unstable one beside them, so
// that every wet patch is survived. At this one a patch of half the friction may last 8 ms.
const CHOSEN: Readonly<Record<string, Partial<Control>>> = {
  roller_rig: { ...GAINS, drive_torque: 24.6e3 },
  locomotive: GAINS,
};

/** Settings that a model begins with, in traction: what its file says, but for what is chosen. */
export function settingsOf(
  model: Model,
  preset: string,
  chosen: Partial<Control> = {},
): Settings {
  const { vehicle, runs } = model;
  const { creepage, proportional_gain, integral_gain, torque_max } = runs.creep_control;
  return {
    preset,
    vehicle,
    normalLoad: vehicle.normal_load,
    speed: Math.max(vehicle.initial_speed, vehicle.minimum_speed),
    control: {
      mode: "torque",
      drive_torque: Math.max(0, runs.torque_control.torque[0] ?? 0),
      torque_rate: 1e3,
      creepage: Math.max(0, creepage.at(-1) ?? 0),
      proportional_gain,
      integral_gain,
      torque_max: Math.max(0, torque_max),
      delay: 0,
      ...chosen,
    },
    patch: { friction: 0.5, length: 0.1 },
    playback: 1,
  };
}

/** Settings of the shipped models, whose files the build put into the page. */
export function pagePresets(): Presets {
  const files = pageData("models") as Record<string, string>;
  const read = Object.entries(files).map(([name, text]) => {
    return [name, settingsOf(readModel(text), name, CHOSEN[name])] as const;
  });
  return Object.fromEntries(read);
}

/** Text of the model file that the command wrote into the page; null if it wrote none. */
export function givenModel(): string | null {
  return pageData("given-model") as string | null;
}
