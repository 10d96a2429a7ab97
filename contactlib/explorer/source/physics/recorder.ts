import { COLUMNS, History, type Row } from "./history";

/** The rows of now and of the moment before, and the history of those that are kept. */
export class Recorder {
  readonly history: History;
  interval = 2e-3; // simulated time between rows [s]
  now = emptyRow();
  private before = emptyRow();
  private nowKept = false;
  private beforeKept = false;
  private due = 0; // time of the next row [s]

  constructor(rows: number) {
    this.history = new History(rows);
  }

  /** Forget all. */
  clear(): void {
    this.history.clear();
    this.due = 0;
    this.nowKept = this.beforeKept = true;
  }

  /** Make room for the next moment; `now` is to be filled anew. */
  next(): Row {
    [this.before, this.now] = [this.now, this.before];
    this.beforeKept = this.nowKept;
    this.nowKept = false;
    return this.now;
  }

  /** Keep the row of now if it is due, within a time [s]. */
  keepIfDue(slack: number): void {
    if (this.now.time >= this.due - slack) this.keep();
  }

  /** Keep the row of now and the one before: what lies between is a jump to be seen. */
  keepBoth(): void {
    if (!this.beforeKept) this.history.append(this.before);
    this.beforeKept = true;
    this.keep();
  }

  private keep(): void {
    if (!this.nowKept) this.history.append(this.now);
    this.nowKept = true;
    this.due = this.now.time + this.interval;
  }
}

function emptyRow(): Row {
  return Object.fromEntries(COLUMNS.map((name) => [name, 0])) as Row;
}
