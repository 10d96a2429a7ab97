/* The wheelset that runs, its settings, the guided experiment, and what the charts show of it. */

import type { Settings } from "../files/settings";
import { clearing } from "../physics/clearing";
import { Plant, type Point } from "../physics/plant";
import type { RunEvent } from "../physics/recorder";
import { type Control, Run, SAMPLE } from "../physics/run";
import { isStable } from "../physics/stability";
import type { View } from "./chart";
import { find, toast, write } from "./elements";
import { digits, percent } from "./format";
import { clearingText, numbers, showNumbers, startText, stopText, warnings } from "./numbers";
import { axes, type Moment, type Picture, picture, type Reach, TRAILED } from "./picture";

const WELCOME = "Press Play and drag the torque up slowly, past the fold, or choose an experiment.";
const LOOK_BACK = 8; // visitor's time that the charts show [s]
const ROWS = 1500; // rows of the history in that time
const LONGEST_FRAME = 0.05; // of the visitor's time: a page that was hidden does not catch up [s]
const AHEAD = 0.3; // of the visitor's time, until the wheel meets a patch ahead [s]
const OFTEN = 100, SELDOM = 300; // between updates of curves and numbers, and of texts [ms]
const MOVED = 2e-3; // relative change of the speed after which the curves are drawn again [1]

/** One step of a guided experiment. */
export interface Step {
  /** What the page shows during the step. */
  text(app: App): string;
  begin?(app: App): void;
  /** It ends after so many simulated seconds, at an event, or when this is true. */
  until: number | RunEvent["name"] | ((app: App) => boolean);
}

/** A guided experiment. */
export interface Story {
  name: string;
  /** Why this wheel cannot show it, in one line; null if it can. */
  cannot(app: App): string | null;
  steps: Step[];
}

/** What the app needs of the page. */
interface Stage {
  views: View[];
  /** Controls may show other values than before. */
  changed(): void;
  /** The speed of a free wheelset has gone on. */
  moved(): void;
}

/** Show the text of an experiment. */
const showText = (text: string): void => write(find("story"), text || WELCOME);

export class App {
  readonly run: Run;
  shown: Picture;
  /** Whether the run goes on; it begins when the visitor starts it. */
  playing = false;
  /** What a kick adds to the creepage [1]. */
  kickSize = 0.01;

  /** The experiment that runs. */
  story: Story | null = null;
  private step = 0; // of the story
  private since = 0; // simulated time at which the step began [s]
  private before: Settings | null = null; // the visitor's, before the story
  private rests: Point[] = [];
  private reach: Reach = { border: 0, upper: 0, wheel: 0 };
  private stale = true; // the charts are out of date
  private unshown = true; // the charts do not have the curves yet
  private last = 0; // time of the last frame [ms]
  private looked = 0; // ... at which curves and numbers ...
  private lookedSeldom = 0; // ... and texts were last updated

  constructor(public settings: Settings, private readonly stage: Stage) {
    this.run = new Run();
    this.shown = this.newPicture(settings.speed);
    this.use(settings);
  }

  /** The control that runs; its fields may be written at any time. */
  get control(): Control {
    return this.run.control;
  }

  /** Take other settings and begin again. If they cannot run, nothing changes and the error is
   * thrown. */
  use(settings: Settings): void {
    this.endStory();
    const before = { ...this.settings, control: { ...this.control } };
    try {
      this.take(settings);
    } catch (error) {
      if (before.vehicle !== settings.vehicle) this.take(before);
      throw error;
    }
  }

  private take(settings: Settings): void {
    this.settings = settings;
    Object.assign(this.control, settings.control);
    settings.control = this.control;
    this.restart();
  }

  /** Begin again with the visitor's own settings, from before a story. */
  reset(): void {
    const { before } = this;
    this.endStory();
    if (before !== null) this.putBack(before);
    toast("");
    this.restart();
  }

  private putBack({ control, patch, playback, speed, vehicle: { memory } }: Settings): void {
    Object.assign(this.control, control);
    const vehicle = { ...this.settings.vehicle, memory };
    Object.assign(this.settings, { patch: { ...patch }, playback, speed, vehicle });
  }

  /** Begin again at rest, with the settings as they are. */
  restart(): void {
    const { vehicle, axleLoad, speed } = this.settings;
    this.reach = { border: 0, upper: 0, wheel: 0 };
    const next = this.newPicture(speed);
    try {
      this.run.start(vehicle, axleLoad, speed);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.control.mode = "torque";
      this.control.drive_torque = 0.9 * next.largest.torque;
      this.run.start(vehicle, axleLoad, speed);
      toast("No grip holds that torque: the run starts at nine tenths of the critical one.");
    }
    this.show(next);
    this.stage.changed();
  }

  /** Take other curves, for the charts and for the events of the run. */
  private show(next: Picture): void {
    this.shown = next;
    this.unshown = true;
    this.run.watch(next.fold?.creepage ?? null);
  }

  /** Change the vehicle, its load or the patch; the run goes on with them. An invalid change is
   * undone, and the error thrown. */
  change(change: () => void): void {
    const { vehicle, axleLoad, patch } = this.settings;
    Object.assign(this.settings, { vehicle: { ...vehicle }, patch: { ...patch } });
    try {
      change();
      const next = this.newPicture(this.run.now.speed);
      this.run.configure(this.settings.vehicle, this.settings.axleLoad);
      this.show(next);
    } catch (error) {
      Object.assign(this.settings, { vehicle, axleLoad, patch });
      throw error;
    }
    this.stage.changed();
  }

  setSpeed(speed: number): void {
    const next = this.newPicture(speed);
    this.run.setSpeed(speed);
    this.settings.speed = speed;
    this.show(next);
    this.stage.changed();
  }

  /** Put the wet patch of the settings on the rail, a moment ahead. */
  placePatch(): void {
    const { friction, length } = this.settings.patch, { speed } = this.run.now;
    this.predict(); // of this patch, not of one before
    this.run.placePatch(friction, length, AHEAD * this.settings.playback * speed);
    this.lookAgain();
  }

  kick(): void {
    this.run.kick(this.kickSize);
    this.lookAgain();
  }

  startStory(story: Story): void {
    const before = this.before ?? structuredClone({ ...this.settings, control: { ...this.control } });
    const another = this.story !== null;
    this.endStory();
    this.putBack(before); // no story starts from another's settings and state
    if (another) this.restart();
    const why = story.cannot(this);
    if (why === null) {
      this.before = before;
      this.story = story;
      this.playing = true;
      this.beginStep(0);
    } else showText(why);
    this.stage.changed();
  }

  private beginStep(number: number): void {
    const step = this.story!.steps[number];
    if (step === undefined) return;
    this.step = number;
    step.begin?.(this);
    this.since = this.run.now.time;
    showText(step.text(this));
    this.stage.changed();
  }

  /** Go on with the story if its step is over. */
  private goOn({ steps }: Story, events: RunEvent[]): void {
    const { until } = steps[this.step]!;
    const over = typeof until === "number" ? this.run.now.time - this.since >= until
      : typeof until === "function" ? until(this)
      : events.some((event) => event.name === until);
    if (over) this.beginStep(this.step + 1);
  }

  /** The visitor takes over, and keeps what the story has set. */
  endStory(): void {
    this.before = null;
    showText("");
    if (this.story === null) return;
    this.story = null;
    this.stage.changed();
  }

  /** The control has changed, and controls may show something else now. */
  changed(): void {
    this.lookAgain();
    this.stage.changed();
  }

  /** Pause, or go on from where the run is. */
  play(playing: boolean): void {
    const { run } = this;
    if (playing && run.stopped !== null) {
      const goesOn = run.goOn();
      if (!goesOn) this.restart();
      toast(goesOn ? "" : `The run ${startText(this.control)}, at ` +
        `${percent(run.now.creepage)} and ${digits(run.now.speed)} m/s.`);
    }
    this.playing = playing;
    this.changed();
  }

  /** Stop and show why: the run does not go on from a state that cannot be computed. */
  fail(error: unknown): void {
    this.playing = false;
    this.stale = false;
    toast(error instanceof Error ? error.message : String(error));
    this.stage.changed();
    if (!(error instanceof RangeError)) throw error;
  }

  /** Let the next frame update numbers and texts too: while the run is paused it is the last. */
  private lookAgain(): void {
    this.stale = true;
    this.looked = this.lookedSeldom = -Infinity;
  }

  /** Colours have changed. */
  repaint(): void {
    for (const view of this.stage.views) view.repaint();
    this.redraw();
  }

  /** Let the next frame draw, also while the run is paused. */
  redraw(): void {
    this.stale = true;
  }

  /** Go on by a simulated time [s]: frames do it, and scripts and tests may. */
  advance(duration: number): RunEvent[] {
    this.run.recordInterval = Math.max(SAMPLE, (LOOK_BACK * this.settings.playback) / ROWS);
    this.run.advance(duration);
    const events = this.run.takeEvents();
    if (this.story !== null) this.goOn(this.story, events);
    for (const event of events) this.report(event);
    if (this.run.stopped !== null && this.playing) {
      this.playing = false;
      this.endStory();
      this.lookAgain();
      toast(stopText(this));
      this.stage.changed();
    }
    this.stale = true;
    return events;
  }

  /** A frame at a time of the browser's clock [ms]. */
  frame(now: number): void {
    const passed = Math.min((now - this.last) / 1e3, LONGEST_FRAME);
    this.last = now;
    if (this.playing) this.advance(passed * this.settings.playback);
    if (this.stale || this.unshown) this.draw(now);
  }

  /** Friction of the patch on the rail or, without one, of the next patch. */
  private get wetFriction(): number {
    return this.run.motion.patch?.friction ?? this.settings.patch.friction;
  }

  /** Let the axes follow the border of grip, the upper state and the wheel. */
  private lookAround(): void {
    const { run, rests, shown } = this, since = run.now.time - TRAILED * LOOK_BACK * this.settings.playback;
    const wheel = run.history.window(since).creepage.reduce((a, b) => Math.max(a, b), run.now.creepage);
    const { border, upper } = run.motion.onPatch ? this.reach : { // which are soon those of before
      border: rests.find((state) => !isStable(state))?.creepage ?? 0,
      upper: rests.at(-1)?.creepage ?? 0,
    };
    this.reach = { border, upper, wheel };
    const next = axes(shown.base, this.reach), { far, horizon, highest } = shown.axes;
    if (next.far === far && next.horizon === horizon && next.highest === highest) return;
    this.show(this.newPicture(run.now.speed));
    if (next.far !== far) this.stage.changed();
  }

  private newPicture(speed: number): Picture {
    const { vehicle, axleLoad } = this.settings;
    const plant = new Plant(vehicle, axleLoad);
    return picture(plant, plant.rolls(speed), this.wetFriction, this.reach);
  }

  private draw(now: number): void {
    const { run, stage } = this;
    if (this.unshown) this.lookAgain();
    const often = now - this.looked > OFTEN, late = now - this.lookedSeldom > SELDOM;
    const speed = run.motion.plant.rolls(run.now.speed);
    const moved = Math.abs(speed / this.shown.speed - 1) > MOVED;
    const other = this.shown.wetFriction !== this.wetFriction;
    if (often) {
      this.looked = now;
      this.rests = this.shown.plant.steady(run.now.drive_torque, run.now.speed, run.now.friction);
      this.lookAround();
    }
    if (other || (moved && often)) this.show(this.newPicture(run.now.speed));
    if (this.unshown) for (const view of stage.views) view.show(this.shown);
    this.unshown = false;
    const moment: Moment = {
      run, control: this.control, shown: this.shown, rests: this.rests,
      span: LOOK_BACK * this.settings.playback,
    };
    for (const view of stage.views) view.draw(moment);
    if (often) {
      if (this.settings.vehicle.mass !== null) stage.moved();
      showNumbers(find("numbers"), numbers(moment));
      write(find("warning"), warnings(moment));
      write(find("clock"), `t = ${digits(run.now.time, run.now.time < 0.1 ? 2 : 4)} s`);
    }
    if (late && !often) { // texts cost time, so that they come in a frame of their own
      this.lookedSeldom = now;
      for (const view of stage.views) view.place.setAttribute("aria-label", view.describe(moment));
      this.predict();
    }
    this.stale = often && late;
  }

  /** Show what a wet patch would do to the wheel now. */
  private predict(): void {
    const { run, settings, control } = this, { plant } = this.shown;
    if (run.motion.stands) {
      write(find("clearing"), "A wheel that stands leaves no patch.");
      return;
    }
    if (control.mode === "creep") {
      write(find("clearing"), "Under creep control the torque follows the patch: try it.");
      return;
    }
    if (run.motion.patch !== null) return; // the prediction stands until the patch is past
    const clears = clearing(plant, run.now.drive_torque, run.now.speed, settings.patch.friction);
    const away = clears !== null && run.now.creepage > clears.border;
    write(find("clearing"), away ? "The wheel is already beyond the border of its grip."
      : clearingText(clears, settings.patch.length));
  }

  private report({ name, drive_torque, creepage }: RunEvent): void {
    const torque = `${digits(1e-3 * drive_torque, 4)} kN m`;
    find("spoken").textContent = {
      peak_passed: `Past the fold at ${torque}`,
      slip_away: `Slip-away: creepage ${percent(creepage)}`,
      returned: `Grip again at ${torque}`,
      patch_begins: "On the wet patch",
      patch_ends: "Past the wet patch",
    }[name];
  }
}
