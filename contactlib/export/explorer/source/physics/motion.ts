/** The wheelset on its rail: state, parameters and wet patch in the kernel's drivetrain. */
import { type Drivetrain, kernel } from "../kernel/kernel";
import { Plant } from "./plant";
import type { Moment, Row, RunEvent } from "./recorder";
import type { Vehicle } from "./vehicle";

/** Rim speed at which a run stops [m/s]. */
export const FASTEST_RIM = 120;

const BEYOND = 12; // rim speed that a run gains beyond its limits when it is let go on [m/s]

const TOLERANCE = 1e-8; // of each of the integrator's substeps, relative [1]

/** A wet stretch of the rail [m], and the factor on friction there [1]; the rest is dry. */
export interface Patch {
  begins: number;
  ends: number;
  friction: number;
}

export class Motion {
  readonly drivetrain: Drivetrain = kernel.drivetrain();
  patch: Patch | null = null;
  plant!: Plant; // on the dry rail
  private rims: [number, number] = [0, FASTEST_RIM]; // between which time goes on [m/s]

  /** Take these parameters and this load [N]; the state stays. */
  configure(vehicle: Vehicle, normalLoad: number): void {
    this.plant = new Plant({ ...vehicle }, normalLoad);
    const { table, contact, body } = this.plant;
    this.drivetrain.configure(table, contact, {
      ...body, axle_stiffness: 0, axle_damping: 0, drive_share: 0.5, motor_lag: 0, // a rigid axle
    });
    const { input } = this.drivetrain;
    input.resistance_force = 0;
    input.acceleration = 0; // where the speed is held
    input.load_left = input.load_right = 0.5 * normalLoad;
    input.slope = 1;
  }

  /** Put it at the rail's beginning, with no work done. */
  start(speed: number, creepage: number): void {
    const { state } = this.drivetrain;
    for (const name of Object.keys(state) as (keyof typeof state)[]) state[name] = 0;
    this.layPatch(null);
    this.rims = [0, FASTEST_RIM];
    this.turn(speed, creepage);
  }

  /** Move the limits of the rim speed, so that a wheel at one of them goes on from where it is. */
  goBeyond(): void {
    this.rims = [Math.min(0, this.rim - BEYOND), Math.max(FASTEST_RIM, this.rim + BEYOND)];
  }

  /** Speed of the rim [m/s]. */
  private get rim(): number {
    return this.drivetrain.state.omega_left * this.plant.vehicle.radius;
  }

  /** Set the speed [m/s], and turn the wheels so that they have a creepage. */
  turn(speed: number, creepage: number): void {
    const { state } = this.drivetrain;
    state.speed = speed;
    state.omega_left = state.omega_right = ((1 + creepage) * speed) / this.plant.vehicle.radius;
  }

  /** Lay a patch in place of one that is there, or take it away. */
  layPatch(patch: Patch | null): void {
    this.patch = patch;
    if (patch === null) return this.drivetrain.setTrack(null);
    const { begins, ends, friction } = patch;
    this.drivetrain.setTrack({ at: [begins, begins, ends, ends], value: [1, friction, friction, 1] });
  }

  /** Whether the wheels are on the patch. */
  get onPatch(): boolean {
    const { distance } = this.drivetrain.state;
    return this.patch !== null && distance >= this.patch.begins && distance < this.patch.ends;
  }

  /** Step from a time on [s] under a torque [N.m]; returns which ends of the patch were passed. */
  advance(time: number, step: number, torque: number): RunEvent["name"][] {
    const { input, state } = this.drivetrain, from = state.distance;
    input.commanded_torque = torque;
    this.drivetrain.advance(time, step, TOLERANCE);
    const passed: RunEvent["name"][] = [];
    if (this.patch !== null) {
      const { begins, ends } = this.patch, to = state.distance;
      if (from < begins && to >= begins) passed.push("patch_begins");
      if (from < ends && to >= ends) {
        passed.push("patch_ends");
        this.layPatch(null);
      }
    }
    return passed;
  }

  /** The state at a time [s] under a torque [N.m]. */
  moment(time: number, drive_torque: number): Moment {
    const { input, state: { speed } } = this.drivetrain;
    const friction = this.onPatch ? this.patch!.friction : 1;
    input.friction_left = input.friction_right = friction; // a step leaves that of its start
    return { time, speed, creepage: this.drivetrain.output().creepage_left, friction, drive_torque };
  }

  /** Row of a moment under the present parameters. */
  rowOf({ time, speed, creepage, friction, drive_torque }: Moment): Row {
    const { force, torque } = this.plant.at(creepage, speed, friction);
    const creepage_rate = this.plant.gain(speed) * (drive_torque - torque);
    return { time, creepage, drive_torque, creep_force: force, speed, friction, creepage_rate };
  }

  /** Why it cannot go on, in one line, or null. */
  limit(): string | null {
    const { minimum_speed } = this.plant.vehicle, { speed } = this.drivetrain.state;
    const { rim, rims: [slowest, fastest] } = this, runs = `the rim runs at ${rim.toFixed(1)} m/s`;
    if (!(rim <= fastest)) return `${runs}, above the limit of ${fastest.toFixed(0)} m/s`;
    if (!(rim > slowest)) return `${runs}, below the limit of ${slowest.toFixed(0)} m/s`;
    if (speed < minimum_speed) {
      return `the speed is ${speed.toFixed(3)} m/s, below the minimum of ${minimum_speed} m/s`;
    }
    return null;
  }
}
