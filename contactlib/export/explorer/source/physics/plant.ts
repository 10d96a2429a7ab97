/** A wheelset under one load: its contact, and the drive torques that hold its creepages. */
import { kernel, type Point, type Structs } from "../kernel/kernel";
import { demand } from "./limits";
import { forceParameters, scalesOf, type Vehicle, wheelsetParameters } from "./vehicle";

export type { Point } from "../kernel/kernel";

const TRACTION = 1; // the side of the curve

/** Steady creep over a common grid of creepages. */
export type Curves = Record<"creepage" | "force" | "torque" | "pole", Float64Array>;

export class Plant {
  readonly table: number;
  readonly contact: Structs["force_element_parameters"];
  readonly body: Structs["wheelset_parameters"];
  /** zeta0 at the nominal load and no slip speed [1]. */
  readonly saturation: number;

  /** `normalLoad` is that of both wheels [N]. */
  constructor(readonly vehicle: Vehicle, readonly normalLoad: number) {
    demand("normalLoad", normalLoad, { above: 0 });
    this.table = kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
    this.saturation = scalesOf(this.contact).saturation_creepage;
  }

  /** Contact at a creepage [1], a speed [m/s] and a factor on friction [1]. */
  force(creepage: number, speed: number, friction = 1): Structs["force_element_output"] {
    demand("speed", speed, { at_least: this.vehicle.minimum_speed });
    const input = {
      omega: this.omega(creepage, speed), speed, normal_load: this.normalLoad,
      friction_scale: friction, relaxed_creepage: 0, lateral_velocity: 0, spin_velocity: 0,
    };
    return kernel.filled("force_element_output", (to) =>
      kernel.module.force_element_evaluate(
        this.table, kernel.given("force_element_parameters", this.contact),
        kernel.given("force_element_input", input), to));
  }

  /** The kernel's rates there without any drive torque. */
  rates(creepage: number, speed: number, friction = 1): Structs["wheelset_rates"] {
    const contact = kernel.given("force_element_output", this.force(creepage, speed, friction));
    return kernel.filled("wheelset_rates", (to) =>
      kernel.module.wheelset_motion(
        kernel.given("wheelset_parameters", this.body), this.omega(creepage, speed), speed, 0, 0,
        contact, to));
  }

  /** Steady creep at a creepage. */
  at(creepage: number, speed: number, friction = 1): Point {
    return this.points([creepage], speed, friction)[0]!;
  }

  /** Drive torque that holds a creepage [N.m]. */
  torque(creepage: number, speed: number, friction = 1): number {
    return this.at(creepage, speed, friction).torque;
  }

  curves(creepage: Float64Array, speed: number, friction = 1): Curves {
    const points = this.points(creepage, speed, friction);
    const column = (name: keyof Point): Float64Array =>
      Float64Array.from(points, (point) => point[name]);
    return { creepage, force: column("force"), torque: column("torque"), pole: column("pole") };
  }

  /** Where the torque turns in traction, by rising creepage; last comes the end of the search. */
  turns(speed: number, friction = 1): Point[] {
    return kernel.points((to, room) =>
      kernel.module.creep_curve_turns(...this.given(speed, friction), TRACTION, room, to));
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

  /** g = r/(J V): rate of the creepage per torque [1/(N.m.s)]. */
  gain(speed: number): number {
    return this.vehicle.radius / (this.vehicle.inertia * speed);
  }

  /** zeta0, k_hat and process zone ratio under this load, without slip speed. */
  scales(friction = 1): Structs["contact_scales"] {
    return scalesOf(this.contact, this.normalLoad, friction);
  }

  private points(creepage: ArrayLike<number>, speed: number, friction: number): Point[] {
    return kernel.points((to, _, from) =>
      kernel.module.creep_curve_points(
        ...this.given(speed, friction), creepage.length, from, to), creepage);
  }

  /** What all functions of steady creep take first. */
  private given(speed: number, friction: number): [number, number, number, number] {
    const conditions = {
      speed, "normal_load[0]": this.normalLoad, "normal_load[1]": this.normalLoad,
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
