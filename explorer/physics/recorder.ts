/** What a run keeps: rows of its history, and events. */

/** Columns of the history: time [s], creepage [1], drive torque [N.m], creep force [N], speed
 * [m/s], factor on the rail's friction [1], rate of the creepage [1/s], displacement of the rim against
 * the rail since the start [m]. */
export const COLUMNS = [
  "time", "creepage", "drive_torque", "creep_force", "speed", "friction", "creepage_rate",
  "displacement",
] as const;
export type Column = (typeof COLUMNS)[number];
type Columns = Record<Column, Float64Array>;

/** Values of one moment. */
export type Row = Record<Column, number>;

function ofEach(value: (name: Column) => Float64Array): Columns {
  return Object.fromEntries(COLUMNS.map((name) => [name, value(name)])) as Columns;
}

/** The last rows of a run, oldest first; beyond the capacity the oldest are dropped.
 *
 * There is room for twice as many, so that the last ones move to the front only once in a while.
 */
export class History {
  private readonly columns: Columns;
  private end = 0;

  constructor(private readonly capacity: number) {
    this.columns = ofEach(() => new Float64Array(2 * capacity));
  }

  /** Add a row; its time is not before that of the last one. */
  append(row: Row): void {
    if (this.end === 2 * this.capacity) {
      for (const name of COLUMNS) this.columns[name].copyWithin(0, this.capacity);
      this.end = this.capacity;
    }
    for (const name of COLUMNS) this.columns[name][this.end] = row[name];
    this.end++;
  }

  /** Drop all rows. */
  clear(): void {
    this.end = 0;
  }

  /** The last row before a time [s] and all from it on; valid until the next row is added. */
  window(from = -Infinity): Columns {
    const first = Math.max(this.end - this.capacity, 0), { time } = this.columns;
    let low = first, high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle]! < from) low = middle + 1;
      else high = middle;
    }
    const start = Math.max(low - 1, first);
    return ofEach((name) => this.columns[name].subarray(start, this.end));
  }
}

/** Something that happened in a run: when [s], at what creepage [1] and drive torque [N.m]. */
export interface RunEvent extends Pick<Row, "time" | "creepage" | "drive_torque"> {
  name: "peak_passed" | "slip_away" | "returned" | "patch_begins" | "patch_ends";
}

/** Finds from the creepage when it passes the fold, slips away, and re-adheres. */
export class Watch {
  private levels: ["peak_passed" | "slip_away", number][] = [];
  private readonly passed = new Set<string>();

  /** Creepages of the fold (infinite: none) and of slip-away, and the present one [1]. A creepage
   * that already lies beyond them does not count as passing them. */
  set(fold: number, away: number, creepage: number): void {
    this.levels = [["peak_passed", fold], ["slip_away", away]];
    this.passed.clear();
    this.next(creepage);
  }

  /** Events at the next creepage. */
  next(creepage: number): RunEvent["name"][] {
    const beyond = this.levels.filter(([, level]) => creepage >= level).map(([name]) => name);
    if (beyond.length === 0 && this.passed.size > 0) {
      this.passed.clear();
      return ["returned"];
    }
    const found = beyond.filter((name) => !this.passed.has(name));
    for (const name of found) this.passed.add(name);
    return found;
  }
}
