/**
 * A live run of one wheelset: rigid axle, both wheels alike, through the kernel's drivetrain.
 *
 * The equations of motion, their integration and the forces are the kernel's. What is here are the
 * torque of each sample, the patch on the rail, the record of it all, and when to stop.
 */
import type { Drivetrain, Kernel, Table } from "../kernel/kernel";
import type { ForceElementParameters, WheelsetParameters } from "../kernel/structs";
import { checkControl, type Control, inRange, SAMPLE, TorqueSource } from "./control";
import type { History } from "./history";
import { Plant } from "./plant";
import { type Patch, Rail } from "./rail";
import { Recorder } from "./recorder";
import { steadyStates } from "./stability";
import {
  drivetrainParameters,
  forceParameters,
  saturationCreepage,
  type Vehicle,
  wheelsetParameters,
} from "./vehicle";
import { type RunEvent, Watch } from "./watch";

export { type Control, SAMPLE } from "./control";
export type { Patch } from "./rail";
export type { RunEvent } from "./watch";

/** Rim speed beyond which the run ends: no drive goes that fast [m/s]. */
export const FASTEST_RIM = 120;

const ROWS = 1 << 15; // of the history
const TOLERANCE = 1e-7; // of each of the integrator's substeps, relative [1]

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
  /** The kernel's drivetrain, with the works that were done since the start. */
  readonly drivetrain: Drivetrain;

  private readonly source = new TorqueSource();
  private readonly watcher = new Watch();
  private readonly rail = new Rail();
  private readonly recorder = new Recorder(ROWS);
  private vehicle!: Vehicle;
  private plant!: Plant; // on the dry rail
  private table!: Table;
  private contact!: ForceElementParameters;
  private body!: WheelsetParameters;
  private fold: number | null = null;
  private away: number | null = null;
  private samples = 0;
  private carried = 0; // time asked for that makes no whole sample yet [s]
  private ended: string | null = null;
  private events: RunEvent[] = [];

  constructor(private readonly kernel: Kernel) {
    this.drivetrain = kernel.drivetrain();
  }

  /**
   * Begin anew at a speed [m/s] under a load [N]: at the stable steady state of least creepage
   * under the torque asked for, or at the creepage asked for in creep mode.
   */
  start(vehicle: Vehicle, normalLoad: number, speed: number): void {
    checkControl(this.control);
    inRange("speed", speed, vehicle.minimum_speed);
    this.set(vehicle, normalLoad);
    const { control, drivetrain, plant } = this;
    const creeping = control.mode === "creep";
    const creepage = creeping ? control.creepage : this.stableCreepage(speed);
    const torque = creeping
      ? Math.min(Math.max(plant.torque(creepage, speed), 0), control.torque_max)
      : control.drive_torque;

    for (const name of Object.keys(drivetrain.state) as (keyof typeof drivetrain.state)[]) {
      drivetrain.state[name] = 0;
    }
    drivetrain.state.speed = speed;
    this.turn(creepage);
    this.source.start(control, creepage, torque);
    this.rail.patch = null;
    drivetrain.setTrack(null);
    this.samples = this.carried = 0;
    this.ended = null;
    this.events = [];
    this.recorder.clear();
    this.observe();
    this.recorder.keepIfDue(0);
    this.watch(this.fold, this.away);
  }

  /** Change parameters while it runs; speeds and torque stay. */
  configure(vehicle: Vehicle, normalLoad: number): void {
    this.set(vehicle, normalLoad);
    this.jump();
    this.watch(this.fold, this.away);
  }

  /**
   * Name the creepages of the fold (null: there is none) and of slip-away (null: ten times that of
   * saturation) [1], for the events.
   */
  watch(foldCreepage: number | null, slipAwayCreepage: number | null = null): void {
    this.fold = foldCreepage;
    this.away = slipAwayCreepage;
    const away = slipAwayCreepage ?? 10 * saturationCreepage(this.vehicle);
    this.watcher.set(foldCreepage ?? Infinity, away, this.creepage);
  }

  /** Go on for a time [s], in whole samples; the next call makes up for what is left over. */
  advance(duration: number): void {
    inRange("duration", duration, 0);
    checkControl(this.control);
    this.carried += duration;
    const samples = Math.floor(this.carried / SAMPLE + 1e-6);
    this.carried -= samples * SAMPLE;
    for (let i = 0; i < samples && this.ended === null; i++) this.sample();
  }

  /** Add to the creepage at once [1]. */
  kick(creepage: number): void {
    inRange("creepage", creepage);
    this.turn(this.creepage + creepage);
    this.jump();
  }

  /** Set the speed [m/s]; the creepage stays. */
  setSpeed(speed: number): void {
    inRange("speed", speed, this.vehicle.minimum_speed);
    this.drivetrain.state.speed = speed;
    this.turn(this.creepage);
    this.jump();
  }

  /**
   * Lay a patch on the rail that multiplies friction by a factor [1]: its length and the way to it
   * [m]. It takes the place of one that is there.
   */
  layPatch(friction: number, length: number, ahead: number): void {
    inRange("friction", friction, 1e-3, 1e3);
    inRange("length", length, 1e-6);
    inRange("ahead", ahead, 0);
    const wasWet = this.onPatch;
    const begins = this.drivetrain.state.distance + ahead;
    this.rail.patch = { begins, ends: begins + length, friction };
    this.drivetrain.setTrack(this.rail.track);
    if (!wasWet && !this.onPatch) return;
    this.jump();
    if (wasWet) this.tell("patch_ends");
    if (this.onPatch) this.tell("patch_begins");
  }

  /** What happened since the last call. */
  takeEvents(): RunEvent[] {
    const { events } = this;
    this.events = [];
    return events;
  }

  /** Simulated time between rows of the history [s]; a jump has a row on either side. */
  get recordInterval(): number {
    return this.recorder.interval;
  }
  set recordInterval(interval: number) {
    inRange("recordInterval", interval, SAMPLE);
    this.recorder.interval = interval;
  }
  get history(): History {
    return this.recorder.history;
  }
  /** Simulated time since the start [s]. */
  get time(): number {
    return this.recorder.now.time;
  }
  /** [m/s] */
  get speed(): number {
    return this.recorder.now.speed;
  }
  /** [rad/s] */
  get omega(): number {
    return this.drivetrain.state.omega_left;
  }
  /** [1] */
  get creepage(): number {
    return this.recorder.now.creepage;
  }
  /** Of both wheels [N]. */
  get creepForce(): number {
    return this.recorder.now.creep_force;
  }
  /** [N.m] */
  get driveTorque(): number {
    return this.recorder.now.drive_torque;
  }
  /** [1/s] */
  get creepageRate(): number {
    return this.recorder.now.creepage_rate;
  }
  /** Factor on the rail's friction [1]. */
  get friction(): number {
    return this.recorder.now.friction;
  }
  /** The creepage that creep control holds to now, on its way to the one asked for [1]. */
  get reference(): number {
    return this.source.reference;
  }
  /** Whether the wheels are on the patch. */
  get onPatch(): boolean {
    return this.rail.isWet(this.drivetrain.state.distance);
  }
  /** The patch that lies ahead of the wheels or under them. */
  get patch(): Patch | null {
    return this.rail.patch;
  }
  /** Why the run ended, in one line; null while it goes on. */
  get stopped(): string | null {
    return this.ended;
  }

  private set(vehicle: Vehicle, normalLoad: number): void {
    this.vehicle = { ...vehicle };
    this.plant = new Plant(this.kernel, this.vehicle, normalLoad);
    this.table = this.kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
    this.drivetrain.configure(this.table, this.contact, drivetrainParameters(vehicle));
    const { input } = this.drivetrain;
    input.resistance_force = 0;
    input.acceleration = 0; // where the speed is held
    input.load_left = input.load_right = 0.5 * normalLoad;
  }

  private stableCreepage(speed: number): number {
    const torque = this.control.drive_torque;
    const state = steadyStates(this.plant, torque, speed).find(({ stable }) => stable);
    if (state !== undefined) return state.creepage;
    throw new RangeError(
      `control.drive_torque = ${torque} is out of range: no stable creepage has it at ${speed} m/s`,
    );
  }

  /** Turn the wheels as a creepage at this speed asks for. */
  private turn(creepage: number): void {
    const { state } = this.drivetrain;
    state.omega_left = state.omega_right = ((1 + creepage) * state.speed) / this.vehicle.radius;
  }

  private sample(): void {
    const { drivetrain, rail, recorder } = this;
    const { distance, speed } = drivetrain.state;
    drivetrain.input.commanded_torque = this.source.sample(
      this.control,
      this.creepage,
      saturationCreepage(this.vehicle),
      (creepage) => this.plant.torque(creepage, speed),
    );
    try {
      drivetrain.advance(this.samples * SAMPLE, SAMPLE, TOLERANCE);
    } catch (error) {
      this.ended = error instanceof Error ? error.message : String(error);
      return;
    }
    this.samples++;
    this.observe();
    const passed = rail.passed(distance, drivetrain.state.distance);
    if (passed.includes("patch_ends")) {
      rail.patch = null;
      drivetrain.setTrack(null);
    }
    const happened = [...passed, ...this.watcher.next(this.creepage)];
    for (const name of happened) this.tell(name);
    this.ended = this.limit();
    if (happened.length > 0 || this.ended !== null) recorder.keepBoth();
    else recorder.keepIfDue(0.5 * SAMPLE);
  }

  /** Take a row of the moment. */
  private observe(): void {
    const { state, input } = this.drivetrain;
    const { omega_left: omega, speed } = state;
    const friction = this.rail.friction(state.distance);
    input.friction_left = input.friction_right = friction;
    const contact = this.kernel.force(this.table, this.contact, {
      omega,
      speed,
      normal_load: this.plant.normalLoad,
      friction_scale: friction,
      relaxed_creepage: 0,
    });
    const { torque } = this.source;
    const rates = this.kernel.motion(this.body, omega, speed, torque, 0, contact);
    const row = this.recorder.next();
    row.time = this.samples * SAMPLE;
    row.creepage = contact.creepage;
    row.drive_torque = torque;
    row.creep_force = contact.creep_force;
    row.speed = speed;
    row.friction = friction;
    row.creepage_rate =
      contact.creepage_by_omega * rates.omega_rate + contact.creepage_by_speed * rates.speed_rate;
  }

  /** Something was changed at once: keep the row before and the one after. */
  private jump(): void {
    this.observe();
    this.recorder.keepBoth();
  }

  private tell(name: RunEvent["name"]): void {
    const { time, creepage, drive_torque } = this.recorder.now;
    this.events.push({ name, time, creepage, drive_torque });
  }

  /** Why it cannot go on from here, or null. */
  private limit(): string | null {
    const { minimum_speed, radius } = this.vehicle;
    const rim = this.omega * radius;
    if (!(rim <= FASTEST_RIM)) {
      return `the rim runs at ${rim.toFixed(1)} m/s, above the limit of ${FASTEST_RIM} m/s`;
    }
    if (!(rim > 0)) return `the wheel stands still at a speed of ${this.speed.toFixed(2)} m/s`;
    if (this.speed < minimum_speed) {
      return `the speed is ${this.speed.toFixed(3)} m/s, below the minimum of ${minimum_speed} m/s`;
    }
    return null;
  }
}
