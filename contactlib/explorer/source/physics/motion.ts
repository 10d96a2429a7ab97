/** The wheelset on its rail: state, parameters and patch as the kernel's drivetrain has them. */
import type { Drivetrain, Kernel, Table } from "../kernel/kernel";
import type { ForceElementParameters, WheelsetParameters } from "../kernel/structs";
import type { Row } from "./history";
import { Plant } from "./plant";
import { Rail } from "./rail";
import type { Moment } from "./recorder";
import { drivetrainParameters, forceParameters, type Vehicle, wheelsetParameters } from "./vehicle";

/** Rim speed beyond which no drive goes [m/s]. */
export const FASTEST_RIM = 120;

const TOLERANCE = 1e-8; // of each of the integrator's substeps, relative [1]

export class Motion {
  readonly drivetrain: Drivetrain;
  readonly rail = new Rail();
  vehicle!: Vehicle;
  plant!: Plant; // on the dry rail
  private table!: Table;
  private contact!: ForceElementParameters;
  private body!: WheelsetParameters;

  constructor(private readonly kernel: Kernel) {
    this.drivetrain = kernel.drivetrain();
  }

  /** Take these parameters and this load [N]; the state stays. */
  configure(vehicle: Vehicle, normalLoad: number): void {
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

  /** Put it at the rail's beginning, with no work done. */
  start(speed: number, creepage: number): void {
    const { state } = this.drivetrain;
    for (const name of Object.keys(state) as (keyof typeof state)[]) state[name] = 0;
    this.layPatch(null);
    this.turn(speed, creepage);
  }

  /** Set the speed [m/s] and turn the wheels as a creepage there asks for. */
  turn(speed: number, creepage: number): void {
    const { state } = this.drivetrain;
    state.speed = speed;
    state.omega_left = state.omega_right = ((1 + creepage) * speed) / this.vehicle.radius;
  }

  /** Lay a patch in the place of one that is there, or take it away. */
  layPatch(patch: Rail["patch"]): void {
    this.rail.patch = patch;
    this.drivetrain.setTrack(this.rail.track);
  }

  /** Step from a time on [s] under a torque [N.m]; tell which ends of the patch were passed. */
  advance(time: number, step: number, torque: number): ReturnType<Rail["passed"]> {
    const { input, state } = this.drivetrain;
    const { distance } = state;
    input.commanded_torque = torque;
    this.drivetrain.advance(time, step, TOLERANCE);
    const passed = this.rail.passed(distance, state.distance);
    if (passed.includes("patch_ends")) this.layPatch(null);
    return passed;
  }

  /** Fill in the state. */
  observe(moment: Moment): void {
    const { input, state } = this.drivetrain;
    const friction = this.rail.friction(state.distance);
    input.friction_left = input.friction_right = friction; // a step leaves that of its start
    moment.omega = state.omega_left;
    moment.speed = state.speed;
    moment.creepage = this.drivetrain.output().creepage_left;
    moment.friction = friction;
  }

  /** What the kernel says of a moment under the parameters of now. */
  rowOf({ time, omega, speed, creepage, friction, drive_torque }: Moment): Row {
    const normal_load = this.plant.normalLoad;
    const input = { omega, speed, normal_load, friction_scale: friction, relaxed_creepage: 0 };
    const contact = this.kernel.force(this.table, this.contact, input);
    const rates = this.kernel.motion(this.body, omega, speed, drive_torque, 0, contact);
    const creepage_rate =
      contact.creepage_by_omega * rates.omega_rate + contact.creepage_by_speed * rates.speed_rate;
    const { creep_force } = contact;
    return { time, creepage, drive_torque, creep_force, speed, friction, creepage_rate };
  }

  /** Why it cannot go on from here, in one line, or null. */
  limit(): string | null {
    const { minimum_speed, radius } = this.vehicle;
    const { omega_left, speed } = this.drivetrain.state;
    const rim = omega_left * radius;
    if (!(rim <= FASTEST_RIM)) {
      return `the rim runs at ${rim.toFixed(1)} m/s, above the limit of ${FASTEST_RIM} m/s`;
    }
    if (!(rim > 0)) return `the wheels stand still at a speed of ${speed.toFixed(2)} m/s`;
    if (speed < minimum_speed) {
      return `the speed is ${speed.toFixed(3)} m/s, below the minimum of ${minimum_speed} m/s`;
    }
    return null;
  }
}
