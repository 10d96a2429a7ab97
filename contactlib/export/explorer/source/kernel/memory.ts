// Memory of the WebAssembly module: given out from the end of its data upward and never taken back.
// The module itself says how large its structs are and where their doubles lie.

import type { Fields, Functions } from "./structs";

/** Copies of the kernel's structs of doubles. */
export type Structs = { [Name in keyof Fields]: Record<Fields[Name], number> };

const PAGE = 65536; // bytes
const DOUBLE = Float64Array.BYTES_PER_ELEMENT;

/** The module; every number that a function takes or returns is an address unless it is named. */
export interface Module extends Functions {
  memory: WebAssembly.Memory;
  __heap_base: WebAssembly.Global<"i32">;
}

export class Memory {
  private free: number;
  private doubles: Float64Array;
  private readonly sizes = new Map<string, number>(); // of structs [bytes]
  private readonly offsets = new Map<string, [string, number][]>(); // of a struct's doubles [bytes]

  constructor(private readonly module: Module) {
    this.free = module.__heap_base.value;
    this.doubles = new Float64Array(module.memory.buffer);
    for (let i = 0, name = 0; (name = module.member_name(i)) !== 0; i++) {
      const path = this.text(name).split(".");
      const struct = path[0]!, bytes = module.member_bytes(i);
      if (path.length === 1) this.sizes.set(struct, bytes);
      else this.offsets.set(struct, [...(this.offsets.get(struct) ?? []), [path.at(-1)!, bytes]]);
    }
  }

  /** Address of so many new bytes, which are zero. */
  allocate(bytes: number): number {
    const address = Math.ceil(this.free / 16) * 16;
    this.free = address + bytes;
    const { memory } = this.module, missing = this.free - memory.buffer.byteLength;
    if (missing > 0) {
      memory.grow(Math.ceil(missing / PAGE)); // which leaves the old buffer without memory
      this.doubles = new Float64Array(memory.buffer);
    }
    return address;
  }

  /** Address of a new array of doubles. */
  allocateDoubles(count: number): number {
    return this.allocate(count * DOUBLE);
  }

  /** Address of a new struct of which C alone knows the fields. */
  allocateStruct(name: string): number {
    return this.allocate(this.sizes.get(name)!);
  }

  /** A new struct of doubles. */
  struct<Name extends keyof Fields>(name: Name): Struct<Fields[Name]> {
    return this.structs(name, 1)[0]!;
  }

  /** So many of them, side by side. */
  structs<Name extends keyof Fields>(name: Name, count: number): Struct<Fields[Name]>[] {
    const size = this.sizes.get(name)!, first = this.allocate(count * size);
    return Array.from({ length: count }, (_, i) => {
      const address = first + i * size;
      const places = this.offsets.get(name)!.map(([field, offset]) => {
        return [field as Fields[Name], (address + offset) / DOUBLE] as const;
      });
      return new Struct(address, places, () => this.doubles);
    });
  }

  /** The doubles at an address, to read or to write before the next allocation. */
  at(address: number, count: number): Float64Array {
    return this.doubles.subarray(address / DOUBLE, address / DOUBLE + count);
  }

  /** The bytes at an address, likewise. */
  bytesAt(address: number, count: number): Uint8Array {
    return new Uint8Array(this.module.memory.buffer, address, count);
  }

  /** The text that ends with a zero at an address. */
  text(address: number): string {
    const rest = new Uint8Array(this.module.memory.buffer, address);
    return new TextDecoder().decode(rest.subarray(0, rest.indexOf(0)));
  }
}

/** A struct of doubles in the memory. */
export class Struct<Field extends string> {
  constructor(
    readonly address: number,
    private readonly places: (readonly [Field, number])[], // among all doubles of the memory
    private readonly doubles: () => Float64Array,
  ) {}

  /** A copy of it. */
  read(): Record<Field, number> {
    const doubles = this.doubles(), values: Partial<Record<Field, number>> = {};
    for (const [field, place] of this.places) values[field] = doubles[place]!;
    return values as Record<Field, number>;
  }

  /** Set all of its doubles; other fields of the values are passed over. */
  write(values: Record<Field, number>): void {
    const doubles = this.doubles();
    for (const [field, place] of this.places) {
      const value: unknown = values[field];
      if (typeof value !== "number") throw new Error(`${field} = ${String(value)} is not a number`);
      doubles[place] = value;
    }
  }

  /** An object whose fields are the struct's own, to read and to write now and later. */
  view(): Record<Field, number> {
    const view = {};
    for (const [field, place] of this.places) {
      Object.defineProperty(view, field, {
        enumerable: true,
        get: () => this.doubles()[place],
        set: (value: number) => (this.doubles()[place] = value),
      });
    }
    return view as Record<Field, number>;
  }
}
