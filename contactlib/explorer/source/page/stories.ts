/* Guided experiments: each puts the wheel somewhere, does something to it and says what to see. */

import { clearing } from "../physics/clearing";
import type { RunEvent } from "../physics/run";
import { steadyStates } from "../physics/stability";
import type { App } from "./app";
import { digits, duration, percent } from "./format";

/** One thing that is done, what is said meanwhile, and when it is over. */
interface Step {
  say(app: App): string;
  begin?(app: App): void;
  /** Over when this is true, or after so many simulated seconds. */
  until: RunEvent["name"] | number;
}

export interface Story {
  name: string;
  steps: Step[];
}

/** Torque of the fold [N.m]; of a law that does not fall, the largest that is shown. */
const critical = (app: App): number => {
  const { fold, dry } = app.shown;
  return fold?.drive_torque ?? Math.max(...dry.torque);
};

const kilo = (torque: number, significant = 4): string => `${digits(1e-3 * torque, significant)} kN m`;

/** Constant torque, a part of the critical one, at rest there. */
function rest(app: App, part: number, playback: number): void {
  app.control.mode = "torque";
  app.control.drive_torque = part * critical(app);
  app.settings.playback = playback;
  app.restart();
}

function ramp(app: App, part: number, rate: number): void {
  app.control.drive_torque = part * critical(app);
  app.control.torque_rate = rate * critical(app);
}

function border(app: App): number {
  const states = steadyStates(app.shown.plant, app.control.drive_torque, app.run.speed);
  return states.find((state) => !state.stable)?.creepage ?? app.shown.far;
}

function patchStory(app: App, part: number): void {
  const { plant } = app.shown;
  const found = clearing(plant, app.control.drive_torque, app.run.speed, app.settings.patch.friction);
  if (found !== null && Number.isFinite(found.time)) {
    app.settings.patch.length = part * found.distance;
  }
  app.layPatch();
}

export const STORIES: Story[] = [
  {
    name: "Run away",
    steps: [
      {
        begin: (app) => {
          rest(app, 0.93, 1);
          ramp(app, 1.03, 0.008);
        },
        say: () => "The torque rises slowly. Up to the fold the creepage follows it, and every " +
          "torque has its creepage.",
        until: "peak_passed",
      },
      {
        say: (app) => `At ${kilo(app.run.driveTorque)} it passes the fold: from here on more creepage ` +
          "means less force, and nothing holds the wheel back.",
        until: 2.5,
      },
      {
        say: (app) => `It has run away. The fold is at ${kilo(critical(app))}; a little less torque ` +
          "does not bring it back: see Hysteresis.",
        until: Infinity,
      },
    ],
  },
  {
    name: "Hysteresis",
    steps: [
      {
        begin: (app) => {
          rest(app, 0.985, 2);
          ramp(app, 1.015, 0.01);
        },
        say: () => "Past the fold the wheel runs away to the far branch, where the drive's own " +
          "damping holds it.",
        until: "slip_away",
      },
      { say: () => "There it would stay, at several hundred per cent of creepage.", until: 6 },
      {
        begin: (app) => {
          app.settings.playback = 5;
          ramp(app, 0.8, 0.005);
        },
        say: (app) => `Now the torque falls. At ${kilo(critical(app))} it had gone; it does not come ` +
          "back there.",
        until: "returned",
      },
      {
        begin: (app) => {
          app.control.drive_torque = app.run.driveTorque;
        },
        say: (app) => `It grips again at ${kilo(app.run.driveTorque)}. Slowly enough, it would at ` +
          `${kilo(app.shown.fold?.return_torque ?? NaN)}: the loop between is hysteresis.`,
        until: Infinity,
      },
    ],
  },
  {
    name: "Kick it",
    steps: [
      {
        begin: (app) => rest(app, 0.95, 0.02),
        say: (app) => `At 95 % of the critical torque the wheel rests at ${percent(app.run.creepage)}. ` +
          `The border of its grip is at ${percent(border(app))}.`,
        until: 0.06,
      },
      {
        begin: (app) => app.run.kick(0.85 * border(app) - app.run.creepage),
        say: () => "A kick to short of the border: it comes back.",
        until: 0.15,
      },
      {
        begin: (app) => app.run.kick(1.1 * border(app) - app.run.creepage),
        say: () => "A kick to just beyond it: the same torque now carries the wheel away.",
        until: "slip_away",
      },
      { say: () => "Same torque, same rail. Only where it started was another.", until: Infinity },
    ],
  },
  {
    name: "Wet patch",
    steps: [
      {
        begin: (app) => rest(app, 0.9, 0.01),
        say: (app) => `A wet patch is coming, friction times ${digits(app.settings.patch.friction, 2)}. ` +
          "On it the wheel speeds up; what counts is whether it crosses the border before the end.",
        until: 0.004,
      },
      {
        begin: (app) => patchStory(app, 0.9),
        say: (app) => `This one lasts ${duration(app.settings.patch.length / app.run.speed)}, nine tenths of the ` +
          "critical clearing time: the wheel comes back.",
        until: 0.11,
      },
      {
        begin: (app) => {
          rest(app, 0.9, 0.01);
          patchStory(app, 1.1);
        },
        say: (app) => `And ${duration(app.settings.patch.length / app.run.speed)}, eleven tenths: it crosses the ` +
          "border, and good friction does not bring it back.",
        until: "slip_away",
      },
      { say: () => "A few milliseconds decide between grip and run-away.", until: Infinity },
    ],
  },
  {
    name: "Hold it",
    steps: [
      {
        begin: (app) => {
          const { control } = app;
          control.mode = "creep";
          control.delay = 0;
          control.creepage = 0.75 * (app.shown.fold?.creepage ?? app.shown.far);
          app.settings.playback = 0.5;
          app.restart();
        },
        say: () => "Creep control sets the torque so that the creepage keeps to its reference.",
        until: 0.6,
      },
      {
        begin: (app) => {
          app.control.creepage = 1.45 * (app.shown.fold?.creepage ?? 0.4 * app.shown.far);
        },
        say: () => "The reference moves over the peak and down the falling branch. The wheel stays " +
          "with it, where no constant torque could keep it.",
        until: 2.5,
      },
      {
        say: (app) => {
          const pole = app.shown.plant.pole(app.run.creepage, app.run.speed);
          return `Held at ${percent(app.run.creepage)}. Without control a small change would grow ` +
            `${digits(Math.exp(Math.min(0.1 * pole, 40)), 2)} times in a tenth of a second.`;
        },
        until: Infinity,
      },
    ],
  },
  {
    name: "Too late",
    steps: [
      {
        begin: (app) => {
          const { control } = app;
          control.mode = "creep";
          control.delay = 2e-3;
          control.creepage = 1.2 * (app.shown.fold?.creepage ?? 0.3 * app.shown.far);
          app.settings.playback = 0.05;
          app.restart();
        },
        say: () => "Creep control on the falling branch, its measurement 2 ms old. It holds.",
        until: 0.12,
      },
      {
        begin: (app) => {
          app.control.delay = 9e-3;
          app.run.kick(0.02 * app.control.creepage);
        },
        say: () => "9 ms old, and nudged: it still holds, but rings.",
        until: 0.3,
      },
      {
        begin: (app) => {
          app.control.delay = 13e-3;
        },
        say: () => "13 ms old: the same gain now makes every swing larger than the last.",
        until: 0.6,
      },
      {
        say: () => "Beyond one over the pole no gain at all would hold it.",
        until: Infinity,
      },
    ],
  },
];

/** A story as it is told. */
export class Telling {
  private step = -1;
  private since = 0;

  constructor(private readonly app: App, readonly story: Story) {
    this.next();
  }

  /** Go on if the step is over; told of what happened since the last frame. */
  frame(events: RunEvent[]): void {
    const { until } = this.story.steps[this.step] as Step;
    const over = typeof until === "number"
      ? this.app.run.time - this.since >= until
      : events.some((event) => event.name === until);
    if (over) this.next();
  }

  private next(): void {
    const step = this.story.steps[++this.step];
    if (step === undefined) return;
    step.begin?.(this.app);
    this.since = this.app.run.time;
    this.app.say(step.say(this.app));
  }
}
