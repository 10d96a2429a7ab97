// The kernel: the same C that Python and the FMUs run, as a WebAssembly module. This and memory.ts
// alone touch the module's memory; who calls the module's functions gets the addresses of what they
// read and fill here. Nothing is checked but tables.

import { embeddedBytes } from "./embedded";
import { fill, Memory, type Module, type Structs, type View } from "./memory";
import type { Fields } from "./structs";

export type { Structs } from "./memory";

/** Shape of the contact, which has its own table. */
export type Contact = "line" | "elliptic";

/** A point of steady creep. */
export type Point = Structs["creep_point"];

/** A wet stretch of the rail [m], and the factor on friction there [1]; the rest is dry. */
export interface Patch {
  begins: number;
  ends: number;
  friction: number;
}

/** Fills points, for creepages at an address, or finds some and returns their number. */
type PointsCall = (to: number, room: number, creepage: number) => number | void;

const ROOM = 512; // points of a curve at most

/** The kernel with both tables. */
export class Kernel {
  /** Addresses of the tables of the Carter-Griffith law, which the kernel has checked. */
  readonly tables: Record<Contact, number>;
  private readonly structs = new Map<string, unknown>(); // of one call
  private readonly places: View<"creep_point">[];
  private readonly doubles: number;

  private constructor(
    readonly module: Module,
    readonly memory: Memory,
    tables: Record<Contact, Uint8Array>,
  ) {
    this.tables = { line: this.open(tables.line), elliptic: this.open(tables.elliptic) };
    const first = memory.allocateStruct("creep_point", ROOM);
    this.places = Array.from({ length: ROOM }, (_, i) => memory.struct("creep_point", first, i));
    this.doubles = memory.allocateDoubles(ROOM);
  }

  /** Start the module; each table is a packed table file's bytes. */
  static async load(wasm: BufferSource, tables: Record<Contact, Uint8Array>): Promise<Kernel> {
    const { instance } = await WebAssembly.instantiate(wasm);
    const module = instance.exports as unknown as Module;
    return new Kernel(module, new Memory(module), tables);
  }

  private open(packed: Uint8Array): number {
    const bytes = this.memory.allocateDoubles(Math.ceil(packed.length / 8)), address = this.module.new_table();
    this.memory.bytesAt(bytes, packed.length).set(packed);
    const error = this.module.open_packed_table(address, bytes, packed.length);
    this.memory.refresh();
    if (error !== 0) throw new Error(this.memory.text(error));
    return address;
  }

  /** The struct of that name which calls share. */
  shared<Name extends keyof Fields>(name: Name): View<Name> {
    const found = this.structs.get(name) ?? this.memory.struct(name);
    this.structs.set(name, found);
    return found as View<Name>;
  }

  /** Address of the struct that calls share, after these values have been written to it. */
  given<Name extends keyof Fields>(name: Name, values: Structs[Name]): number {
    const struct = this.shared(name);
    fill(struct, values);
    return struct.address;
  }

  /** The struct that a C function fills at an address. */
  filled<Name extends keyof Fields>(name: Name, call: (address: number) => void): Structs[Name] {
    const struct = this.shared(name);
    call(struct.address);
    return { ...struct };
  }

  /** The points that a C function fills at an address for some creepages [1], or as many as it
   * finds and returns the number of. */
  points(call: PointsCall, creepage?: ArrayLike<number>): Point[] {
    return this.places.slice(0, this.fillPoints(call, creepage)).map((point) => ({ ...point }));
  }

  /** The same, as an array for each of their numbers. */
  columns(call: PointsCall, creepage: ArrayLike<number>): Record<keyof Point, Float64Array> {
    const count = this.fillPoints(call, creepage), names = Object.keys(this.places[0]!);
    const rows = this.memory.at(this.places[0]!.address, count * names.length);
    const column = (j: number): Float64Array =>
      new Float64Array(count).map((_, i) => rows[i * names.length + j]!);
    return Object.fromEntries(names.map((name, j) => [name, column(j)])) as
      Record<keyof Point, Float64Array>;
  }

  private fillPoints(call: PointsCall, creepage: ArrayLike<number> = []): number {
    this.memory.at(this.doubles, creepage.length).set(creepage);
    return call(this.places[0]!.address, ROOM, this.doubles) ?? creepage.length;
  }

  /** Semi-axes along and across rolling [m] by Hertz, from radii [m] and P/(pi E*) [m2]. */
  semiAxes(radiusX: number, radiusY: number, compliance: number): [number, number] {
    this.module.hertz_semi_axes(radiusX, radiusY, compliance, this.doubles);
    const [a, b] = this.memory.at(this.doubles, 2);
    return [a!, b!];
  }
}

/** The kernel of the page, once it has started. */
export let kernel: Kernel;

/** Start the module that the command put into the page. */
export async function startKernel(): Promise<Kernel> {
  const [wasm, line, elliptic] =
    await Promise.all(["kernel", "table-line", "table-elliptic"].map(embeddedBytes));
  return (kernel = await Kernel.load(wasm!, { line: line!, elliptic: elliptic! }));
}

/** One drivetrain of the kernel, stepped in time; its memory stays in use for good. */
export class Drivetrain {
  private readonly module = kernel.module;
  private readonly train = this.module.new_train(); // before what follows, which finds its memory
  /** What is held over a step. */
  readonly input = kernel.memory.struct("drivetrain_input");
  /** What is stepped. */
  readonly state = kernel.memory.struct("drivetrain_state");

  /** Take these parameters from now on; the state stays. */
  configure(
    table: number,
    contact: Structs["force_element_parameters"],
    parameters: Structs["drivetrain_parameters"],
  ): void {
    this.module.train_configure(this.train, table, kernel.given("force_element_parameters", contact),
      kernel.given("drivetrain_parameters", parameters));
  }

  /** Place a patch in place of one that is there; null: the input alone sets the friction. */
  placePatch(patch: Patch | null): void {
    const { begins, ends, friction } = patch ?? { begins: 0, ends: 0, friction: 1 };
    this.module.train_lay_patch(this.train, begins, ends, friction);
  }

  /** Step from a time on [s], to a relative tolerance [1]; an Error if that is not met. */
  advance(time: number, step: number, tolerance = 1e-6): void {
    const failed = this.module.train_advance(
      this.train, this.input.address, this.state.address, time, step, tolerance);
    if (failed !== 0) {
      throw new Error("the tolerance is not met within the largest number of substeps");
    }
  }

  /** Let contacts with memory have rolled steadily at the present creepage. */
  settle(): void {
    this.module.train_settle(this.train, this.input.address, this.state.address);
  }

  /** Forces, creepages and energies at the state under the input. */
  output(): Structs["drivetrain_output"] {
    return kernel.filled("drivetrain_output", (to) =>
      this.module.train_evaluate(this.train, this.input.address, this.state.address, to));
  }

  /**
   * Move on from a row under held inputs until the creepage passes base + slope times the speed; null
   * if it does not within a time [s], or before the vehicle stands.
   */
  pass(
    from: Partial<Structs["run_row"]>, held: Structs["run_input"], base: number, slope: number,
    longest: number,
  ): Structs["run_row"] | null {
    const row = kernel.shared("run_row");
    for (const name of Object.keys(row) as (keyof Structs["run_row"])[]) row[name] = from[name] ?? 0;
    const passed = this.module.train_pass(
      this.train, kernel.given("run_input", held), base, slope, longest, 1e-9, row.address);
    kernel.memory.refresh();
    return passed === 0 ? null : { ...row };
  }
}
