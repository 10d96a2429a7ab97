/** What a run keeps: moments, rows of its history, and events. */

/** Columns of the history: time [s], creepage [1], drive torque [N.m], creep force [N], speed
 * [m/s], factor on the rail's friction [1], rate of the creepage [1/s]. */
export const COLUMNS = [
  "time", "creepage", "drive_torque", "creep_force", "speed", "friction", "creepage_rate",
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
 * Every row is written twice, a capacity apart, so the rows that are kept always stand side by side
 * in memory: a window of them is a view of each column, without a copy.
 */
export class History {
  private readonly columns: Columns;
  private written = 0;

  constructor(readonly capacity: number) {
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

  /** Drop all rows. */
  clear(): void {
    this.written = 0;
  }

  /** The last row before a time [s] and all from it on; valid until the next row is added. */
  window(from = -Infinity): Columns {
    const { written, capacity } = this;
    // The second copy of the last row ends here, or the first while there is no second.
    const end = written <= capacity ? written : ((written - 1) % capacity) + 1 + capacity;
    const first = end - this.length, { time } = this.columns;
    let low = first, high = end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle]! < from) low = middle + 1;
      else high = middle;
    }
    const start = Math.max(low - 1, first);
    return ofEach((name) => this.columns[name].subarray(start, end));
  }
}

/** The state at one moment: its row follows from it and the parameters. */
export type Moment = Pick<Row, "time" | "creepage" | "drive_torque" | "speed" | "friction">;

interface Slot {
  readonly moment: Moment;
  row?: Row; // evaluated at the first use
  kept?: boolean; // in the history
}

/**
 * The present moment, the one before, and the history. A row costs more than a sample of the run,
 * so it is evaluated only where it is wanted.
 */
export class Recorder {
  readonly history: History;
  interval = 2e-3; // simulated time between rows [s]
  private now!: Slot;
  private before: Slot | null = null;
  private last = -Infinity; // time of the last row that was kept [s]

  constructor(rows: number, private readonly evaluate: (moment: Moment) => Row) {
    this.history = new History(rows);
  }

  get moment(): Moment {
    return this.now.moment;
  }

  /** The present row. */
  get row(): Row {
    return this.rowOf(this.now);
  }

  /** Begin again with this moment. */
  start(moment: Moment): void {
    this.history.clear();
    this.now = { moment };
    this.before = null;
    this.keep(this.now);
  }

  next(moment: Moment): void {
    [this.before, this.now] = [this.now, { moment }];
  }

  /** Keep the present row if it is due within a time [s]. */
  keepIfDue(slack: number): void {
    if (this.moment.time - this.last >= this.interval - slack) this.keep(this.now);
  }

  /** Keep the present row and the one before, so that a jump between them can be seen. */
  keepBoth(): void {
    if (this.before !== null) this.keep(this.before);
    this.keep(this.now);
  }

  private rowOf(slot: Slot): Row {
    return (slot.row ??= this.evaluate(slot.moment));
  }

  private keep(slot: Slot): void {
    if (slot.kept) return;
    this.history.append(this.rowOf(slot));
    slot.kept = true;
    this.last = slot.moment.time;
  }
}

/** Something that happened in a run: when [s], at what creepage [1] and drive torque [N.m]. */
export interface RunEvent {
  name: "peak_passed" | "slip_away" | "returned" | "patch_begins" | "patch_ends";
  time: number;
  creepage: number;
  drive_torque: number;
}

/** Finds from the creepage when it passes the fold, slips away, and comes back. */
export class Watch {
  private fold = Infinity;
  private away = Infinity;
  private passed = false;
  private slipped = false;

  /** Creepages of the fold (infinite: none) and of slip-away, and the present one [1]. A creepage
   * that already lies beyond them does not count as passing them. */
  set(fold: number, away: number, creepage: number): void {
    this.fold = fold;
    this.away = away;
    this.passed = creepage >= fold;
    this.slipped = creepage >= away;
  }

  /** Events at the next creepage. */
  next(creepage: number): RunEvent["name"][] {
    const found: RunEvent["name"][] = [];
    if (!this.passed && creepage >= this.fold) {
      this.passed = true;
      found.push("peak_passed");
    }
    if (!this.slipped && creepage >= this.away) {
      this.slipped = true;
      found.push("slip_away");
    }
    if ((this.passed || this.slipped) && creepage < Math.min(this.fold, this.away)) {
      this.passed = this.slipped = false;
      found.push("returned");
    }
    return found;
  }
}
