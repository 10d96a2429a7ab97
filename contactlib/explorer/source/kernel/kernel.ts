// The kernel: the same C that Python and the FMUs run, as a WebAssembly module. This and memory.ts
// alone touch the module's memory; no formula of the model stands here. Nothing is checked but
// tables.
import { Drivetrain } from "./drivetrain";
import { Memory } from "./memory";
import {
  type ContactScales,
  FIELDS,
  type ForceElementInput,
  type ForceElementOutput,
  type ForceElementParameters,
  type WheelsetParameters,
  type WheelsetRates,
} from "./structs";

export { Drivetrain, type Profile } from "./drivetrain";

/** Shape of the contact, which has its own table. */
export type Contact = "line" | "elliptic";

/** A table of the law that the kernel has checked. */
export interface Table {
  readonly address: number;
}

/** Functions of the module; a number is an address unless its name says what else it is. */
export interface Exports {
  memory: WebAssembly.Memory;
  __heap_base: WebAssembly.Global;
  creep_table_size(): number;
  creep_table_open(table: number, bytes: number, size: number): number;
  creep_table_place(normalizedCreepage: number, kHat: number): number;
  creep_table_evaluate_many(
    table: number,
    n: number,
    x: number,
    kHat: number,
    kStride: number,
    ratio: number,
    slope: number,
  ): void;
  force_element_evaluate(table: number, parameters: number, input: number, output: number): void;
  force_element_scales(
    parameters: number,
    normalLoad: number,
    frictionScale: number,
    scales: number,
  ): void;
  wheelset_motion(
    parameters: number,
    omega: number,
    speed: number,
    driveTorque: number,
    resistanceForce: number,
    contact: number,
    rates: number,
  ): void;
  track_size(): number;
  track_set(track: number, count: number, at: number, value: number): void;
  drivetrain_member_size(): number;
  drivetrain_member_set(
    member: number,
    table: number,
    contact: number,
    drivetrain: number,
    rails: number,
  ): void;
  drivetrain_advance_many(
    members: number,
    n: number,
    input: number,
    state: number,
    time: number,
    step: number,
    tolerance: number,
    substep: number,
    failed: number,
  ): void;
  drivetrain_evaluate_many(
    members: number,
    n: number,
    rows: number,
    input: number,
    state: number,
    output: number,
  ): void;
}

const MOST_POINTS = 1024; // of the table that are evaluated in one call
const JACOBIAN = 4; // of the rates by omega and speed, row by row

/** The kernel with both tables. */
export class Kernel {
  /** The tables of the Carter-Griffith law. */
  readonly tables: Record<Contact, Table>;
  private readonly points: number[];
  private readonly parameters: number;
  private readonly input: number;
  private readonly output: number;
  private readonly scalesAt: number;
  private readonly body: number;
  private readonly rates: number;

  private constructor(
    private readonly module: Exports,
    private readonly memory: Memory,
    tables: Record<Contact, Uint8Array>,
  ) {
    this.tables = { line: this.open(tables.line), elliptic: this.open(tables.elliptic) };
    this.points = [0, 1, 2, 3].map(() => memory.allocateDoubles(MOST_POINTS));
    this.parameters = memory.allocateDoubles(FIELDS.ForceElementParameters.length);
    this.input = memory.allocateDoubles(FIELDS.ForceElementInput.length);
    this.output = memory.allocateDoubles(FIELDS.ForceElementOutput.length);
    this.scalesAt = memory.allocateDoubles(FIELDS.ContactScales.length);
    this.body = memory.allocateDoubles(FIELDS.WheelsetParameters.length);
    this.rates = memory.allocateDoubles(FIELDS.WheelsetRates.length + JACOBIAN);
  }

  /** Start the module; each table is a table file's bytes. */
  static async load(
    wasm: BufferSource,
    tables: Record<Contact, Uint8Array>,
  ): Promise<Kernel> {
    const { instance } = await WebAssembly.instantiate(wasm);
    const module = instance.exports as unknown as Exports;
    const memory = new Memory(module.memory, module.__heap_base.value as number);
    return new Kernel(module, memory, tables);
  }

  private open(file: Uint8Array): Table {
    const bytes = this.memory.allocate(file.length);
    const address = this.memory.allocate(this.module.creep_table_size());
    this.memory.bytesAt(bytes, file.length).set(file);
    const error = this.module.creep_table_open(address, bytes, file.length);
    if (error !== 0) throw new Error(this.memory.text(error));
    return { address };
  }

  /** Traction ratio and its slope at normalized creepages x and k_hat, all [1]. */
  tableValues(
    table: Table,
    x: Float64Array,
    kHat: Float64Array,
  ): { ratio: Float64Array; slope: Float64Array } {
    const [xAt, kAt, ratioAt, slopeAt] = this.points as [number, number, number, number];
    const ratio = new Float64Array(x.length);
    const slope = new Float64Array(x.length);
    for (let first = 0; first < x.length; first += MOST_POINTS) {
      const n = Math.min(MOST_POINTS, x.length - first);
      this.memory.at(xAt, n).set(x.subarray(first, first + n));
      this.memory.at(kAt, n).set(kHat.subarray(first, first + n));
      this.module.creep_table_evaluate_many(table.address, n, xAt, kAt, 1, ratioAt, slopeAt);
      ratio.set(this.memory.at(ratioAt, n), first);
      slope.set(this.memory.at(slopeAt, n), first);
    }
    return { ratio, slope };
  }

  /** Parameter t of a line contact's law at a normalized creepage and a k_hat above zero, [1]. */
  tablePlace(normalizedCreepage: number, kHat: number): number {
    return this.module.creep_table_place(normalizedCreepage, kHat);
  }

  /** Creep force and what belongs to it. */
  force(
    table: Table,
    parameters: ForceElementParameters,
    input: ForceElementInput,
  ): ForceElementOutput {
    this.memory.write(this.parameters, FIELDS.ForceElementParameters, parameters);
    this.memory.write(this.input, FIELDS.ForceElementInput, input);
    this.module.force_element_evaluate(table.address, this.parameters, this.input, this.output);
    return this.memory.read(this.output, FIELDS.ForceElementOutput);
  }

  /** The law's own measures at a load [N] and a factor on friction [1], both above zero. */
  scales(
    parameters: ForceElementParameters,
    normalLoad: number,
    frictionScale: number,
  ): ContactScales {
    this.memory.write(this.parameters, FIELDS.ForceElementParameters, parameters);
    this.module.force_element_scales(this.parameters, normalLoad, frictionScale, this.scalesAt);
    return this.memory.read(this.scalesAt, FIELDS.ContactScales);
  }

  /** Rates of omega [rad/s] and speed [m/s] under a torque [N.m], a resistance [N], a contact. */
  motion(
    parameters: WheelsetParameters,
    omega: number,
    speed: number,
    driveTorque: number,
    resistanceForce: number,
    contact: ForceElementOutput,
  ): WheelsetRates {
    this.memory.write(this.body, FIELDS.WheelsetParameters, parameters);
    this.memory.write(this.output, FIELDS.ForceElementOutput, contact);
    this.module.wheelset_motion(
      this.body,
      omega,
      speed,
      driveTorque,
      resistanceForce,
      this.output,
      this.rates,
    );
    const scalars = FIELDS.WheelsetRates.length;
    const all = this.memory.at(this.rates, scalars + JACOBIAN);
    return {
      ...this.memory.read<Omit<WheelsetRates, "jacobian">>(this.rates, FIELDS.WheelsetRates),
      jacobian: [...all.subarray(scalars)],
    };
  }

  /** A new drivetrain; its memory stays in use for good. */
  drivetrain(): Drivetrain {
    return new Drivetrain(this.module, this.memory);
  }
}
