/**
 * A live run of one wheelset with a rigid axle and two equal wheels. The kernel steps its equations;
 * here is the torque of each sample, what the user does meanwhile, the record, and when to stop.
 */
import { checkControl, type Control, SAMPLE, TorqueSource } from "./control";
import { demand } from "./limits";
import { Motion } from "./motion";
import { History, type Row, type RunEvent, Watch } from "./recorder";
import { checkSpeed, type Vehicle } from "./vehicle";

export { type Control, SAMPLE } from "./control";

const ROWS = 1 << 15; // of the history

export class Run {
  readonly control: Control = {
    mode: "torque",
    drive_torque: 0,
    torque_rate: 1e3,
    creepage: 0,
    proportional_gain: 0,
    integral_gain: 0,
    torque_max: 0,
    delay: 0,
  };

  /** Why the run ended, in one line; null while it goes on. */
  stopped: string | null = null;
  /** The present moment. */
  now!: Row;
  /** The wheelset and the patch on its rail. */
  readonly motion = new Motion();
  readonly history = new History(ROWS);
  /** Simulated time between rows of the history [s]; a jump has a row on either side. */
  recordInterval = 2e-3;

  private readonly source = new TorqueSource();
  private readonly watcher = new Watch();
  private kept: Row | null = null; // the last row of the history
  private fold: number | null = null;
  private samples = 0;
  private carried = 0; // time that is not simulated yet, less than a sample [s]
  private events: RunEvent[] = [];

  /**
   * Begin again at a speed [m/s] under a load [N]. In torque mode it begins with the grip that it has
   * under the torque demand, or rolls if the demand is less than rolling takes; in creep mode it begins
   * at the creepage demand. A wheel that stands begins with the force of that creepage.
   */
  start(vehicle: Vehicle, axleLoad: number, speed: number): void {
    const { control, motion } = this;
    checkControl(control);
    checkSpeed(vehicle, speed);
    motion.configure(vehicle, axleLoad);
    const creeping = control.mode === "creep";
    const creepage = creeping ? control.creepage : this.grip(speed);
    const torque = creeping
      ? Math.min(Math.max(motion.plant.torque(creepage, speed), 0), control.torque_max)
      : control.drive_torque;
    motion.start(speed, creepage);
    this.source.start(control, creepage, torque);
    this.samples = this.carried = 0;
    this.stopped = null;
    this.events = [];
    this.history.clear();
    this.keep((this.now = this.row()));
    this.watch(this.fold);
  }

  /** Change parameters while it runs; speeds and torque stay. */
  configure(vehicle: Vehicle, axleLoad: number): void {
    if (!vehicle.memory) checkSpeed(vehicle, this.now.speed); // with it, the wheel may swing back
    this.jump(() => this.motion.configure(vehicle, axleLoad));
    this.watch(this.fold);
  }

  /** Creepage of the fold [1] for the events; null without a fold. Slip-away is at ten zeta0. A wheel
   * that stands has no creepage, and none of these events. */
  watch(foldCreepage: number | null): void {
    this.fold = foldCreepage;
    const { stands, plant } = this.motion;
    const [fold, away] = stands ? [Infinity, Infinity] : [foldCreepage, 10 * plant.saturation];
    this.watcher.set(fold ?? Infinity, away, this.now.creepage);
  }

  /** Go on for a time [s], in whole samples; what is left over goes to the next call. */
  advance(duration: number): void {
    demand("duration", duration, { at_least: 0 });
    checkControl(this.control);
    this.carried += duration;
    const samples = Math.floor(this.carried / SAMPLE + 1e-6);
    this.carried -= samples * SAMPLE;
    for (let i = 0; i < samples && this.stopped === null; i++) this.sample();
  }

  /** Go on from the state in which the run stopped; returns whether it can. */
  goOn(): boolean {
    this.motion.goBeyond();
    this.stopped = this.motion.limit();
    return this.stopped === null;
  }

  /** Add to the creepage at once [1]. */
  kick(creepage: number): void {
    demand("creepage", creepage, {});
    this.jump(() => this.motion.turn(this.now.speed, this.now.creepage + creepage));
  }

  /** Set the speed [m/s]; the creepage stays. */
  setSpeed(speed: number): void {
    checkSpeed(this.motion.plant.vehicle, speed);
    this.jump(() => this.motion.turn(speed, this.now.creepage));
  }

  /** Place a patch on the rail in place of one that is there: the factor on its friction [1], its
   * length and the distance to it [m]. */
  placePatch(friction: number, length: number, ahead: number): void {
    demand("friction", friction, { at_least: 1e-3, at_most: 1e3 });
    demand("length", length, { at_least: 1e-6 });
    demand("ahead", ahead, { at_least: 0 });
    const { motion } = this, wasWet = motion.onPatch;
    const begins = motion.drivetrain.state.distance + ahead;
    const place = (): void => motion.placePatch({ begins, ends: begins + length, friction });
    if (wasWet || ahead === 0) this.jump(place);
    else place();
    if (wasWet) this.record("patch_ends");
    if (motion.onPatch) this.record("patch_begins");
  }

  /** Torque of the control at a creepage that is measured without delay [N.m]. */
  torqueAt(creepage: number): number {
    return this.source.answer(this.control, creepage);
  }

  /** What happened since the last call. */
  takeEvents(): RunEvent[] {
    const { events } = this;
    this.events = [];
    return events;
  }

  private grip(speed: number): number {
    const torque = this.control.drive_torque;
    const creepage = this.motion.plant.grip(torque, speed);
    if (creepage !== null) return creepage;
    throw new RangeError(
      `control.drive_torque = ${torque} is out of range: no grip holds it at ${speed} m/s`,
    );
  }

  private sample(): void {
    const { motion, now } = this, { plant } = motion;
    const torque = this.source.sample(
      this.control, now.creepage, plant.saturation, (at) => plant.torque(at, now.speed),
    );
    const happened: RunEvent["name"][] = [];
    try {
      happened.push(...motion.advance(this.samples * SAMPLE, SAMPLE, torque));
    } catch (error) {
      this.stopped = error instanceof Error ? error.message : String(error);
      return;
    }
    this.samples++;
    this.now = this.row();
    happened.push(...this.watcher.next(this.now.creepage));
    for (const name of happened) this.record(name);
    this.stopped = motion.limit();
    const since = this.now.time - (this.kept?.time ?? -Infinity);
    if (happened.length > 0 || this.stopped !== null) this.keep(now, this.now);
    else if (since >= this.recordInterval - 0.5 * SAMPLE) this.keep(this.now);
  }

  private row(): Row {
    return this.motion.row(this.samples * SAMPLE, this.source.torque);
  }

  /** Put rows into the history, unless the first of them is its last one. */
  private keep(...rows: Row[]): void {
    for (const row of rows) if (row !== this.kept) this.history.append((this.kept = row));
  }

  /** Change something at once, with a row before and one after. */
  private jump(change: () => void): void {
    const before = this.now;
    change();
    this.keep(before, (this.now = this.row()));
  }

  private record(name: RunEvent["name"]): void {
    const { time, creepage, drive_torque } = this.now;
    this.events.push({ name, time, creepage, drive_torque });
  }
}
