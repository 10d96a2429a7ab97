/* Guided experiments: each sets the wheel up, does something to it and describes what can be seen. */

import { clearing } from "../physics/clearing";
import { FASTEST_RIM } from "../physics/motion";
import { SAMPLE } from "../physics/run";
import { type Fold, Plant } from "../physics/plant";
import { isStable } from "../physics/stability";
import type { App, Step, Story } from "./app";
import { digits, duration, percent } from "./format";

const OVER = 1.015; // torque over the fold's with which Hysteresis drives the wheel away
const YIELDING = 0.4; // torque over the largest that a wheel that stands springs under
const RISE = 0.06; // time in which that torque comes [s], and LEAVE in which it goes
const LEAVE = 1e-3;
const RESTING = 0.9; // torque over the fold's at which the wheel meets a wet patch, if it is above the return's
const WETTEST = 0.1; // friction at which a patch lets a wheel slip away, if any does

/** Every story needs a wheel that rolls, and a fold. */
function noFold(app: App): string | null {
  if (app.settings.speed < app.settings.vehicle.minimum_speed) {
    return "Here the wheel stands: give it a speed for the experiments, or Play and see it held or break loose.";
  }
  return app.shown.fold !== null ? null
    : "Here the torque has no fold, so there is no slip-away: raise K, or lower the damping.";
}

/** The fold, without which no story begins. */
function critical(app: App): Fold {
  const { fold } = app.shown;
  if (fold === null) throw new RangeError("the story needs a fold");
  return fold;
}

/** Rate at which the wheel leaves the reference of its control [1/s]. */
const poleThere = (app: App): number => app.shown.plant.at(app.control.creepage, app.run.now.speed).pole;

/** Switch to creep control that may use more than the critical torque. */
function creepMode({ control, shown: { fold } }: App): void {
  control.mode = "creep";
  control.torque_max = Math.max(control.torque_max, 1.3 * (fold?.drive_torque ?? 0));
}

/** Set the age of the measurement, as a part of one over the pole. */
function late(app: App, part: number): void {
  app.control.delay = Math.round(part / (poleThere(app) * SAMPLE)) * SAMPLE;
}

const kilo = (torque: number, significant = 4): string => `${digits(1e-3 * torque, significant)} kN m`;

/** Hysteresis needs a branch to slip away to, within the run's limit of the rim speed. */
function noLanding(app: App): string | null {
  const { plant, speed } = app.shown, { drive_torque, return_creepage } = critical(app);
  const landing = plant.steady(OVER * drive_torque, speed)
    .find((state) => isStable(state) && state.creepage > return_creepage);
  if (landing !== undefined && (1 + landing.creepage) * speed < FASTEST_RIM) return null;
  return `Here a slip-away goes on beyond a rim speed of ${FASTEST_RIM} m/s: more damping of the ` +
    "drive, or less speed, would catch it.";
}

/** Part of the critical torque that a patch of some friction takes away; null without a critical torque. */
function parting({ shown }: App, friction: number): number | null {
  const { plant, speed, fold } = shown, back = fold!.return_torque / fold!.drive_torque;
  return [RESTING, 0.5 * (1 + back)].find((part) => Number.isFinite(
    clearing(plant, part * fold!.drive_torque, speed, friction)?.time ?? Infinity)) ?? null;
}

function noClearing(app: App): string | null {
  const { friction } = app.settings.patch;
  if (parting(app, friction) !== null) return null;
  return parting(app, WETTEST) === null ? "Here the wheel survives a wet patch of any length."
    : `The wheel survives a patch of any length with ${digits(friction, 2)} times the dry friction: ` +
      "lower the wet friction.";
}

/** Begin again at rest under a torque that the patch takes away. */
function restBeforePatch(app: App): void {
  rest(app, parting(app, app.settings.patch.friction) ?? RESTING, 0.01);
}

/** Begin again at rest under a part of the critical torque. */
function rest(app: App, part: number, playback: number): void {
  app.control.mode = "torque";
  app.control.drive_torque = part * critical(app).drive_torque;
  app.settings.playback = playback;
  app.restart();
}

function ramp(app: App, part: number, rate: number): void {
  app.control.drive_torque = part * critical(app).drive_torque;
  app.control.torque_rate = rate * critical(app).drive_torque;
}

function border(app: App): number {
  const states = app.shown.plant.steady(app.control.drive_torque, app.run.now.speed);
  return states.find((state) => !isStable(state))?.creepage ?? app.shown.axes.far;
}

function patchStory(app: App, part: number): void {
  const { plant } = app.shown;
  const found = clearing(plant, app.control.drive_torque, app.run.now.speed, app.settings.patch.friction);
  if (found !== null) app.settings.patch.length = part * found.distance;
  app.placePatch();
}

/** A step with its text, and what it begins with. */
const step = (until: Step["until"], text: string | Step["text"], begin?: Step["begin"]): Step =>
  ({ until, text: typeof text === "string" ? () => text : text, ...(begin && { begin }) });

/** A text for the end, while the rest goes on at another pace. */
const slower = (playback: number, text: string): Step =>
  step(Infinity, text, (app) => (app.settings.playback = playback));

/** Why the contact cannot remember; null if it can. */
function noMemory({ settings: { vehicle, axleLoad } }: App): string | null {
  try {
    return new Plant({ ...vehicle, memory: true }, axleLoad) && null;
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    return `Here no wheel can stand: ${error.message}.`;
  }
}

/** Begin at standstill without a torque, and let one come slowly. */
function stand(app: App): void {
  app.control.mode = "torque";
  app.control.drive_torque = 0;
  const vehicle = { ...app.settings.vehicle, memory: true };
  Object.assign(app.settings, { vehicle, speed: 0, playback: 0.02 });
  app.restart();
  const { torque } = app.shown.largest;
  app.control.drive_torque = YIELDING * torque;
  app.control.torque_rate = (YIELDING * torque) / RISE;
}

const lasts = ({ settings: { patch }, run }: App): string => duration(patch.length / run.now.speed);

export const STORIES: Story[] = [
  {
    name: "Slip-away",
    cannot: noFold,
    steps: [
      step("peak_passed", "The torque rises slowly. Up to the fold the creepage follows it: each torque " +
        "has its own steady creepage.", (app) => {
        rest(app, 0.93, 1);
        ramp(app, 1.03, 0.008);
      }),
      step(2.5, (app) => `At ${kilo(app.run.now.drive_torque)} it passes the fold: from here on more creepage ` +
        "means less force, and nothing holds the wheel back."),
      step(Infinity, (app) => `It has slipped away. The fold is at ${kilo(critical(app).drive_torque)}; a ` +
        "little less torque does not bring it back: see Hysteresis."),
    ],
  },
  {
    name: "Hysteresis",
    cannot: (app) => noFold(app) ?? noLanding(app),
    steps: [
      step("slip_away", "Past the fold the wheel slips away to the far branch, where the drive's own " +
        "damping holds it.", (app) => {
        rest(app, 0.985, 2);
        ramp(app, OVER, 0.01);
      }),
      step(6, "There it stays, at many times the creepage of the fold, until the torque changes."),
      step("returned", (app) => `Now the torque falls. The wheel slipped away at ` +
        `${kilo(critical(app).drive_torque)}, but it does not re-adhere there.`, (app) => {
        app.settings.playback = 5;
        ramp(app, (0.95 * critical(app).return_torque) / critical(app).drive_torque, 0.005);
      }),
      step(Infinity, (app) => `It grips again at ${kilo(app.run.now.drive_torque)}, and in a slower ramp at ` +
        `${kilo(critical(app).return_torque)}: the loop in between is hysteresis.`,
        (app) => (app.control.drive_torque = app.run.now.drive_torque)),
    ],
  },
  {
    name: "Kick it",
    cannot: noFold,
    steps: [
      step(0.06, (app) => "At 95 % of the critical torque the wheel rests at " +
        `${percent(app.run.now.creepage)}. The border of its grip is at ${percent(border(app))}.`,
        (app) => rest(app, 0.95, 0.02)),
      step(0.15, "A kick that ends short of the border: it re-adheres.",
        (app) => app.run.kick(0.85 * border(app) - app.run.now.creepage)),
      step((app) => app.run.now.creepage > 2 * border(app),
        "A kick that ends just beyond it: the same torque now carries the wheel away.",
        (app) => app.run.kick(1.1 * border(app) - app.run.now.creepage)),
      slower(0.1, "Same torque, same rail: only the creepage at the start was different."),
    ],
  },
  {
    name: "Wet patch",
    cannot: (app) => noFold(app) ?? noClearing(app),
    steps: [
      step(0.004, (app) => `A wet patch is coming, with ${digits(app.settings.patch.friction, 2)} times the ` +
        "friction. On it the wheel speeds up; what counts is whether it crosses the border before the end.",
        restBeforePatch),
      step(0.11, (app) => `This one lasts ${lasts(app)}, nine tenths of the critical clearing time: the ` +
        "wheel re-adheres.", (app) => patchStory(app, 0.9)),
      step((app) => !app.run.motion.onPatch && app.run.now.creepage > 1.15 * border(app),
        (app) => `This one lasts ${lasts(app)}, eleven tenths: it crosses the border, and good friction ` +
          "does not bring it back.", (app) => {
          restBeforePatch(app);
          patchStory(app, 1.1);
        }),
      slower(0.2, "A fifth of the critical clearing time lies between grip and slip-away."),
    ],
  },
  {
    name: "Hold it",
    cannot: noFold,
    steps: [
      step(0.6, "Creep control sets the torque so that the creepage follows its reference.", (app) => {
        const { control, shown, run } = app, { creepage } = critical(app);
        const { minimum_gain: needed } = shown.plant.at(1.2 * creepage, run.now.speed);
        creepMode(app);
        control.delay = 0;
        control.creepage = 0.75 * creepage;
        control.proportional_gain = Math.max(control.proportional_gain, 2 * needed);
        app.settings.playback = 0.5;
        app.restart();
      }),
      step(2.5, "The reference moves over the peak and down the falling branch. The wheel stays " +
        "with it, where no constant torque could keep it.",
        (app) => (app.control.creepage = 1.45 * critical(app).creepage)),
      step(Infinity, ({ shown, run: { now } }) => `Held at ${percent(now.creepage)}. Without control a small ` +
        `change would double every ${duration(Math.LN2 / shown.plant.at(now.creepage, now.speed).pole)}.`),
    ],
  },
  {
    name: "Too late",
    cannot: noFold,
    steps: [
      step(0.12, (app) => "Creep control on the falling branch, with a measurement that is " +
        `${duration(app.control.delay)} old: it holds.`, (app) => {
        const { control, shown, run } = app;
        creepMode(app);
        control.creepage = 1.2 * critical(app).creepage;
        control.proportional_gain = (1.85 * poleThere(app)) / shown.plant.gain(run.now.speed);
        late(app, 0.12);
        app.settings.playback = 0.05;
        app.restart();
      }),
      step(0.3, (app) => `${duration(app.control.delay)} old, and nudged: it still holds, but rings.`, (app) => {
        late(app, 0.55);
        app.run.kick(0.02 * app.control.creepage);
      }),
      step(0.6, (app) => `${duration(app.control.delay)} old: the same gain now makes every swing larger ` +
        "than the last.", (app) => late(app, 0.85)),
      step(Infinity, (app) => `With a measurement older than ${duration(1 / poleThere(app))}, one over the ` +
        "pole, no gain at all would hold it."),
    ],
  },
  {
    name: "Spring",
    cannot: noMemory,
    steps: [
      step(0.1, ({ control, shown: { plant } }) => {
        const { stiffness } = plant.spring(), force = control.drive_torque / plant.vehicle.radius;
        return `This wheel stands and does not slip: under ${kilo(control.drive_torque, 3)} its rim moves ` +
          `by ${digits((1e6 * force) / stiffness, 2)} \u00b5m, as on a spring of ` +
          `${digits(1e-9 * stiffness)} kN/\u2060\u00b5m.`;
      }, stand),
      step(Infinity, ({ shown: { plant } }) => "The torque is gone: the wheel swings back, and goes on about " +
        `its place at ${digits(plant.spring().frequency)}\u00a0Hz, as its inertia must on that spring.`, (app) => {
        app.control.torque_rate = app.control.drive_torque / LEAVE;
        app.control.drive_torque = 0;
      }),
    ],
  },
];
