/** Something that happened in a run: when [s], at what creepage [1] and drive torque [N.m]. */
export interface RunEvent {
  name: "peak_passed" | "slip_away" | "returned" | "patch_begins" | "patch_ends";
  time: number;
  creepage: number;
  drive_torque: number;
}

/** Tells from the creepage when it passes the peak, slips away, and comes back. */
export class Watch {
  private fold = Infinity;
  private away = Infinity;
  private passed = false;
  private slipped = false;

  /** Creepages of the fold (infinite: none) and of slip-away, and the one that is there now [1].
   * A creepage that lies beyond them now did not pass them. */
  set(fold: number, away: number, creepage: number): void {
    this.fold = fold;
    this.away = away;
    this.passed = creepage >= fold;
    this.slipped = creepage >= away;
  }

  /** What the next creepage says. */
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
