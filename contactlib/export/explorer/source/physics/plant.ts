/**
 * A wheelset under one load, its creepage free and its speed frozen. Under a drive torque T
 *
 *     dzeta/dt = (r/(J V)) (T - T_s(zeta)),    T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt,
 *
 * so the curve of T_s shows at which creepages the wheelset can rest and whether it stays there.
 * Forces and rates come from the kernel.
 */
import type { Kernel, Structs, Table } from "../kernel/kernel";
import { demand } from "./limits";
import { forceParameters, type Vehicle, wheelsetParameters } from "./vehicle";

/** What holds a creepage in balance. */
interface Balance {
  creep_force: number; // [N]
  drive_torque: number; // T_s, that keeps the creepage while the vehicle may accelerate [N.m]
  slope: number; // dT_s/dzeta [N.m]
  pole: number; // rate at which a small change grows under a constant torque [1/s]
}

/** The same over a common grid of creepages. */
export type Curves = Record<"creepage" | "creep_force" | "drive_torque" | "pole", Float64Array>;

export class Plant {
  readonly table: Table;
  readonly contact: Structs["force_element_parameters"];
  readonly body: Structs["wheelset_parameters"];
  private readonly input: Structs["force_element_input"];

  /** `normalLoad` is that of both wheels [N]. */
  constructor(readonly kernel: Kernel, readonly vehicle: Vehicle, readonly normalLoad: number) {
    demand("normalLoad", normalLoad, { above: 0 });
    this.table = kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
    this.input = {
      omega: 0, speed: 0, normal_load: normalLoad, friction_scale: 1,
      relaxed_creepage: 0, lateral_velocity: 0, spin_velocity: 0,
    };
  }

  /** Contact at a creepage [1], a speed [m/s] and a factor on friction [1]. */
  force(creepage: number, speed: number, friction = 1): Structs["force_element_output"] {
    demand("speed", speed, { at_least: this.vehicle.minimum_speed });
    this.input.omega = this.omega(creepage, speed);
    this.input.speed = speed;
    this.input.friction_scale = friction;
    return this.kernel.force(this.table, this.contact, this.input);
  }

  /** The kernel's rates there without any drive torque. */
  rates(
    creepage: number, speed: number, contact: Structs["force_element_output"],
  ): Structs["wheelset_rates"] {
    return this.kernel.motion(this.body, this.omega(creepage, speed), speed, 0, 0, contact);
  }

  balance(creepage: number, speed: number, friction = 1): Balance {
    const { radius, inertia } = this.vehicle;
    const contact = this.force(creepage, speed, friction);
    const rates = this.rates(creepage, speed, contact);
    const { "jacobian[0][0]": omegaByOmega, "jacobian[1][0]": speedByOmega } = rates;
    const turning = (inertia / radius) * (1 + creepage); // torque per acceleration
    const byOmega = turning * speedByOmega - inertia * omegaByOmega;
    const slope = (byOmega * speed + inertia * rates.speed_rate) / radius; // domega = V/r dzeta
    return {
      creep_force: contact.creep_force,
      drive_torque: turning * rates.speed_rate - inertia * rates.omega_rate,
      slope,
      pole: -this.gain(speed) * slope,
    };
  }

  curves(creepage: Float64Array, speed: number, friction = 1): Curves {
    const [creep_force, drive_torque, pole] = [0, 1, 2].map(() => new Float64Array(creepage.length));
    const found = { creepage, creep_force, drive_torque, pole } as Curves;
    creepage.forEach((zeta, i) => {
      const there = this.balance(zeta, speed, friction);
      found.creep_force[i] = there.creep_force;
      found.drive_torque[i] = there.drive_torque;
      found.pole[i] = there.pole;
    });
    return found;
  }

  /** T_s alone [N.m]. */
  torque(creepage: number, speed: number, friction = 1): number {
    return this.balance(creepage, speed, friction).drive_torque;
  }

  /** g = r/(J V): rate of the creepage per torque [1/(N.m.s)]. */
  gain(speed: number): number {
    return this.vehicle.radius / (this.vehicle.inertia * speed);
  }

  /** zeta0, k_hat and process zone ratio under this load, without slip speed. */
  scales(friction = 1): Structs["contact_scales"] {
    return this.kernel.scales(this.contact, this.normalLoad, friction);
  }

  private omega(creepage: number, speed: number): number {
    return ((1 + creepage) * speed) / this.vehicle.radius;
  }
}
