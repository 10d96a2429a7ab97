/**
 * Longest stretch of low friction that the wheelset survives under a constant torque. On it the
 * creepage rises from its steady state on good friction. It comes back if at the end of the stretch
 * it has not passed the unstable state on good friction. The kernel integrates the motion.
 */
import type { Kernel, Structs } from "../kernel/kernel";
import { Motion } from "./motion";
import type { Plant } from "./plant";
import { root } from "./roots";
import { gripOf, type SteadyState, statesOf } from "./stability";
import { type TorqueCurve, torqueCurve } from "./torque_curve";

/** The longest patch that is survived: time [s] and length [m]; infinite: of any length. */
export interface Clearing {
  time: number;
  distance: number;
  /** Creepages at the start and at the border, at the speed before the patch. */
  start: number;
  border: number;
}

const TOLERANCE = 1e-8; // of the integration
const FIRST_STEP = 1e-4; // [s]
const GROWTH = 1.3; // of the steps
const LONGEST = 1e4; // time on the patch that is integrated at most [s]

/**
 * Clearing time under a drive torque [N.m] from a speed [m/s], with friction times `patchFriction`
 * on the patch; null if even good friction does not hold the torque, or if it brakes.
 */
export function clearing(
  plant: Plant,
  driveTorque: number,
  speed: number,
  patchFriction: number,
): Clearing | null {
  const good = torqueCurve(plant, speed);
  const start = driveTorque < 0 ? null : gripOf(good, driveTorque);
  if (start === null) return null;
  const unstable = statesOf(good, driveTorque).find(({ stable }) => !stable);
  const border = unstable?.creepage ?? Infinity;
  const survived = { time: Infinity, distance: Infinity, start, border };
  if (unstable === undefined || !growsFasterThanSpeed(plant, unstable, speed)) return survived;
  const patch = torqueCurve(plant, speed, patchFriction);
  if (highest(patch, start, border) >= driveTorque * (1 - 4 * Number.EPSILON)) return survived;

  const motion = onPatch(plant, driveTorque, patchFriction);
  motion.start(speed, start);
  let arrival = moveUntil(motion, () => border);
  if (arrival !== null && plant.vehicle.mass !== null) {
    const borderAt = movingBorder(plant, driveTorque, speed, unstable, arrival.speed);
    motion.start(speed, start);
    arrival = moveUntil(motion, borderAt);
  }
  return arrival === null ? survived : { ...arrival, start, border };
}

/** Whether the slip velocity itself grows, and not only its ratio to a falling speed. */
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
 * Border over the speed, which changes little on the patch: a straight line through the unstable
 * states at two speeds, and ahead of them. Beside a state that moves at a rate c and repels at a
 * rate p, a creepage stays at a distance of c/p.
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

/** Time and distance since the patch began [s, m], and the speed [m/s]. */
interface Arrival {
  time: number;
  distance: number;
  speed: number;
}

const MOTIONS = new WeakMap<Kernel, Motion>();

/** A wheelset on a rail that is all patch. There is one for each kernel, as its memory stays used. */
function onPatch(plant: Plant, driveTorque: number, patchFriction: number): Motion {
  const { kernel, vehicle, normalLoad } = plant;
  const motion = MOTIONS.get(kernel) ?? new Motion(kernel);
  MOTIONS.set(kernel, motion);
  motion.configure(vehicle, normalLoad);
  const { input } = motion.drivetrain;
  input.commanded_torque = driveTorque;
  input.friction_left = input.friction_right = patchFriction;
  return motion;
}

/** Move until the creepage meets a border over the speed; null if it does not. */
function moveUntil(motion: Motion, border: (speed: number) => number): Arrival | null {
  const { state } = motion.drivetrain;
  const { radius, minimum_speed } = motion.plant.vehicle;
  const excess = (): number => (radius * state.omega_left) / state.speed - 1 - border(state.speed);
  /** Step on from a state, and return what has become of the excess. */
  const stepFrom = (from: Structs["drivetrain_state"], at: number, step: number): number => {
    Object.assign(state, from);
    motion.drivetrain.advance(at, step, TOLERANCE);
    return excess();
  };
  let [time, before, step] = [0, excess(), FIRST_STEP];
  if (before >= 0) return { time: 0, distance: 0, speed: state.speed }; // it moves past the start
  while (time < LONGEST && state.speed >= minimum_speed) {
    const from = { ...state };
    const after = stepFrom(from, time, step);
    if (after >= 0) {
      const part = root((h) => stepFrom(from, time, h), 0, step, before, after);
      stepFrom(from, time, part);
      return { time: time + part, distance: state.distance, speed: state.speed };
    }
    [time, before, step] = [time + step, after, step * GROWTH];
  }
  return null;
}
