import { History, type Row } from "./history";

/** The state at one moment: from it and the parameters follows its row. */
export interface Moment {
  time: number; // [s]
  omega: number; // [rad/s]
  speed: number; // [m/s]
  creepage: number; // [1]
  friction: number; // factor on the rail's [1]
  drive_torque: number; // [N.m]
}

interface Slot {
  readonly moment: Moment;
  row: Row | null; // once it was asked for
  kept: boolean; // in the history
}

/**
 * The moment of now and the one before, and the history of those that are kept. A row costs more
 * than a sample of the run, so it is evaluated only where it is wanted.
 */
export class Recorder {
  readonly history: History;
  interval = 2e-3; // simulated time between rows [s]
  private now = emptySlot();
  private before = emptySlot();
  private last = -Infinity; // time of the last row that was kept [s]

  constructor(
    rows: number,
    private readonly evaluate: (moment: Moment) => Row,
  ) {
    this.history = new History(rows);
  }

  get moment(): Moment {
    return this.now.moment;
  }

  /** The row of now. */
  get row(): Row {
    return (this.now.row ??= this.evaluate(this.now.moment));
  }

  /** Forget all. */
  clear(): void {
    this.history.clear();
    this.last = -Infinity;
    this.now.kept = this.before.kept = true;
  }

  /** Begin the next moment, which the caller fills in. */
  next(): Moment {
    [this.before, this.now] = [this.now, this.before];
    this.now.row = null;
    this.now.kept = false;
    return this.now.moment;
  }

  /** Keep the row of now if it is due within a time [s]. */
  keepIfDue(slack: number): void {
    if (this.moment.time - this.last >= this.interval - slack) this.keep(this.now);
  }

  /** Keep the rows of now and of the moment before: what lies between is a jump to be seen. */
  keepBoth(): void {
    this.keep(this.before);
    this.keep(this.now);
  }

  private keep(slot: Slot): void {
    if (slot.kept) return;
    this.history.append((slot.row ??= this.evaluate(slot.moment)));
    slot.kept = true;
    this.last = slot.moment.time;
  }
}

function emptySlot(): Slot {
  const moment = { time: 0, omega: 0, speed: 0, creepage: 0, friction: 1, drive_torque: 0 };
  return { moment, row: null, kept: true };
}
