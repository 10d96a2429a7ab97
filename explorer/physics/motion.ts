/** The wheelset on its rail: state, parameters and wet patch in the kernel's drivetrain. */
import { Drivetrain, type Patch, type Structs } from "../kernel/kernel";
import { configureRigid, Plant } from "./plant";
import type { Row, RunEvent } from "./recorder";
import type { Vehicle } from "./vehicle";

/** Rim speed at which a run stops [m/s]. */
export const FASTEST_RIM = 120;

const BEYOND = 12; // rim speed that a run gains beyond its limits when it is let go on [m/s]

const TOLERANCE = 1e-8; // of each of the integrator's substeps, relative [1]

export class Motion {
  readonly drivetrain = new Drivetrain();
  patch: Patch | null = null;
  plant!: Plant; // on the dry rail
  private displacement = 0; // of the rim against the rail [m]
  private rims: [number, number] = [0, FASTEST_RIM]; // between which time goes on [m/s]

  /** Take these parameters and this load [N]; the state stays. */
  configure(vehicle: Vehicle, axleLoad: number): void {
    const remembered = this.plant?.vehicle.memory;
    this.plant = new Plant({ ...vehicle }, axleLoad);
    configureRigid(this.drivetrain, this.plant, this.plant.rolling);
    Object.assign(this.drivetrain.input, {
      resistance_force: 0, acceleration: 0, load_left: 0.5 * axleLoad,
      load_right: 0.5 * axleLoad, slope: 1,
    });
    if (!remembered) this.rollSteadily();
  }

  /** Put it at the rail's beginning, with no work done. */
  start(speed: number, creepage: number): void {
    const { state } = this.drivetrain;
    for (const name of Object.keys(state)) Object.assign(state, { [name]: 0 });
    this.placePatch(null);
    this.rims = [0, FASTEST_RIM];
    this.displacement = 0;
    const rolls = this.plant.rolls(speed);
    this.turn(rolls, creepage);
    this.rollSteadily();
    if (speed !== rolls) this.turn(speed, 0);
  }

  /** Let contacts with memory remember steady rolling at the present creepage. */
  private rollSteadily(): void {
    this.takeFriction();
    this.drivetrain.settle();
  }

  /** Output at the state. */
  private output(): Structs["drivetrain_output"] {
    this.takeFriction();
    return this.drivetrain.output();
  }

  /** Take the friction of the place, as a step leaves that of its start. */
  private takeFriction(): void {
    const { input } = this.drivetrain, friction = this.onPatch ? this.patch!.friction : 1;
    input.friction_left = input.friction_right = friction;
  }

  /** Move the limits of the rim speed, so that a wheel at one of them goes on from where it is. */
  goBeyond(): void {
    this.rims = [Math.min(0, this.rim - BEYOND), Math.max(FASTEST_RIM, this.rim + BEYOND)];
  }

  /** Speed at which a run ends [m/s]: with memory the wheel may stand, and swing a little about that. */
  get slowest(): number {
    const { memory, minimum_speed } = this.plant.vehicle;
    return memory ? -minimum_speed : minimum_speed;
  }

  /** Whether the vehicle is slower than the minimum speed, so that there is no creepage. */
  get stands(): boolean {
    const { speed } = this.drivetrain.state;
    return this.plant.rolls(speed) > speed;
  }

  /** Speed of the rim [m/s]. */
  private get rim(): number {
    return this.drivetrain.state.omega_left * this.plant.vehicle.radius;
  }

  /** Set the speed [m/s], and turn the wheels so that they have a creepage. */
  turn(speed: number, creepage: number): void {
    const omega = (speed + creepage * this.plant.rolls(speed)) / this.plant.vehicle.radius;
    Object.assign(this.drivetrain.state, { speed, omega_left: omega, omega_right: omega });
  }

  /** Place a patch in place of one that is there, or take it away. */
  placePatch(patch: Patch | null): void {
    this.patch = patch;
    this.drivetrain.placePatch(patch);
  }

  /** Whether the wheels are on the patch. */
  get onPatch(): boolean {
    const { distance } = this.drivetrain.state;
    return this.patch !== null && distance >= this.patch.begins && distance < this.patch.ends;
  }

  /** Step from a time on [s] under a torque [N.m]; returns which ends of the patch were passed. */
  advance(time: number, step: number, torque: number): RunEvent["name"][] {
    const { input, state } = this.drivetrain, from = state.distance, slip = this.rim - state.speed;
    input.commanded_torque = torque;
    this.drivetrain.advance(time, step, TOLERANCE);
    this.displacement += 0.5 * step * (slip + this.rim - state.speed);
    const passed: RunEvent["name"][] = [];
    if (this.patch !== null) {
      const { begins, ends } = this.patch, to = state.distance;
      if (from < begins && to >= begins) passed.push("patch_begins");
      if (from < ends && to >= ends) {
        passed.push("patch_ends");
        this.placePatch(null);
      }
    }
    return passed;
  }

  /** The state at a time [s] under a torque [N.m]. */
  row(time: number, drive_torque: number): Row {
    const { input, state: { speed, omega_left: omega } } = this.drivetrain;
    const { radius, damping } = this.plant.vehicle, rolls = this.plant.rolls(speed);
    const out = this.output(), { friction_left: friction } = input;
    const creepage = rolls === speed ? out.creepage_left : (radius * omega - speed) / rolls;
    const creep_force = out.creep_force_left + out.creep_force_right;
    const turning = drive_torque - radius * creep_force - damping * omega; // J d(omega)/dt
    const creepage_rate =
      this.plant.gain(speed) * turning - ((speed / rolls + creepage) * out.speed_rate) / rolls;
    const { displacement } = this;
    return {
      time, creepage, drive_torque, creep_force, speed, friction, creepage_rate, displacement,
    };
  }

  /** Why it cannot go on, in one line, or null. */
  limit(): string | null {
    const { slowest: least } = this, { speed } = this.drivetrain.state;
    const { rim, rims: [slowest, fastest] } = this, runs = `the rim runs at ${rim.toFixed(1)} m/s`;
    if (!(rim <= fastest)) return `${runs}, above the limit of ${fastest.toFixed(0)} m/s`;
    if (!(rim > Math.min(slowest, least))) return `${runs}, below the limit of ${slowest.toFixed(0)} m/s`;
    if (speed < least) return `the speed is ${speed.toFixed(3)} m/s, below the minimum of ${least} m/s`;
    return null;
  }
}
