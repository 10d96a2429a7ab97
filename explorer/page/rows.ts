/* The values that a visitor can set, the ends of their sliders, and what they change. */

import { settingLimit } from "../files/declared";
import { demand } from "../physics/limits";
import type { Control } from "../physics/run";
import { contactModulus, type Vehicle } from "../physics/vehicle";
import type { App } from "./app";
import { Row, type RowSpec } from "./controls";

const MEGA = 1e6, KILO = 1e3, MILLI = 1e-3, FEMTO = 1e-15, PERCENT = 1e-2;
const FALL = "Friction falls with slip speed w by (1 - A) exp(-B w) + A";
const HEAT = "Friction falls with the contact's flash temperature T by 1 - T/T\u2098; it replaces A and B";

/** Rows by their place in the page. */
export interface Rows {
  torque: Row[];
  creep: Row[];
  kick: Row[];
  wet: Row[];
  wheel: Row[];
  /** Those whose values change as a free wheelset gains speed. */
  following: Row[];
}

type Numbers<T> = { [K in keyof T]: T[K] extends number ? K : never }[keyof T];
type Shape = Omit<RowSpec, "read" | "write" | "limit">;

/** How a value is shown: name, unit, SI value of the unit, ends of the slider, and a help. */
const shape = (id: string, label: string, unit: string, scale: number, min: number, max: number,
  help: string, log = false): Shape => ({ id, label, unit, scale, min, max, help, log });

export function makeRows(app: App): Rows {
  const row = (key: string, spec: Shape, read: () => number, write: (value: number) => void): Row =>
    new Row({
      ...spec,
      limit: settingLimit(key),
      read,
      write: (value) => {
        app.endStory();
        write(value);
        app.changed();
      },
    });
  const control = (key: Numbers<Control>, spec: Shape): Row =>
    row(key, spec, () => app.control[key], (value) => (app.control[key] = value));
  const wheel = (key: Numbers<Vehicle>, spec: Shape): Row =>
    row(key, spec, () => app.settings.vehicle[key],
      (value) => app.change(() => (app.settings.vehicle[key] = value)));
  const ratio = (): number =>
    app.settings.vehicle.static_friction / app.settings.vehicle.kinetic_friction;
  const setFriction = (kinetic: number, over: number): void => app.change(() =>
    Object.assign(app.settings.vehicle, { kinetic_friction: kinetic, static_friction: over * kinetic }));
  const temperature = (): number => app.settings.vehicle.softening_temperature;
  const setFall = (slip_rate_decay: number, softening_temperature: number): void => app.change(() =>
    Object.assign(app.settings.vehicle, { slip_rate_decay, softening_temperature }));

  const rows = {
    torque: [
      control("drive_torque", shape("torque", "drive torque T", "kN m", KILO, 0, 35e3,
        "Torque on the wheelset, which moves there at the rate below")),
      control("torque_rate", shape("rate", "rate of the torque", "kN m/s", KILO, 50, 1e5,
        "Rate at which the torque moves to its new value", true)),
    ],
    creep: [
      control("creepage", shape("reference", "reference \u03b6", "%", PERCENT, 0, 0.06,
        "Creepage that creep control holds")),
      control("proportional_gain", shape("gain", "gain Kp", "MN m", MEGA, 1e4, 1e7,
        "Torque per creepage, T = T0 + Kp (reference - creepage)", true)),
      control("integral_gain", shape("integral", "integral gain Ki", "MN m/s", MEGA, 0, 1e7,
        "If it is 0, T0 is the steady torque at the reference")),
      control("delay", shape("delay", "delay", "ms", MILLI, 0, 0.03, "Age of the measured creepage")),
      control("torque_max", shape("limit", "largest torque", "kN m", KILO, 1e3, 1e5,
        "Largest torque that creep control demands", true)),
    ],
    kick: [
      row("kick", shape("kick-size", "kick adds", "%", PERCENT, -0.02, 0.06,
        "Added to the creepage at once, as a blow on the rim would"),
        () => app.kickSize, (value) => (app.kickSize = value)),
    ],
    wet: [
      row("patch_friction", shape("wet-friction", "wet friction \u00d7", "", 1, 0.1, 1,
        "Factor on both friction coefficients on the patch"),
        () => app.settings.patch.friction,
        (value) => app.change(() => (app.settings.patch.friction = value))),
      row("patch_time", shape("wet-time", "time on the patch", "ms", MILLI, 1e-3, 1,
        "Length of the patch over the speed", true),
        () => app.settings.patch.length / app.run.now.speed,
        (value) => {
          const length = value * app.run.now.speed;
          demand("patch_length", length, settingLimit("patch_length"));
          app.settings.patch.length = length;
        }),
    ],
    wheel: [
      wheel("k_hat", shape("k-hat", "drop of friction K", "", 1, 0, 1.2,
        "k_hat of Eq. (17), at the nominal load")),
      row("friction_ratio", shape("ratio", "ratio f_s / f_d", "", 1, 1.05, 4,
        "At a given K it changes the length of the weakening zone"),
        ratio, (value) => setFriction(app.settings.vehicle.kinetic_friction, value)),
      row("kinetic_friction", shape("kinetic", "kinetic friction f_d", "", 1, 0.03, 0.6,
        "K and f_s / f_d stay: f_s and the weakening length change with it"),
        () => app.settings.vehicle.kinetic_friction, (value) => setFriction(value, ratio())),
      row("load", shape("load", "load P", "kN", KILO, 2e4, 4e5,
        "Normal load of both wheels; the contact grows with it"),
        () => app.settings.axleLoad, (value) => app.change(() => (app.settings.axleLoad = value))),
      row("speed", shape("speed", "speed V", "m/s", 1, 1, 60,
        "Forward speed; it then changes if the vehicle is free", true),
        () => app.run.now.speed, (value) => app.setSpeed(value)),
      wheel("inertia", shape("inertia", "inertia J", "kg m\u00b2", 1, 30, 1000,
        "Inertia of the wheelset and its drive", true)),
      wheel("layer_compliance", shape("layer", "layer h/G", "\u00b5m/GPa", FEMTO, 0, 1e-12,
        "Thickness over shear modulus of a layer between wheel and rail")),
      wheel("slope_reduction", shape("slope", "slope reduction", "", 1, 0.02, 1,
        "Lowers the initial slope alike at any load", true)),
      wheel("slip_rate_residual", shape("residual", "residual friction A", "", 1, 0.2, 1, FALL)),
      row("slip_rate_decay", shape("decay", "fall with slip speed B", "s/m", 1, 0, 3, FALL),
        () => app.settings.vehicle.slip_rate_decay,
        (value) => setFall(value, value > 0 ? 0 : temperature())),
      row("heat", shape("heat", "fall with heat 1/T\u2098", "1/kK", MILLI, 0, 4e-3, HEAT),
        () => (temperature() > 0 ? 1 / temperature() : 0),
        (value) => setFall(0, value > 0 ? 1 / value : 0)),
      wheel("damping", shape("damping", "damping b", "N m s", 1, 0, 300,
        "Drive torque lost per angular velocity, which ends a slip-away")),
    ],
  };
  const following = [...rows.wet, ...rows.wheel].filter(({ id }) => ["wet-time", "speed"].includes(id));
  return { ...rows, following };
}

/** Ends of the sliders that follow the vehicle: of torque, load, reference and kick. */
export function spanRows(rows: Rows, app: App): void {
  const { largest: { torque: largest }, base, axes: { far } } = app.shown, { vehicle } = app.settings;
  const ends: Record<string, [number, number]> = {
    torque: [0.5 * largest, 1.1 * largest],
    reference: [0, base], // which does not move under a finger
    "kick-size": [-0.25 * far, 0.75 * far],
    load: [0.1 * vehicle.axle_load, 1.8 * vehicle.axle_load],
  };
  for (const row of Object.values(rows).flat()) {
    const span = ends[row.id];
    if (span !== undefined) row.span(...span);
  }
}

/** Source and main data of the model, in a line. */
export function modelNote(app: App): string {
  const { vehicle } = app.settings;
  const moves = vehicle.mass === null ? "speed held, as on a roller rig"
    : `moves ${Math.round(vehicle.mass / 1e3)} t`;
  return `${vehicle.source} (${moves}; E* ${Math.round(contactModulus(vehicle) / 1e9)} GPa)`;
}
