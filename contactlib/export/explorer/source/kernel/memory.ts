// Memory of the WebAssembly module: given out from the end of its data upward and never taken back.
// The module itself says how large its structs are and where their doubles lie.

import type { Fields, Functions } from "./structs";

/** The kernel's structs of doubles, by their C names. */
export type Structs = { [Name in keyof Fields]: Record<Fields[Name], number> };

/** A struct in the memory: its fields are the module's own, to read and to write. */
export type View<Name extends keyof Fields> = Structs[Name] & { readonly address: number };

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

  /** Address of a new struct, or of some side by side. */
  allocateStruct(name: string, count = 1): number {
    return this.allocate(count * this.sizes.get(name)!);
  }

  /** A struct of doubles: a new one, or one of those that begin at an address. */
  struct<Name extends keyof Fields>(
    name: Name, first = this.allocateStruct(name), i = 0,
  ): View<Name> {
    const address = first + i * this.sizes.get(name)!;
    const view = Object.defineProperty({}, "address", { value: address });
    for (const [field, offset] of this.offsets.get(name)!) {
      const place = (address + offset) / DOUBLE; // among all doubles of the memory
      Object.defineProperty(view, field, {
        enumerable: true,
        get: () => this.doubles[place],
        set: (value: number) => (this.doubles[place] = value),
      });
    }
    return view as View<Name>;
  }

  /** The doubles at an address, to read or to write before the next allocation. */
  at(address: number, count: number): Float64Array {
    return this.doubles.subarray(address / DOUBLE, address / DOUBLE + count);
  }

  /** The bytes at an address, likewise. */
  bytesAt(address: number, count?: number): Uint8Array {
    return new Uint8Array(this.module.memory.buffer, address, count);
  }

  /** The text that ends with a zero at an address. */
  text(address: number): string {
    const rest = this.bytesAt(address);
    return new TextDecoder().decode(rest.subarray(0, rest.indexOf(0)));
  }
}

/** Set all doubles of a struct; other fields of the values are passed over. */
export function fill<Name extends keyof Fields>(struct: View<Name>, values: Structs[Name]): void {
  for (const field of Object.keys(struct) as Fields[Name][]) {
    const value: unknown = values[field];
    if (typeof value !== "number") throw new Error(`${field} = ${String(value)} is not a number`);
    (struct as Structs[Name])[field] = value as Structs[Name][Fields[Name]];
  }
}
