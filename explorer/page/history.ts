/* Time histories: the creepage, or of a wheel that stands the displacement of its rim, and below it
 * the drive torque and the contact's part of it. */

import { Chart, View } from "./chart";
import { digits, percent } from "./format";
import type { Pen } from "./pen";
import { type Moment, roundUp } from "./picture";

const micro = (way: number): string => `${digits(1e6 * way)} \u00b5m`;
const seconds = (v: number): string => `${Number(v.toPrecision(7))}`;

export class TimeHistory extends View {
  private readonly creepage: Chart;
  private readonly displacement: Chart;

  constructor(place: HTMLElement) {
    super(place, {
      x: { label: "time  [s]", space: 70, values: seconds },
      y: { label: "T  [kN m]", per: 1e-3, size: 48 },
      curves: [{ colour: "torque", width: 2 }, { colour: "trail", width: 1.8, dash: [5, 3] }],
    }, place.querySelector<HTMLElement>(".torque")!);
    this.creepage = new Chart(place.querySelector<HTMLElement>(".creepage")!, {
      x: { label: "", hidden: true, size: 8, values: seconds },
      y: { label: "\u03b6  [%]", per: 100, log: true, size: 48 },
      curves: [{ colour: "ink", width: 2 }],
    });
    this.displacement = new Chart(place.querySelector<HTMLElement>(".displacement")!, {
      x: { label: "", hidden: true, size: 8, values: seconds },
      y: { label: "rim  [\u00b5m]", per: 1e6, size: 48 },
      curves: [{ colour: "ink", width: 2 }],
    });
  }

  override repaint(): void {
    super.repaint();
    this.creepage.repaint();
    this.displacement.repaint();
  }

  describe({ run, span }: Moment): string {
    const { creepage, displacement } = run.history.window(run.now.time - span);
    if (run.motion.stands) {
      return `Displacement of the rim and torque over the last ${digits(span, 2)} s: between ` +
        `${micro(Math.min(...displacement))} and ${micro(Math.max(...displacement))}.`;
    }
    return `Creepage and torque over the last ${digits(span, 2)} s: the creepage went from ` +
      `${percent(creepage[0] ?? 0)} to ${percent(run.now.creepage)}.`;
  }

  draw({ run, shown, span }: Moment): void {
    const { stands } = run.motion;
    const { time, creepage, displacement, ...rows } = run.history.window(run.now.time - span);
    const window: [number, number] = [Math.max(0, run.now.time - span), Math.max(run.now.time, span)];
    const [lowest, end] = shown.ends, { fold, largest: { torque: critical } } = shown;
    // The torque less its part that changes the creepage: T - (J V/r) dzeta/dt.
    const drive = rows.drive_torque, taken = drive.map((torque, i) =>
      torque - rows.creepage_rate[i]! / shown.plant.gain(rows.speed[i]!));
    let largest = end / 1.05, low = Infinity, high = -Infinity;
    for (let i = 0; i < time.length; i++) {
      largest = Math.max(largest, creepage[i]!);
      low = Math.min(low, drive[i]!, stands || rows.friction[i]! < 1 ? taken[i]! : Infinity);
      high = Math.max(high, drive[i]!);
    }
    this.place.parentElement!.classList.toggle("stands", stands);
    // The axis grows and shrinks with what it shows.
    if (stands) {
      const way = roundUp(1.05 * displacement.reduce((a, b) => Math.max(a, Math.abs(b)), 1e-6));
      this.displacement.show([time, displacement], window, [Math.min(...displacement) < 0 ? -way : 0, way]);
    } else {
      this.creepage.show([time, creepage.map((z) => Math.max(z, 1e-3 * lowest))], window,
        [lowest, roundUp(1.05 * largest)]);
    }
    const bottom = Math.min(0.72 * critical, low - 0.03 * high);
    const top = Math.max(1.1 * critical, high + 0.1 * (high - bottom));
    this.chart.show([time, drive, taken], window, [bottom, top]);
    const draw = (chart: Chart, text: string, at: number | undefined): void => chart.draw((pen) => {
      this.wet(pen, time, rows.friction);
      if (at === undefined) return;
      pen.rule("up", at, "line", 1.2, [4, 4]);
      pen.nameLine(text, at, "soft");
    });
    draw(this.creepage, "fold", fold?.creepage);
    draw(this.chart, `critical ${digits(1e-3 * critical, 4)}`, fold?.drive_torque);
  }

  private wet(pen: Pen, time: Float64Array, friction: Float64Array): void {
    let from: number | null = null;
    for (let i = 0; i < time.length; i++) {
      const is = friction[i]! < 1;
      if (is) from ??= time[i]!;
      if (from !== null && (!is || i === time.length - 1)) {
        pen.band(from, time[i]!, "wet");
        from = null;
      }
    }
  }
}
