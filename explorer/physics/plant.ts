/** A wheelset under one load: its contact, and the drive torques that hold its creepages. */
import { type Drivetrain, kernel, type Point, type Structs } from "../kernel/kernel";
import { demand } from "./limits";
import { forceParameters, rollingParameters, scalesOf, type Vehicle, wheelsetParameters } from "./vehicle";

export type { Point } from "../kernel/kernel";

const TRACTION = 1; // the side of the curve

/** Steady creep over a grid of creepages. */
export type Curves = Record<keyof Point, Float64Array>;

/** The fold, at the first maximum of the torque [1, N.m], and the end of the slip-away branch under a
 * falling torque; its creepage may be infinite. */
export type Fold = Record<
  "creepage" | "drive_torque" | "return_creepage" | "return_torque", number
>;

export class Plant {
  readonly table: number;
  /** The contact in steady rolling, and as it moves: with its memory, if it has one. */
  readonly contact: Structs["force_element_parameters"];
  readonly rolling: Structs["force_element_parameters"];
  readonly body: Structs["wheelset_parameters"];
  /** zeta0 at the nominal load and no slip speed [1]. */
  readonly saturation: number;

  /** `axleLoad` is that of both wheels [N]. */
  constructor(readonly vehicle: Vehicle, readonly axleLoad: number) {
    demand("axleLoad", axleLoad, { above: 0 });
    this.table = kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.rolling = rollingParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
    this.saturation = scalesOf(this.contact).saturation_creepage;
  }

  /** Contact at a creepage [1], a speed [m/s] and a factor on friction [1]. */
  force(creepage: number, speed: number, friction = 1): Structs["force_element_output"] {
    const rolling = this.rolls(speed);
    const input = {
      omega: this.omega(creepage, rolling), speed: rolling, normal_load: this.axleLoad,
      friction_scale: friction, held_force: 0, unslipped: 1, outer_force: 0,
      held_lateral: 0, outer_lateral: 0, lateral_velocity: 0, spin_velocity: 0,
    };
    return kernel.filled("force_element_output", (to) =>
      kernel.module.force_element_evaluate(
        this.table, kernel.given("force_element_parameters", this.contact),
        kernel.given("force_element_input", input), to));
  }

  /** Steady creep at a creepage. */
  at(creepage: number, speed: number, friction = 1): Point {
    return kernel.points(this.pointsCall(1, speed, friction), [creepage])[0]!;
  }

  /** Drive torque that holds a creepage [N.m]. */
  torque(creepage: number, speed: number, friction = 1): number {
    return this.at(creepage, speed, friction).torque;
  }

  /** Steady creep at creepages. */
  curves(creepage: ArrayLike<number>, speed: number, friction = 1): Curves {
    return kernel.columns(this.pointsCall(creepage.length, speed, friction), creepage);
  }

  /** Where a slow torque ramp leaves the stable branch, and where it returns; null: it never does. */
  fold(speed: number): Fold | null {
    const [fold, back] = kernel.points((to) =>
      kernel.module.creep_curve_fold(...this.given(speed, 1), to));
    return fold === undefined ? null : {
      creepage: fold.creepage, drive_torque: fold.torque,
      return_creepage: back!.creepage, return_torque: back!.torque,
    };
  }

  /** Largest creep force [N], and the creepage with it, which may be infinite. */
  peak(speed: number): { creepage: number; force: number } {
    const { address } = kernel.shared("creep_point"); // whose first member is the creepage
    const [table, contact, , at] = this.given(speed, 1);
    const force = kernel.module.creep_curve_peak(table, contact, at, address);
    return { creepage: kernel.shared("creep_point").creepage, force };
  }

  /** Steady states in traction under a torque [N.m], by rising creepage. */
  steady(torque: number, speed: number, friction = 1): Point[] {
    return kernel.points((to, room) =>
      kernel.module.creep_curve_steady(...this.given(speed, friction), torque, TRACTION, room, to));
  }

  /**
   * Creepage at which the wheel grips under a torque [N.m], or zero if rolling takes more than the
   * torque; null if grip does not hold it.
   */
  grip(torque: number, speed: number): number | null {
    if (torque <= this.torque(0, speed)) return 0;
    const { address } = kernel.shared("creep_point"); // has room for the limit, which is not used
    const given = this.given(speed, 1);
    const creepage = kernel.module.creep_curve_grip(...given, torque, address);
    return Number.isNaN(creepage) ? null : creepage;
  }

  /** The speed of steady creep beside a speed: a wheel that stands is compared with one that rolls
   * at the minimum speed, over which its slip velocity is the creepage [m/s]. */
  rolls(speed: number): number {
    demand("speed", speed, {});
    return Math.max(speed, this.vehicle.minimum_speed);
  }

  /** g = r/(J V): rate of the creepage per torque [1/(N.m.s)]. */
  gain(speed: number): number {
    return this.vehicle.radius / (this.vehicle.inertia * this.rolls(speed));
  }

  /** A wheel that stands on a contact with memory, and does not slip: the force of both contacts per
   * displacement [N/m], and the frequency with which the wheel swings on them [Hz]. */
  spring(): { stiffness: number; frequency: number } {
    const { radius, inertia, inverse_mass } = this.body, { kinetic_friction } = this.vehicle;
    const scales = scalesOf(this.rolling, this.axleLoad, 1, this.table);
    const slope = (scales.initial_slope * kinetic_friction * this.axleLoad) / scales.saturation_creepage;
    const stiffness = (scales.standing_stiffness * slope) / scales.relaxation_length;
    const inverse = radius ** 2 / inertia + inverse_mass;
    return { stiffness, frequency: Math.sqrt(stiffness * inverse) / (2 * Math.PI) };
  }

  /** zeta0, k_hat and process zone ratio under this load, without slip speed. */
  scales(friction = 1): Structs["contact_scales"] {
    return scalesOf(this.contact, this.axleLoad, friction);
  }

  private pointsCall(count: number, speed: number, friction: number) {
    return (to: number, _room: number, from: number): void =>
      kernel.module.creep_curve_points(...this.given(speed, friction), count, from, to);
  }

  /** What all functions of steady creep take first. */
  private given(speed: number, friction: number): [number, number, number, number] {
    const conditions = {
      speed: this.rolls(speed), "normal_load[0]": this.axleLoad, "normal_load[1]": this.axleLoad,
      "friction_scale[0]": friction, "friction_scale[1]": friction,
      resistance_force: 0, acceleration: 0, balanced: 0,
    };
    return [
      this.table, kernel.given("force_element_parameters", this.contact),
      kernel.given("wheelset_parameters", this.body), kernel.given("creep_conditions", conditions),
    ];
  }

  private omega(creepage: number, speed: number): number {
    return ((1 + creepage) * speed) / this.vehicle.radius;
  }
}

/** Give a drivetrain with a rigid axle the plant's parameters and one of its contacts. */
export function configureRigid(
  train: Drivetrain, { table, body }: Plant, contact: Structs["force_element_parameters"],
): void {
  train.configure(table, contact, {
    ...body, axle_stiffness: 0, axle_damping: 0, drive_share: 0.5, motor_lag: 0,
    motor_inertia: 0, shaft_stiffness: 0, shaft_damping: 0,
    brake_fill_time: 0, brake_vent_time: 0, sand_friction: 1, sand_slope: 1,
  });
}
