/* Time histories: the creepage, and below it the drive torque and the contact's part of it. */

import { Chart, View } from "./chart";
import { digits, percent } from "./format";
import type { Pen } from "./pen";
import { type Moment, roundUp } from "./picture";

const seconds = (v: number): string => `${Number(v.toPrecision(7))}`;

export class TimeHistory extends View {
  private readonly creepage: Chart;

  constructor(place: HTMLElement) {
    super(place, {
      x: { label: "time  [s]", space: 70, values: seconds },
      y: { label: "T  [kN m]", size: 48 },
      curves: [{ colour: "torque", width: 2 }, { colour: "trail", width: 1.8, dash: [5, 3] }],
    }, place.querySelector<HTMLElement>(".torque")!);
    this.creepage = new Chart(place.querySelector<HTMLElement>(".creepage")!, {
      x: { label: "", hidden: true, size: 8, values: seconds },
      y: { label: "\u03b6  [%]", log: true, size: 48 },
      curves: [{ colour: "ink", width: 2 }],
    });
  }

  override repaint(): void {
    super.repaint();
    this.creepage.repaint();
  }

  describe({ run, span }: Moment): string {
    const { creepage } = run.history.window(run.now.time - span);
    return `Creepage and torque over the last ${digits(span, 2)} s: the creepage went from ` +
      `${percent(creepage[0] ?? 0)} to ${percent(run.now.creepage)}.`;
  }

  draw({ run, shown, span }: Moment): void {
    const rows = run.history.window(run.now.time - span);
    const window: [number, number] = [Math.max(0, run.now.time - span), Math.max(run.now.time, span)];
    const [least, end] = shown.ends;
    const creepage = rows.creepage.map((z) => 100 * Math.max(z, 1e-3 * least));
    let most = 100 * end / 1.05, low = Infinity, high = -Infinity;
    const drive = rows.drive_torque.map((v) => 1e-3 * v);
    // The torque less its part that changes the creepage: T - (J V/r) dzeta/dt.
    const taken = rows.creepage_rate.map((rate, i) =>
      (drive[i] as number) - (1e-3 * rate) / shown.plant.gain(rows.speed[i] as number));
    for (let i = 0; i < creepage.length; i++) {
      most = Math.max(most, creepage[i] as number);
      low = Math.min(low, drive[i] as number);
      if ((rows.friction[i] as number) < 1) low = Math.min(low, taken[i] as number);
      high = Math.max(high, drive[i] as number);
    }
    // The axis grows and shrinks with what it shows.
    this.creepage.show([rows.time, creepage], window, [100 * least, roundUp(1.05 * most)]);
    const bottom = Math.min(0.72e-3 * shown.most.torque, low - 0.03 * high);
    const top = Math.max(1.1e-3 * shown.most.torque, high + 0.1 * (high - bottom));
    this.chart.show([rows.time, drive, taken], window, [bottom, top]);
    const wet = (chart: Chart, paint: (pen: Pen) => void): void =>
      chart.draw((pen) => {
        this.wet(pen, rows.time, rows.friction);
        paint(pen);
      });
    wet(this.creepage, (pen) => {
      if (shown.fold !== null) {
        pen.rule("up", 100 * shown.fold.creepage, "line", 1.2, [4, 4]);
        pen.words("fold", pen.width - 5, pen.up(100 * shown.fold.creepage) - 9, "soft", "right");
      }
    });
    wet(this.chart, (pen) => {
      if (shown.fold !== null) {
        const at = 1e-3 * shown.fold.drive_torque;
        pen.rule("up", at, "line", 1.2, [4, 4]);
        pen.words(`critical ${digits(at, 4)}`, pen.width - 5, pen.up(at) - 9, "soft", "right");
      }
    });
  }

  private wet(pen: Pen, time: Float64Array, friction: Float64Array): void {
    let from: number | null = null;
    for (let i = 0; i < time.length; i++) {
      const is = (friction[i] as number) < 1;
      if (is && from === null) from = time[i] as number;
      if (from !== null && (!is || i === time.length - 1)) {
        pen.band(from, Math.max(time[i] as number, from), "wet");
        from = null;
      }
    }
  }
}
