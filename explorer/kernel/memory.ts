// Memory of the WebAssembly module, which its own allocator gives out. Every struct that the page
// reads or writes is a row of doubles, whose names the build lists.

import { embeddedData } from "./embedded";
import type { Fields, Functions } from "./structs";

/** The kernel's structs of doubles, by their C names. */
export type Structs = { [Name in keyof Fields]: Record<Fields[Name], number> };

/** A struct in the memory: its fields are the module's own, to read and to write. */
export type View<Name extends keyof Fields> = Structs[Name] & { readonly address: number };

/** The module; every number that a function takes or returns is an address unless it is named. */
export interface Module extends Functions {
  memory: WebAssembly.Memory;
}

const FIELDS = embeddedData("structs") as Record<keyof Fields, string[]>;
const DOUBLE = Float64Array.BYTES_PER_ELEMENT;

export class Memory {
  private doubles = new Float64Array(0);

  constructor(private readonly module: Module) {}

  /** Find the memory again where it has grown, as it may when something is allocated. */
  refresh(): void {
    const { buffer } = this.module.memory;
    if (this.doubles.buffer !== buffer) this.doubles = new Float64Array(buffer);
  }

  /** Address of new structs side by side; all their numbers are zero. */
  allocateStruct(name: keyof Fields, count = 1): number {
    return this.allocateDoubles(count * FIELDS[name].length);
  }

  /** Address of new doubles. */
  allocateDoubles(count: number): number {
    const address = this.module.new_doubles(count);
    this.refresh();
    return address;
  }

  /** A struct: a new one, or one of those that begin at an address. */
  struct<Name extends keyof Fields>(
    name: Name, first = this.allocateStruct(name), i = 0,
  ): View<Name> {
    const fields = FIELDS[name], address = first + i * fields.length * DOUBLE;
    const view = Object.defineProperty({}, "address", { value: address });
    fields.forEach((field, j) => {
      const place = address / DOUBLE + j;
      Object.defineProperty(view, field, {
        enumerable: true,
        get: () => this.doubles[place],
        set: (value: number) => (this.doubles[place] = value),
      });
    });
    return view as View<Name>;
  }

  /** The doubles at an address, to read or to write before the next call. */
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
