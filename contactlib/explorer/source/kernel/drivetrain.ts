// One drivetrain of the kernel, stepped in time.
import type { Exports, Table } from "./kernel";
import type { Memory } from "./memory";
import {
  type DrivetrainInput,
  type DrivetrainOutput,
  type DrivetrainParameters,
  type DrivetrainState,
  FIELDS,
  type ForceElementParameters,
} from "./structs";

/** Factors on friction [1] at rising distances [m]: piecewise linear and constant beyond the ends;
 * a place given twice is a jump. */
export interface Profile {
  at: number[];
  value: number[];
}

const BODY = FIELDS.WheelsetParameters.length; // doubles of it, before the drivetrain's own

export class Drivetrain {
  /** What is held over a step: reading or writing a field reads or writes the kernel's memory. */
  readonly input: DrivetrainInput;
  /** What is stepped, likewise. */
  readonly state: DrivetrainState;
  private readonly member: number;
  private readonly contact: number;
  private readonly train: number;
  private readonly inputAt: number;
  private readonly stateAt: number;
  private readonly outputAt: number;
  private readonly substep: number;
  private readonly failed: number;
  private readonly rails: number;
  private profile = { address: 0, capacity: 0 }; // room for places and values, so many of each
  private table: Table | null = null;
  private onTrack = false;

  constructor(
    private readonly module: Exports,
    private readonly memory: Memory,
  ) {
    this.member = memory.allocate(module.drivetrain_member_size());
    this.rails = memory.allocate(module.track_size());
    this.contact = memory.allocateDoubles(FIELDS.ForceElementParameters.length);
    this.train = memory.allocateDoubles(BODY + FIELDS.DrivetrainParameters.length);
    this.inputAt = memory.allocateDoubles(FIELDS.DrivetrainInput.length);
    this.stateAt = memory.allocateDoubles(FIELDS.DrivetrainState.length);
    this.outputAt = memory.allocateDoubles(FIELDS.DrivetrainOutput.length);
    this.substep = memory.allocateDoubles(1);
    this.failed = memory.allocate(1);
    this.input = memory.view(this.inputAt, FIELDS.DrivetrainInput);
    this.state = memory.view(this.stateAt, FIELDS.DrivetrainState);
  }

  /** Take these parameters from now on; the state stays. */
  configure(
    table: Table,
    contact: ForceElementParameters,
    drivetrain: DrivetrainParameters,
  ): void {
    const own = this.train + BODY * Float64Array.BYTES_PER_ELEMENT;
    this.memory.write(this.contact, FIELDS.ForceElementParameters, contact);
    this.memory.write(this.train, FIELDS.WheelsetParameters, drivetrain.body);
    this.memory.write(own, FIELDS.DrivetrainParameters, drivetrain);
    this.table = table;
    this.connect();
  }

  /** Factor on friction under both wheels by distance; null: as the input says. */
  setTrack(overDistance: Profile | null): void {
    if (overDistance !== null) {
      const { at, value } = overDistance;
      if (at.length === 0 || at.length !== value.length) {
        throw new Error(`the profile has ${at.length} places and ${value.length} values`);
      }
      if (at.length > this.profile.capacity) {
        const capacity = 2 * at.length;
        this.profile = { address: this.memory.allocateDoubles(2 * capacity), capacity };
      }
      const { address, capacity } = this.profile;
      const values = address + capacity * Float64Array.BYTES_PER_ELEMENT;
      this.memory.at(address, at.length).set(at);
      this.memory.at(values, at.length).set(value);
      this.module.track_set(this.rails, at.length, address, values);
    }
    this.onTrack = overDistance !== null;
    if (this.table !== null) this.connect();
  }

  /** Step from a time on [s], to a relative tolerance [1]; an Error if that is not met. */
  advance(time: number, step: number, tolerance = 1e-6): void {
    this.demandTable();
    this.module.drivetrain_advance_many(
      this.member,
      1,
      this.inputAt,
      this.stateAt,
      time,
      step,
      tolerance,
      this.substep,
      this.failed,
    );
    const failed = this.memory.bytesAt(this.failed, 1);
    if (failed[0] !== 0) {
      failed[0] = 0; // another attempt is free to begin
      this.memory.at(this.substep, 1)[0] = 0;
      throw new Error("the tolerance is not met within the largest number of substeps");
    }
  }

  /** Forces, creepages and energies at the state under the input. */
  output(): DrivetrainOutput {
    this.demandTable();
    this.module.drivetrain_evaluate_many(
      this.member,
      1,
      1,
      this.inputAt,
      this.stateAt,
      this.outputAt,
    );
    return this.memory.read(this.outputAt, FIELDS.DrivetrainOutput);
  }

  private demandTable(): void {
    if (this.table === null) throw new Error("the drivetrain has not been configured");
  }

  private connect(): void {
    this.module.drivetrain_member_set(
      this.member,
      this.table!.address,
      this.contact,
      this.train,
      this.onTrack ? this.rails : 0,
    );
  }
}
