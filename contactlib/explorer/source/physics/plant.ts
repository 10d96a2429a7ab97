/**
 * A wheelset under one load, its creepage free and its speed frozen. Under a drive torque T
 *
 *     dzeta/dt = (r/(J V)) (T - T_s(zeta)),    T_s = r Q + b omega + (J/r)(1 + zeta) dV/dt,
 *
 * so the curve of T_s tells where the creepage rests and whether it stays there. Forces and rates
 * are the kernel's.
 */
import type { Kernel, Table } from "../kernel/kernel";
import type {
  ContactScales,
  ForceElementInput,
  ForceElementOutput,
  ForceElementParameters,
  WheelsetParameters,
  WheelsetRates,
} from "../kernel/structs";
import { forceParameters, type Vehicle, wheelsetParameters } from "./vehicle";

/** Creep force [N], torque T_s that keeps a creepage [N.m] and its derivative to it [N.m]. */
export interface Balance {
  creep_force: number;
  drive_torque: number;
  slope: number;
}

export class Plant {
  private readonly table: Table;
  private readonly contact: ForceElementParameters;
  private readonly body: WheelsetParameters;
  private readonly input: ForceElementInput;

  /** `normalLoad` is that of both wheels, above zero [N]. */
  constructor(
    readonly kernel: Kernel,
    readonly vehicle: Vehicle,
    readonly normalLoad: number,
  ) {
    if (!(normalLoad > 0 && normalLoad < Infinity)) {
      throw new RangeError(`normalLoad = ${normalLoad} is out of range: must be > 0`);
    }
    this.table = kernel.tables[vehicle.contact];
    this.contact = forceParameters(vehicle);
    this.body = wheelsetParameters(vehicle);
    this.input = {
      omega: 0,
      speed: 0,
      normal_load: normalLoad,
      friction_scale: 1,
      relaxed_creepage: 0,
    };
  }

  /** What the contact does at a creepage [1], a speed [m/s] and a factor on friction [1]. */
  force(creepage: number, speed: number, friction = 1): ForceElementOutput {
    if (!(speed >= this.vehicle.minimum_speed)) {
      throw new RangeError(
        `speed = ${speed} is out of range: must be >= ${this.vehicle.minimum_speed}`,
      );
    }
    this.input.omega = this.omega(creepage, speed);
    this.input.speed = speed;
    this.input.friction_scale = friction;
    return this.kernel.force(this.table, this.contact, this.input);
  }

  /** The kernel's rates there without any drive torque. */
  rates(creepage: number, speed: number, contact: ForceElementOutput): WheelsetRates {
    return this.kernel.motion(this.body, this.omega(creepage, speed), speed, 0, 0, contact);
  }

  /** Quasi-steady torque and its slope. */
  balance(creepage: number, speed: number, friction = 1): Balance {
    const { radius, inertia } = this.vehicle;
    const contact = this.force(creepage, speed, friction);
    const rates = this.rates(creepage, speed, contact);
    const [omegaByOmega, , speedByOmega] = rates.jacobian as [number, number, number, number];
    const turning = (inertia / radius) * (1 + creepage); // torque per acceleration
    const byOmega = turning * speedByOmega - inertia * omegaByOmega;
    return {
      creep_force: contact.creep_force,
      drive_torque: turning * rates.speed_rate - inertia * rates.omega_rate,
      slope: (byOmega * speed + inertia * rates.speed_rate) / radius, // domega = V/r dzeta
    };
  }

  /** Drive torque T_s that keeps the creepage while the vehicle may accelerate [N.m]. */
  torque(creepage: number, speed: number, friction = 1): number {
    return this.balance(creepage, speed, friction).drive_torque;
  }

  /** dT_s/dzeta [N.m]. */
  slope(creepage: number, speed: number, friction = 1): number {
    return this.balance(creepage, speed, friction).slope;
  }

  /** Rate at which a small change of the creepage grows under a constant torque [1/s]. */
  pole(creepage: number, speed: number, friction = 1): number {
    return -this.gain(speed) * this.slope(creepage, speed, friction);
  }

  /** g = r/(J V): rate of the creepage per torque [1/(N.m.s)]. */
  gain(speed: number): number {
    return this.vehicle.radius / (this.vehicle.inertia * speed);
  }

  /** zeta0, k_hat and process zone ratio under this load, at no slip speed. */
  scales(friction = 1): ContactScales {
    return this.kernel.scales(this.contact, this.normalLoad, friction);
  }

  private omega(creepage: number, speed: number): number {
    return ((1 + creepage) * speed) / this.vehicle.radius;
  }
}
