/**
 * How long a stretch of low friction may last before a constant torque runs away on it. There the
 * creepage rises from where the torque grips on good friction; it comes back if it has not passed
 * the unstable state of good friction when that is found again. The motion on the patch is
 * integrated by the kernel.
 */
import type { Drivetrain, Kernel } from "../kernel/kernel";
import type { DrivetrainState } from "../kernel/structs";
import type { Plant } from "./plant";
import { root } from "./roots";
import { type SteadyState, statesOf } from "./stability";
import { type TorqueCurve, torqueCurve } from "./torque_curve";
import { drivetrainParameters, forceParameters } from "./vehicle";

/** The longest patch that is survived: time [s] and length [m], both infinite if any is. */
export interface Clearing {
  time: number;
  distance: number;
  /** Creepages at which it starts, and which it must not pass, at the speed before the patch. */
  start: number;
  border: number;
}

const TOLERANCE = 1e-8; // of the integration
const FIRST_STEP = 1e-4; // [s]
const GROWTH = 1.3; // of the steps
const LONGEST = 1e4; // patch looked at [s]

/**
 * Clearing time under a drive torque [N.m] from a speed [m/s], with friction times `patchFriction`
 * on the patch. null: good friction does not hold the torque.
 */
export function clearing(
  plant: Plant,
  driveTorque: number,
  speed: number,
  patchFriction: number,
): Clearing | null {
  const good = torqueCurve(plant, speed);
  const [grip, unstable] = statesOf(good, driveTorque);
  if (grip === undefined || !(grip.creepage <= (good.turns[0]?.creepage ?? Infinity))) return null;
  const start = grip.creepage;
  const border = unstable?.creepage ?? Infinity;
  const survived = { time: Infinity, distance: Infinity, start, border };
  if (unstable === undefined || !growsFasterThanSpeed(plant, unstable, speed)) return survived;
  const patch = torqueCurve(plant, speed, patchFriction);
  if (highest(patch, start, border) >= driveTorque * (1 - 4 * Number.EPSILON)) return survived;

  const motion = new Motion(plant, driveTorque, patchFriction);
  motion.place(start, speed);
  let borderAt = (_: number): number => border;
  let arrival = motion.until(borderAt);
  if (arrival !== null && plant.vehicle.mass !== null) {
    borderAt = movingBorder(plant, driveTorque, speed, unstable, arrival.speed);
    motion.place(start, speed);
    arrival = motion.until(borderAt);
  }
  return arrival === null ? survived : { ...arrival, start, border };
}

/** Whether a creepage leaves the state for good, and not only relative to a falling speed. */
function growsFasterThanSpeed(plant: Plant, state: SteadyState, speed: number): boolean {
  return state.pole + acceleration(plant, state.creepage, speed) / speed > 0;
}

/** dV/dt [m/s2]. */
function acceleration(plant: Plant, creepage: number, speed: number): number {
  return plant.rates(creepage, speed, plant.force(creepage, speed)).speed_rate;
}

/** Largest torque of a curve between two creepages [N.m]. */
function highest(curve: TorqueCurve, low: number, high: number): number {
  const inside = curve.turns.filter((turn) => low < turn.creepage && turn.creepage < high);
  const ends = [low, high].map((at) => curve.plant.torque(at, curve.speed, curve.friction));
  return Math.max(...ends, ...inside.map((turn) => turn.drive_torque));
}

/**
 * Border over the speed, which changes little meanwhile: a straight line through the unstable
 * states at two speeds. The border is ahead of them: a creepage that is to stay beside a state
 * that moves at a rate c, and is left at the rate p, must be c/p away.
 */
function movingBorder(
  plant: Plant,
  driveTorque: number,
  speed: number,
  unstable: SteadyState,
  later: number,
): (speed: number) => number {
  const there = statesOf(torqueCurve(plant, later), driveTorque)[1];
  if (there === undefined || later === speed) return () => unstable.creepage;
  const steepness = (there.creepage - unstable.creepage) / (later - speed);
  const rate = steepness * acceleration(plant, unstable.creepage, speed);
  const border = unstable.creepage + rate / unstable.pole;
  return (at) => border + steepness * (at - speed);
}

/** A place on the way: since the patch began [s, m], and the speed [m/s]. */
interface Arrival {
  time: number;
  distance: number;
  speed: number;
}

/** A wheelset on the patch. */
class Motion {
  private readonly drivetrain: Drivetrain;

  constructor(
    private readonly plant: Plant,
    private readonly driveTorque: number,
    patchFriction: number,
  ) {
    const { kernel, vehicle, normalLoad } = plant;
    this.drivetrain = drivetrainOf(kernel);
    this.drivetrain.configure(
      kernel.tables[vehicle.contact],
      forceParameters(vehicle),
      drivetrainParameters(vehicle),
    );
    Object.assign(this.drivetrain.input, {
      commanded_torque: driveTorque,
      resistance_force: 0,
      acceleration: 0,
      load_left: 0.5 * normalLoad,
      load_right: 0.5 * normalLoad,
      friction_left: patchFriction,
      friction_right: patchFriction,
    });
  }

  /** Put it where it is to start. */
  place(creepage: number, speed: number): void {
    const omega = ((1 + creepage) * speed) / this.plant.vehicle.radius;
    Object.assign(this.drivetrain.state, {
      speed,
      omega_left: omega,
      omega_right: omega,
      twist: 0,
      relaxed_left: 0,
      relaxed_right: 0,
      drive_torque: this.driveTorque,
      distance: 0,
      drive_work: 0,
      creep_work: 0,
      resistance_work: 0,
      loss_work: 0,
    });
  }

  /** Move until the creepage meets a border over the speed; null if it does not. */
  until(border: (speed: number) => number): Arrival | null {
    const { state } = this.drivetrain;
    const { radius, minimum_speed } = this.plant.vehicle;
    const excess = (): number =>
      (radius * state.omega_left) / state.speed - 1 - border(state.speed);
    let [time, before, step] = [0, excess(), FIRST_STEP];
    if (before >= 0) return { time: 0, distance: 0, speed: state.speed }; // it moves past the start
    while (time < LONGEST && state.speed >= minimum_speed) {
      const from = { ...state };
      const after = this.step(from, time, step, excess);
      if (after >= 0) {
        const part = root((h) => this.step(from, time, h, excess), 0, step, before, after);
        this.step(from, time, part, excess);
        return { time: time + part, distance: state.distance, speed: state.speed };
      }
      [time, before, step] = [time + step, after, step * GROWTH];
    }
    return null;
  }

  /** Step on from a state, and return what has become of the excess. */
  private step(from: DrivetrainState, time: number, step: number, excess: () => number): number {
    Object.assign(this.drivetrain.state, from);
    this.drivetrain.advance(time, step, TOLERANCE);
    return excess();
  }
}

const DRIVETRAINS = new WeakMap<Kernel, Drivetrain>();

/** The one of this module: a kernel's memory is never freed. */
function drivetrainOf(kernel: Kernel): Drivetrain {
  const drivetrain = DRIVETRAINS.get(kernel) ?? kernel.drivetrain();
  DRIVETRAINS.set(kernel, drivetrain);
  return drivetrain;
}
