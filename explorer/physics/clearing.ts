/**
 * Longest stretch of low friction that the wheelset survives under a constant torque. On it the
 * creepage rises from its steady state on good friction. The wheel re-adheres if at the end of the
 * stretch it has not passed the unstable state on good friction.
 */
import { Drivetrain } from "../kernel/kernel";
import { configureRigid, type Plant } from "./plant";
import { isStable } from "./stability";

/** The longest patch that is survived: time [s] and length [m]; infinite: of any length. */
export interface Clearing {
  time: number;
  distance: number;
  /** Creepages at the start and at the border, at the speed before the patch. */
  start: number;
  border: number;
}

type Arrival = Record<"time" | "distance" | "speed", number>;

const LONGEST = 1e4; // time on the patch that is integrated at most [s]

let train: Drivetrain | null = null; // whose memory stays in use

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
  const rests = plant.steady(driveTorque, speed, patchFriction);
  const isHeld = rests.some(({ creepage }) => start <= creepage && creepage <= border);
  if (patchFriction >= 1 || isHeld) return survived;

  configureRigid((train ??= new Drivetrain()), plant, plant.contact);
  const omega = ((1 + start) * speed) / plant.vehicle.radius;
  const held = {
    reference: driveTorque, axle_load: plant.axleLoad, friction_scale: patchFriction,
    resistance_force: 0,
  };
  /** Time, distance and speed at which the creepage passes a border over the speed. */
  const reach = (base: number, slope: number): Arrival | null =>
    start >= base + slope * speed ? { time: 0, distance: 0, speed } // it moves past the start
      : train!.pass({ speed, omega }, held, base, slope, LONGEST);
  let arrival = reach(border, 0);
  if (arrival !== null && plant.vehicle.mass !== null && arrival.speed !== speed) {
    // The border changes little with the speed on the patch: a straight line through the unstable
    // states at two speeds, and ahead of them. Beside a state that moves at a rate c and repels at a
    // rate p, a creepage stays at a distance of c/p.
    const later = plant.steady(driveTorque, arrival.speed)[1];
    const slope = later === undefined ? 0 : (later.creepage - border) / (arrival.speed - speed);
    arrival = reach(border + slope * (unstable.acceleration / unstable.pole - speed), slope);
  }
  return arrival === null ? survived
    : { time: arrival.time, distance: arrival.distance, start, border };
}
