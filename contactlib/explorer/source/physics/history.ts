/** Names of a row's values: time [s], creepage [1], drive torque [N.m], creep force [N], speed
 * [m/s], friction factor of the rail [1], rate of the creepage [1/s]. */
export const COLUMNS = [
  "time", "creepage", "drive_torque", "creep_force", "speed", "friction", "creepage_rate",
] as const;
export type Column = (typeof COLUMNS)[number];

/** Values of one moment. */
export type Row = Record<Column, number>;

/** Columns of the same length. */
export type Columns = Record<Column, Float64Array>;

/** The last rows of a run, oldest first; beyond the capacity the oldest go.
 *
 * Every row is written twice, a capacity apart, so the rows that are kept always stand side by side
 * in memory: a window of them is a view of each column, without a copy.
 */
export class History {
  readonly capacity: number;
  private readonly columns: Columns;
  private written = 0;

  /** Keep this many rows. */
  constructor(capacity: number) {
    this.capacity = capacity;
    this.columns = ofEach(() => new Float64Array(2 * capacity));
  }

  /** Number of rows that are kept. */
  get length(): number {
    return Math.min(this.written, this.capacity);
  }

  /** Add a row; its time is not before that of the last one. */
  append(row: Row): void {
    const at = this.written++ % this.capacity;
    for (const name of COLUMNS) {
      const column = this.columns[name];
      column[at] = column[at + this.capacity] = row[name];
    }
  }

  /** Forget all rows. */
  clear(): void {
    this.written = 0;
  }

  /** The last row before a time [s] and all from it on; valid until the next row is added. */
  window(from = -Infinity): Columns {
    const end = this.end();
    const first = end - this.length;
    const time = this.columns.time;
    let low = first;
    let high = end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle]! < from) low = middle + 1;
      else high = middle;
    }
    const start = Math.max(low - 1, first);
    return ofEach((name) => this.columns[name].subarray(start, end));
  }

  /** Where the second copy of the last row ends, or the first until there is a second. */
  private end(): number {
    if (this.written <= this.capacity) return this.written;
    return ((this.written - 1) % this.capacity) + 1 + this.capacity;
  }
}

function ofEach(value: (name: Column) => Float64Array): Columns {
  return Object.fromEntries(COLUMNS.map((name) => [name, value(name)])) as Columns;
}
