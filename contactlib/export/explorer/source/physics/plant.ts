/** A wheelset under one load: its contact, and the drive torques that hold its creepages. */
import { type Asked, kernel, type Point, type Structs, type Table } from "../kernel/kernel";
import { demand } from "./limits";
import { forceParameters, type Vehicle, wheelsetParameters } from "./vehicle";

export type { Point } from "../kernel/kernel";

/** Steady creep over a common grid of creepages. */
export type Curves = Record<"creepage" | "force" | "torque" | "pole", Float64Array>;

export class Plant {
  readonly table: Table;
  readonly contact: Structs["force_element_parameters"];
  readonly body: Structs["wheelset_parameters"];

  /** `normalLoad` is that of both wheels [N]. */
  constructor(readonly vehicle: Vehicle, readonly normalLoad: number) {
    demand("normalLoad", normalLoad, { above: 0 });
    this.table = kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
  }

  /** Contact at a creepage [1], a speed [m/s] and a factor on friction [1]. */
  force(creepage: number, speed: number, friction = 1): Structs["force_element_output"] {
    demand("speed", speed, { at_least: this.vehicle.minimum_speed });
    return kernel.force(this.table, this.contact, {
      omega: this.omega(creepage, speed), speed, normal_load: this.normalLoad,
      friction_scale: friction, relaxed_creepage: 0, lateral_velocity: 0, spin_velocity: 0,
    });
  }

  /** The kernel's rates there without any drive torque. */
  rates(
    creepage: number, speed: number, contact = this.force(creepage, speed),
  ): Structs["wheelset_rates"] {
    return kernel.motion(this.body, this.omega(creepage, speed), speed, 0, contact);
  }

  /** Steady creep at a creepage. */
  at(creepage: number, speed: number, friction = 1): Point {
    return kernel.pointsAt(this.asked(speed, friction), [creepage])[0]!;
  }

  /** Drive torque that holds a creepage [N.m]. */
  torque(creepage: number, speed: number, friction = 1): number {
    return this.at(creepage, speed, friction).torque;
  }

  curves(creepage: Float64Array, speed: number, friction = 1): Curves {
    const points = kernel.pointsAt(this.asked(speed, friction), creepage);
    const column = (name: keyof Point): Float64Array =>
      Float64Array.from(points, (point) => point[name]);
    return { creepage, force: column("force"), torque: column("torque"), pole: column("pole") };
  }

  /** Where the torque turns in traction, by rising creepage; last comes the end of the search. */
  turns(speed: number, friction = 1): Point[] {
    return kernel.turns(this.asked(speed, friction));
  }

  /** Steady states in traction under a torque [N.m], by rising creepage. */
  steady(torque: number, speed: number, friction = 1): Point[] {
    return kernel.steady(this.asked(speed, friction), torque);
  }

  /**
   * Creepage at which the wheel grips under a torque [N.m]: before the first turn, or zero if
   * rolling takes more than the torque; null if grip does not hold it.
   */
  grip(torque: number, speed: number): number | null {
    if (torque <= this.torque(0, speed)) return 0;
    const creepage = this.steady(torque, speed)[0]?.creepage ?? Infinity;
    return creepage <= this.turns(speed)[0]!.creepage ? creepage : null;
  }

  /** g = r/(J V): rate of the creepage per torque [1/(N.m.s)]. */
  gain(speed: number): number {
    return this.vehicle.radius / (this.vehicle.inertia * speed);
  }

  /** zeta0, k_hat and process zone ratio under this load, without slip speed. */
  scales(friction = 1): Structs["contact_scales"] {
    return kernel.scales(this.contact, this.normalLoad, friction);
  }

  private asked(speed: number, friction: number): Asked {
    const { table, contact, body, normalLoad } = this;
    const conditions = {
      speed, "normal_load[0]": normalLoad, "normal_load[1]": normalLoad,
      "friction_scale[0]": friction, "friction_scale[1]": friction,
      resistance_force: 0, acceleration: 0, balanced: 0,
    };
    return { table, contact, body, conditions };
  }

  private omega(creepage: number, speed: number): number {
    return ((1 + creepage) * speed) / this.vehicle.radius;
  }
}
