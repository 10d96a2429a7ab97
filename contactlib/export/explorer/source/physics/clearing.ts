/**
 * Longest stretch of low friction that the wheelset survives under a constant torque. On it the
 * creepage rises from its steady state on good friction. It comes back if at the end of the stretch
 * it has not passed the unstable state on good friction. The kernel integrates the motion.
 */
import type { Structs } from "../kernel/kernel";
import { Motion } from "./motion";
import type { Plant, Point } from "./plant";
import { crossing, isStable } from "./stability";

/** The longest patch that is survived: time [s] and length [m]; infinite: of any length. */
export interface Clearing {
  time: number;
  distance: number;
  /** Creepages at the start and at the border, at the speed before the patch. */
  start: number;
  border: number;
}

const TOLERANCE = 1e-8; // of the integration
const CLOSEST = 1e-9; // of the last step's length, relative
const FIRST_STEP = 1e-4; // [s]
const GROWTH = 1.3; // of the steps
const LONGEST = 1e4; // time on the patch that is integrated at most [s]

let shared: Motion | null = null; // on the patch: its memory stays in use

/**
 * Clearing time under a drive torque [N.m] from a speed [m/s], with friction times `patchFriction`
 * on the patch; null if even good friction does not hold the torque, or if it brakes.
 */
export function clearing(
  plant: Plant, driveTorque: number, speed: number, patchFriction: number,
): Clearing | null {
  const start = driveTorque < 0 ? null : plant.grip(driveTorque, speed);
  if (start === null) return null;
  const unstable = plant.steady(driveTorque, speed).find((state) => !isStable(state));
  const border = unstable?.creepage ?? Infinity;
  const survived = { time: Infinity, distance: Infinity, start, border };
  // The slip velocity itself must grow, and not only its ratio to a falling speed.
  if (unstable === undefined || unstable.pole + unstable.acceleration / speed <= 0) return survived;
  const held = [start, border].map((at) => plant.at(at, speed, patchFriction));
  const turns = plant.turns(speed, patchFriction).slice(0, -1)
    .filter(({ creepage }) => start < creepage && creepage < border);
  const highest = Math.max(...[...held, ...turns].map(({ torque }) => torque));
  if (highest >= driveTorque * (1 - 4 * Number.EPSILON)) return survived;

  const motion = (shared ??= new Motion());
  motion.configure(plant.vehicle, plant.normalLoad);
  const { input } = motion.drivetrain;
  input.commanded_torque = driveTorque;
  input.friction_left = input.friction_right = patchFriction;
  motion.start(speed, start);
  let arrival = moveUntil(motion, () => border);
  if (arrival !== null && plant.vehicle.mass !== null) {
    const borderAt = movingBorder(plant, driveTorque, unstable, arrival.speed);
    motion.start(speed, start);
    arrival = moveUntil(motion, borderAt);
  }
  return arrival === null ? survived : { ...arrival, start, border };
}

/**
 * Border over the speed, which changes little on the patch: a straight line through the unstable
 * states at two speeds, and ahead of them. Beside a state that moves at a rate c and repels at a
 * rate p, a creepage stays at a distance of c/p.
 */
function movingBorder(
  plant: Plant, driveTorque: number, unstable: Point, later: number,
): (speed: number) => number {
  const there = plant.steady(driveTorque, later)[1], { creepage, speed, acceleration, pole } = unstable;
  if (there === undefined || later === speed) return () => creepage;
  const steepness = (there.creepage - creepage) / (later - speed);
  return (at) => creepage + steepness * (acceleration / pole + at - speed);
}

/** Time and distance since the patch began [s, m], and the speed [m/s]. */
type Arrival = Record<"time" | "distance" | "speed", number>;

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
  if (excess() >= 0) return { time: 0, distance: 0, speed: state.speed }; // it moves past the start
  for (let time = 0, step = FIRST_STEP; time < LONGEST && state.speed >= minimum_speed;) {
    const from = { ...state };
    if (stepFrom(from, time, step) >= 0) {
      const part = crossing((h) => stepFrom(from, time, h), 0, step, CLOSEST);
      stepFrom(from, time, part);
      return { time: time + part, distance: state.distance, speed: state.speed };
    }
    [time, step] = [time + step, step * GROWTH];
  }
  return null;
}
