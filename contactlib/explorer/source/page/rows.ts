/* Which values a visitor can set, between which ends and what they do. */

import { contactModulus } from "../physics/vehicle";
import type { App } from "./app";
import { Row, type RowSpec } from "./controls";

const MEGA = 1e6, KILO = 1e3, MILLI = 1e-3, PERCENT = 1e-2;

/** Rows by the place that they are in. */
export interface Rows {
  torque: Row[];
  creep: Row[];
  kick: Row[];
  wet: Row[];
  wheel: Row[];
}

export function makeRows(app: App): Rows {
  /** A row whose change is one of the control: nothing is drawn anew. */
  const control = (spec: Omit<RowSpec, "read" | "write">, key: "drive_torque" | "torque_rate" |
    "creepage" | "proportional_gain" | "integral_gain" | "torque_max" | "delay"): Row =>
    new Row({
      ...spec,
      read: () => app.control[key],
      write: (value) => {
        app.endStory();
        app.control[key] = value;
      },
    });

  type Number = "k_hat" | "kinetic_friction" | "slip_rate_residual" | "slip_rate_decay" |
    "inertia" | "damping" | "slope_reduction";
  const wheel = (spec: Omit<RowSpec, "read" | "write">, key: Number): Row =>
    new Row({
      ...spec,
      read: () => app.settings.vehicle[key],
      write: (value) => vehicle(() => (app.settings.vehicle[key] = value)),
    });
  const vehicle = (change: () => void): void => {
    app.endStory();
    app.change(change);
  };

  return {
    torque: [
      control({ id: "torque", label: "drive torque T", unit: "kN m", scale: KILO, min: 0,
        max: 35e3, limits: { atLeast: 0 }, help: "Torque on the wheelset; it moves there at the rate below" },
        "drive_torque"),
      control({ id: "rate", label: "rate of the torque", unit: "kN m/s", scale: KILO, min: 50,
        max: 1e5, log: true, limits: { above: 0 }, help: "How fast the torque moves to what is set" },
        "torque_rate"),
    ],
    creep: [
      control({ id: "reference", label: "reference \u03b6", unit: "%", scale: PERCENT, min: 0,
        max: 0.06, limits: { atLeast: 0 }, help: "Creepage that creep control keeps" }, "creepage"),
      control({ id: "gain", label: "gain Kp", unit: "MN m", scale: MEGA, min: 1e4,
        max: 1e7, log: true, limits: { atLeast: 0 }, help: "Torque per creepage, T = T0 + Kp (reference - creepage)" },
        "proportional_gain"),
      control({ id: "integral", label: "integral gain Ki", unit: "MN m/s", scale: MEGA, min: 0,
        max: 1e7, limits: { atLeast: 0 }, help: "Without it T0 is the torque of the reference" },
        "integral_gain"),
      control({ id: "delay", label: "delay", unit: "ms", scale: MILLI, min: 0, max: 0.03,
        limits: { atLeast: 0, atMost: 0.5 }, help: "Age of the measured creepage" }, "delay"),
      control({ id: "limit", label: "largest torque", unit: "kN m", scale: KILO, min: 1e3, max: 1e5,
        log: true, limits: { atLeast: 0 }, help: "Creep control asks for no more" }, "torque_max"),
    ],
    kick: [
      new Row({ id: "kick-size", label: "kick adds", unit: "%", scale: PERCENT, min: -0.02,
        max: 0.06, help: "Added to the creepage at once, as a blow on the rim would",
        read: () => app.kickSize, write: (value) => (app.kickSize = value) }),
    ],
    wet: [
      new Row({ id: "wet-friction", label: "wet friction \u00d7", unit: "", scale: 1, min: 0.1,
        max: 1, limits: { above: 0, atMost: 10 }, help: "Factor on both friction coefficients on the patch",
        read: () => app.settings.patch.friction,
        write: (value) => vehicle(() => (app.settings.patch.friction = value)) }),
      new Row({ id: "wet-time", label: "time on the patch", unit: "ms", scale: MILLI, min: 1e-3,
        max: 1, log: true, limits: { above: 0 }, help: "Length of the patch over the speed",
        read: () => app.settings.patch.length / app.run.speed,
        write: (value) => {
          app.settings.patch.length = value * app.run.speed;
          app.changed();
        } }),
    ],
    wheel: [
      wheel({ id: "k-hat", label: "drop of friction K", unit: "", scale: 1, min: 0, max: 1.2,
        limits: { atLeast: 0, atMost: 2 }, help: "k_hat of Eq. (17), at the nominal load" }, "k_hat"),
      new Row({ id: "ratio", label: "ratio f_s / f_d", unit: "", scale: 1, min: 1.05,
        max: 4, limits: { atLeast: 1 }, help: "At a given K it changes the length of the weakening zone",
        read: () => app.settings.vehicle.static_friction / app.settings.vehicle.kinetic_friction,
        write: (value) => vehicle(() => {
          const v = app.settings.vehicle;
          v.static_friction = value * v.kinetic_friction;
        }) }),
      new Row({ id: "kinetic", label: "kinetic friction f_d", unit: "", scale: 1, min: 0.03,
        max: 0.6, limits: { above: 0, atMost: 2 }, help: "f_s keeps its ratio to it",
        read: () => app.settings.vehicle.kinetic_friction,
        write: (value) => vehicle(() => {
          const v = app.settings.vehicle, ratio = v.static_friction / v.kinetic_friction;
          v.kinetic_friction = value;
          v.static_friction = ratio * value;
        }) }),
      new Row({ id: "load", label: "load P", unit: "kN", scale: KILO, min: 2e4, max: 4e5,
        limits: { above: 0 }, help: "Normal load of both wheels; the contact grows with it",
        read: () => app.settings.normalLoad,
        write: (value) => vehicle(() => (app.settings.normalLoad = value)) }),
      new Row({ id: "speed", label: "speed V", unit: "m/s", scale: 1, min: 1, max: 60, log: true,
        limits: { above: 0.2, atMost: 100 }, help: "Forward speed; a free vehicle goes on from there",
        read: () => app.run.speed,
        write: (value) => {
          app.endStory();
          app.setSpeed(value);
        } }),
      wheel({ id: "inertia", label: "inertia J", unit: "kg m\u00b2", scale: 1, min: 30, max: 1000,
        log: true, limits: { above: 0 }, help: "Of the wheelset with its drive" }, "inertia"),
      wheel({ id: "slope", label: "slope reduction", unit: "", scale: 1, min: 0.02, max: 1,
        log: true, limits: { above: 0, atMost: 1 }, help: "A third body on the rail lowers the initial slope" },
        "slope_reduction"),
      wheel({ id: "residual", label: "left at high slip A", unit: "", scale: 1, min: 0.2,
        max: 1, limits: { above: 0, atMost: 1 }, help: "Friction falls with slip speed w by (1 - A) exp(-B w) + A" },
        "slip_rate_residual"),
      wheel({ id: "decay", label: "fall with slip speed B", unit: "s/m", scale: 1, min: 0, max: 3,
        limits: { atLeast: 0 }, help: "Friction falls with slip speed w by (1 - A) exp(-B w) + A" },
        "slip_rate_decay"),
      wheel({ id: "damping", label: "damping b", unit: "N m s", scale: 1, min: 0, max: 300,
        limits: { atLeast: 0 }, help: "Drive torque lost per angular velocity; it ends a run-away" },
        "damping"),
    ],
  };
}

/** Ends of the sliders that follow the vehicle: of torque, load, reference and kick. */
export function spanRows(rows: Rows, app: App): void {
  const { fold, dry, far } = app.shown, { vehicle } = app.settings;
  const most = fold?.drive_torque ?? Math.max(...dry.torque);
  rows.torque[0]?.span(0.5 * most, 1.1 * most);
  rows.creep[0]?.span(0, far);
  rows.kick[0]?.span(-0.25 * far, 0.75 * far);
  rows.wheel.find((row) => row.element.querySelector("#load-slider"))
    ?.span(0.1 * vehicle.normal_load, 1.8 * vehicle.normal_load);
}

/** What the model is, in a line. */
export function modelNote(app: App): string {
  const { vehicle } = app.settings;
  const moves = vehicle.mass === null ? "speed held, as on a roller rig"
    : `moves ${Math.round(vehicle.mass / 1e3)} t`;
  return `${vehicle.source} (${moves}; E* ${Math.round(contactModulus(vehicle) / 1e9)} GPa)`;
}
