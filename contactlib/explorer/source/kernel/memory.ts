// Memory of the WebAssembly module: given out from the end of its data upward and never taken back.

const PAGE = 65536; // bytes

export class Memory {
  private free: number;
  private doubles: Float64Array;

  constructor(
    private readonly memory: WebAssembly.Memory,
    heapBase: number,
  ) {
    this.free = heapBase;
    this.doubles = new Float64Array(memory.buffer);
  }

  /** Address of so many new bytes, which are zero. */
  allocate(bytes: number): number {
    const address = Math.ceil(this.free / 16) * 16;
    this.free = address + bytes;
    const missing = this.free - this.memory.buffer.byteLength;
    if (missing > 0) {
      this.memory.grow(Math.ceil(missing / PAGE)); // it leaves the old buffer without memory
      this.doubles = new Float64Array(this.memory.buffer);
    }
    return address;
  }

  /** Address of new room for the doubles of a struct. */
  allocateDoubles(count: number): number {
    return this.allocate(count * Float64Array.BYTES_PER_ELEMENT);
  }

  /** The doubles at an address, to read or to write before the next allocation. */
  at(address: number, count: number): Float64Array {
    const first = address / Float64Array.BYTES_PER_ELEMENT;
    return this.doubles.subarray(first, first + count);
  }

  /** The bytes at an address, likewise. */
  bytesAt(address: number, count: number): Uint8Array {
    return new Uint8Array(this.memory.buffer, address, count);
  }

  /** A copy of the struct of doubles at an address. */
  read<T>(address: number, fields: readonly (keyof T & string)[]): T {
    const first = address / Float64Array.BYTES_PER_ELEMENT;
    const struct: Record<string, number> = {};
    for (let i = 0; i < fields.length; i++) struct[fields[i]!] = this.doubles[first + i]!;
    return struct as T;
  }

  /** Put a struct of doubles at an address. */
  write<T>(address: number, fields: readonly (keyof T & string)[], struct: T): void {
    const first = address / Float64Array.BYTES_PER_ELEMENT;
    for (let i = 0; i < fields.length; i++) {
      const value = struct[fields[i]!];
      if (typeof value !== "number") {
        throw new Error(`${fields[i]} = ${String(value)} is not a number`);
      }
      this.doubles[first + i] = value;
    }
  }

  /** An object whose fields are the doubles at an address, now and later. */
  view<T extends object>(address: number, fields: readonly (keyof T & string)[]): T {
    const first = address / Float64Array.BYTES_PER_ELEMENT;
    const view = {};
    fields.forEach((name, i) => {
      Object.defineProperty(view, name, {
        enumerable: true,
        get: () => this.doubles[first + i],
        set: (value: number) => {
          this.doubles[first + i] = value;
        },
      });
    });
    return view as T;
  }

  /** The text that ends with a zero at an address. */
  text(address: number): string {
    const rest = new Uint8Array(this.memory.buffer, address);
    return new TextDecoder().decode(rest.subarray(0, rest.indexOf(0)));
  }
}
