// The kernel: the same C that Python and the FMUs run, as a WebAssembly module. This and memory.ts
// alone touch the module's memory; who calls the module's functions gets the addresses of what they
// read and fill here. Nothing is checked but tables.

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

/** A point of steady creep. */
export type Point = Structs["creep_point"];

/** Factors on friction [1] at rising distances [m]: piecewise linear and constant beyond the ends;
 * a place given twice is a jump. */
interface Profile {
  at: number[];
  value: number[];
}

const ROOM = 512; // points of a curve at most

/** The kernel with both tables. */
export class Kernel {
  /** The tables of the Carter-Griffith law. */
  readonly tables: Record<Contact, Table>;
  private readonly structs = new Map<keyof Fields, Struct<string>>(); // of one call
  private readonly places: Struct<Fields["creep_point"]>[];
  private readonly doubles: number;

  private constructor(
    readonly module: Module,
    private readonly memory: Memory,
    tables: Record<Contact, Uint8Array>,
  ) {
    this.tables = { line: this.open(tables.line), elliptic: this.open(tables.elliptic) };
    this.places = memory.structs("creep_point", ROOM);
    this.doubles = memory.allocateDoubles(ROOM);
  }

  /** Start the module; each table is a table file's bytes. */
  static async load(wasm: BufferSource, tables: Record<Contact, Uint8Array>): Promise<Kernel> {
    const { instance } = await WebAssembly.instantiate(wasm);
    const module = instance.exports as unknown as Module;
    return new Kernel(module, new Memory(module), tables);
  }

  private open(file: Uint8Array): Table {
    const bytes = this.memory.allocate(file.length);
    const address = this.memory.allocateStruct("creep_table");
    this.memory.bytesAt(bytes, file.length).set(file);
    const error = this.module.creep_table_open(address, bytes, file.length);
    if (error !== 0) throw new Error(this.memory.text(error));
    return { address };
  }

  private shared<Name extends keyof Fields>(name: Name): Struct<Fields[Name]> {
    let found = this.structs.get(name);
    if (found === undefined) this.structs.set(name, (found = this.memory.struct(name)));
    return found as Struct<Fields[Name]>;
  }

  /** Address of the struct that calls share, after these values have been written to it. */
  given<Name extends keyof Fields>(name: Name, values: Structs[Name]): number {
    const struct = this.shared(name);
    struct.write(values);
    return struct.address;
  }

  /** The struct that a C function fills at an address. */
  filled<Name extends keyof Fields>(
    name: Name, fill: (address: number) => void,
  ): Record<Fields[Name], number> {
    const struct = this.shared(name);
    fill(struct.address);
    return struct.read();
  }

  /** The points that a C function fills at an address for some creepages [1], or as many as it
   * says that it has found. */
  points(
    fill: (to: number, room: number, creepage: number) => number | void,
    creepage?: ArrayLike<number>,
  ): Point[] {
    if (creepage !== undefined) this.memory.at(this.doubles, creepage.length).set(creepage);
    const found = fill(this.places[0]!.address, ROOM, this.doubles);
    return this.places.slice(0, found ?? creepage?.length).map((point) => point.read());
  }

  /** Semi-axes along and across rolling [m] by Hertz, from radii [m] and P/(pi E*) [m2]. */
  semiAxes(radiusX: number, radiusY: number, compliance: number): [number, number] {
    this.module.hertz_semi_axes(radiusX, radiusY, compliance, this.doubles);
    const [a, b] = this.memory.at(this.doubles, 2);
    return [a!, b!];
  }

  /** A new drivetrain; its memory stays in use for good. */
  drivetrain(): Drivetrain {
    return new Drivetrain(this.module, this.memory);
  }
}

/** The kernel of the page, once it has started. */
export let kernel: Kernel;

/** Start the module that the build put into the page. */
export async function startKernel(): Promise<Kernel> {
  const tables = { line: embeddedBytes("table-line"), elliptic: embeddedBytes("table-elliptic") };
  return (kernel = await Kernel.load(embeddedBytes("kernel"), tables));
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
  private readonly profile: number; // places and values of both wheels' friction
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
    this.profile = memory.allocateDoubles(2 * ROOM);
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
      const { at, value } = overDistance, places = this.memory.at(this.profile, 2 * at.length);
      if (at.length === 0 || at.length > ROOM || at.length !== value.length) {
        throw new Error(`the profile has ${at.length} places and ${value.length} values`);
      }
      places.set([...at, ...value]);
      const values = this.profile + places.byteLength / 2;
      this.module.track_set(this.rails, at.length, this.profile, values);
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
