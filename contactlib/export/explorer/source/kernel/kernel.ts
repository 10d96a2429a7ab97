// The kernel: the same C that Python and the FMUs run, as a WebAssembly module. This and memory.ts
// alone touch the module's memory; no formula of the model stands here. Nothing is checked but
// tables.

import { embeddedBytes } from "./embedded";
import { Memory, type Module, type Struct, type Structs } from "./memory";
import type { Fields } from "./structs";

export type { Structs } from "./memory";

/** Shape of the contact, which has its own table. */
export type Contact = "line" | "elliptic";

/** A table of the law that the kernel has checked. */
export interface Table {
  readonly address: number;
}

/** Factors on friction [1] at rising distances [m]: piecewise linear and constant beyond the ends;
 * a place given twice is a jump. */
interface Profile {
  at: number[];
  value: number[];
}

/** The kernel with both tables. */
export class Kernel {
  /** The tables of the Carter-Griffith law. */
  readonly tables: Record<Contact, Table>;
  private readonly parameters: Struct<Fields["force_element_parameters"]>;
  private readonly input: Struct<Fields["force_element_input"]>;
  private readonly output: Struct<Fields["force_element_output"]>;
  private readonly contactScales: Struct<Fields["contact_scales"]>;
  private readonly body: Struct<Fields["wheelset_parameters"]>;
  private readonly rates: Struct<Fields["wheelset_rates"]>;

  private constructor(
    private readonly module: Module,
    private readonly memory: Memory,
    tables: Record<Contact, Uint8Array>,
  ) {
    this.tables = { line: this.open(tables.line), elliptic: this.open(tables.elliptic) };
    this.parameters = memory.struct("force_element_parameters");
    this.input = memory.struct("force_element_input");
    this.output = memory.struct("force_element_output");
    this.contactScales = memory.struct("contact_scales");
    this.body = memory.struct("wheelset_parameters");
    this.rates = memory.struct("wheelset_rates");
  }

  /** Start the module; each table is a table file's bytes. */
  static async load(wasm: BufferSource, tables: Record<Contact, Uint8Array>): Promise<Kernel> {
    const { instance } = await WebAssembly.instantiate(wasm);
    const module = instance.exports as unknown as Module;
    return new Kernel(module, new Memory(module), tables);
  }

  /** Start the module that the build put into the page. */
  static embedded(): Promise<Kernel> {
    const tables = { line: embeddedBytes("table-line"), elliptic: embeddedBytes("table-elliptic") };
    return Kernel.load(embeddedBytes("kernel"), tables);
  }

  private open(file: Uint8Array): Table {
    const bytes = this.memory.allocate(file.length);
    const address = this.memory.allocateStruct("creep_table");
    this.memory.bytesAt(bytes, file.length).set(file);
    const error = this.module.creep_table_open(address, bytes, file.length);
    if (error !== 0) throw new Error(this.memory.text(error));
    return { address };
  }

  /** Parameter t of a line contact's law at a normalized creepage and a k_hat above zero, [1]. */
  tablePlace(normalizedCreepage: number, kHat: number): number {
    return this.module.creep_table_place(normalizedCreepage, kHat);
  }

  /** Creep force and what belongs to it. */
  force(
    table: Table,
    parameters: Structs["force_element_parameters"],
    input: Structs["force_element_input"],
  ): Structs["force_element_output"] {
    this.parameters.write(parameters);
    this.input.write(input);
    this.module.force_element_evaluate(
      table.address, this.parameters.address, this.input.address, this.output.address);
    return this.output.read();
  }

  /** The law's own measures at a load [N] and a factor on friction [1], both above zero. */
  scales(
    parameters: Structs["force_element_parameters"], normalLoad: number, frictionScale: number,
  ): Structs["contact_scales"] {
    const { address } = this.contactScales;
    this.parameters.write(parameters);
    this.module.force_element_scales(this.parameters.address, normalLoad, frictionScale, address);
    return this.contactScales.read();
  }

  /** Rates of omega [rad/s] and speed [m/s] under a torque [N.m], a resistance [N], a contact. */
  motion(
    parameters: Structs["wheelset_parameters"],
    omega: number,
    speed: number,
    driveTorque: number,
    resistanceForce: number,
    contact: Structs["force_element_output"],
  ): Structs["wheelset_rates"] {
    this.body.write(parameters);
    this.output.write(contact);
    this.module.wheelset_motion(this.body.address, omega, speed, driveTorque, resistanceForce,
      this.output.address, this.rates.address);
    return this.rates.read();
  }

  /** A new drivetrain; its memory stays in use for good. */
  drivetrain(): Drivetrain {
    return new Drivetrain(this.module, this.memory);
  }
}

/** One drivetrain of the kernel, stepped in time. */
export class Drivetrain {
  /** What is held over a step: reading or writing a field reads or writes the kernel's memory. */
  readonly input: Structs["drivetrain_input"];
  /** What is stepped, likewise. */
  readonly state: Structs["drivetrain_state"];
  private readonly member: number;
  private readonly rails: number;
  private readonly contact: Struct<Fields["force_element_parameters"]>;
  private readonly parameters: Struct<Fields["drivetrain_parameters"]>;
  private readonly inputAt: number;
  private readonly stateAt: number;
  private readonly outputs: Struct<Fields["drivetrain_output"]>;
  private readonly substep: number;
  private readonly failed: number;
  private profile = { address: 0, capacity: 0 }; // room for so many doubles
  private table: Table | null = null;
  private onTrack = false;

  constructor(
    private readonly module: Module,
    private readonly memory: Memory,
  ) {
    this.member = memory.allocateStruct("drivetrain_member");
    this.rails = memory.allocateStruct("track");
    this.contact = memory.struct("force_element_parameters");
    this.parameters = memory.struct("drivetrain_parameters");
    const input = memory.struct("drivetrain_input"), state = memory.struct("drivetrain_state");
    [this.inputAt, this.input] = [input.address, input.view()];
    [this.stateAt, this.state] = [state.address, state.view()];
    this.outputs = memory.struct("drivetrain_output");
    this.substep = memory.allocateDoubles(1);
    this.failed = memory.allocate(1);
  }

  /** Take these parameters from now on; the state stays. */
  configure(
    table: Table,
    contact: Structs["force_element_parameters"],
    parameters: Structs["drivetrain_parameters"],
  ): void {
    this.contact.write(contact);
    this.parameters.write(parameters);
    this.table = table;
    this.connect();
  }

  /** Factor on friction under both wheels by distance; null: as the input says. */
  setTrack(overDistance: Profile | null): void {
    if (overDistance !== null) {
      const { at, value } = overDistance, count = at.length;
      if (count === 0 || count !== value.length) {
        throw new Error(`the profile has ${count} places and ${value.length} values`);
      }
      if (2 * count > this.profile.capacity) {
        this.profile = { address: this.memory.allocateDoubles(4 * count), capacity: 4 * count };
      }
      const both = this.memory.at(this.profile.address, 2 * count);
      both.set([...at, ...value]);
      const values = this.profile.address + both.byteLength / 2;
      this.module.track_set(this.rails, count, this.profile.address, values);
    }
    this.onTrack = overDistance !== null;
    if (this.table !== null) this.connect();
  }

  /** Step from a time on [s], to a relative tolerance [1]; an Error if that is not met. */
  advance(time: number, step: number, tolerance = 1e-6): void {
    this.demandTable();
    this.module.drivetrain_advance_many_in_turn(this.member, 1, this.inputAt, this.stateAt, time,
      step, tolerance, this.substep, this.failed);
    const failed = this.memory.bytesAt(this.failed, 1);
    if (failed[0] !== 0) {
      failed[0] = 0; // another attempt is free to begin
      this.memory.at(this.substep, 1)[0] = 0;
      throw new Error("the tolerance is not met within the largest number of substeps");
    }
  }

  /** Forces, creepages and energies at the state under the input. */
  output(): Structs["drivetrain_output"] {
    this.demandTable();
    this.module.drivetrain_evaluate_many_in_turn(
      this.member, 1, 1, this.inputAt, this.stateAt, this.outputs.address);
    return this.outputs.read();
  }

  private demandTable(): void {
    if (this.table === null) throw new Error("the drivetrain has not been configured");
  }

  private connect(): void {
    this.module.drivetrain_member_set(this.member, this.table!.address, this.contact.address,
      this.parameters.address, this.onTrack ? this.rails : 0);
  }
}
