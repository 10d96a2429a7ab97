/* Phase portrait: the rate of the creepage over the creepage, at the present torque and speed. */

import type { Curves } from "../physics/plant";
import { isStable } from "../physics/stability";
import { View } from "./chart";
import { digits, percent } from "./format";
import { type Pen, trail } from "./pen";
import { type Moment, type Picture, POINTS, TRAILED } from "./picture";

const ARROWS = 13; // along the axis

export class PhasePortrait extends View {
  private wet = false; // whether the range is that of the wet curve

  constructor(place: HTMLElement) {
    super(place, {
      x: { label: "creepage \u03b6  [%]", per: 100 },
      y: { label: "d\u03b6/dt  [%/s]", per: 100, size: 48 },
      curves: [],
    });
  }

  override show({ plant, speed, largest: { torque }, wet, axes: { horizon } }: Picture): void {
    const perTorque = plant.gain(speed), reach = perTorque * torque;
    const left = torque - (wet?.torque[POINTS - 1] ?? torque); // more than the wet rail takes
    const top = Math.max(0.17 * reach, this.wet ? 1.1 * perTorque * left : 0);
    this.chart.show([[0, 1]], [0, horizon], [-0.11 * reach, top]);
  }

  describe({ run, rests }: Moment): string {
    const states = rests.map((state) =>
      `${percent(state.creepage)}, ${isStable(state) ? "stable" : "unstable"}`);
    return `Rate of the creepage over the creepage. At this torque it rests at: ` +
      `${states.join("; ") || "none"}. Now it changes by ${digits(100 * run.now.creepage_rate)} % a second.`;
  }

  draw(moment: Moment): void {
    const { run, shown, rests, span } = moment, { onPatch } = run.motion;
    if (this.wet !== onPatch) {
      this.wet = onPatch;
      this.show(shown);
    }
    this.chart.draw((pen) => {
      const curves = onPatch && shown.wet !== null ? shown.wet : shown.dry;
      const border = rests.find((state) => !isStable(state) && state.creepage > 0);
      if (border !== undefined && moment.control.mode === "torque") {
        pen.band(0, border.creepage, "shade");
      }
      pen.rule("up", 0, "soft", 1.2);
      this.flow(pen, moment, curves);
      const past = trail(run.history, "creepage", "creepage_rate", run.now.time - TRAILED * span);
      pen.line(past, "trail", 1.4);
      const { mode, delay } = moment.control;
      if (mode === "torque") this.rests(pen, moment);
      else pen.words(delay > 0 ? "with the control, without its delay" : "with the control",
        pen.width - 5, 10, "soft", "right");
      pen.wheel(run.now.creepage, run.now.creepage_rate, "ink", percent(run.now.creepage));
    });
  }

  /** The curve that the wheel follows, solid where small changes decay; arrows along the axis. */
  private flow(pen: Pen, { run, shown }: Moment, curves: Curves): void {
    const gain = shown.plant.gain(shown.speed);
    const flow = Array.from(curves.creepage, (zeta, i): [number, number] =>
      [zeta, gain * (run.torqueAt(zeta) - curves.torque[i]!)]);
    const falls = (i: number): boolean => flow[i]![1] <= flow[i - 1]![1];
    for (let from = 0, i = 1; i < flow.length; i++) {
      if (i + 1 < flow.length && falls(i) === falls(i + 1)) continue;
      const part = flow.slice(from, i + 1);
      pen.line(part, falls(i) ? "stable" : "unstable", 2.4, falls(i) ? [] : [8, 4]);
      from = i;
    }
    for (let arrow = 0.5; arrow < ARROWS; arrow++) {
      const zeta = (arrow / ARROWS) * shown.axes.horizon;
      const way = Math.sign(flow.find(([at]) => at >= zeta)?.[1] ?? 0) as -1 | 0 | 1;
      if (way !== 0) pen.head(zeta, 0, way, "soft", 4.5);
    }
  }

  private rests(pen: Pen, { rests, shown }: Moment): void {
    let last = -Infinity;
    for (const state of rests) {
      const { creepage } = state, stable = isStable(state);
      if (creepage > shown.axes.horizon) continue;
      pen.dot(creepage, 0, stable ? "stable" : "unstable", !stable);
      const at = pen.across(creepage), near = at - last < 120;
      if (at - last < 8) continue; // one mark on the other
      const grip = creepage > shown.axes.far ? "slips at" : "grip";
      const [name, dx, align] = stable ? [grip, 16, "right"] as const : ["border", -16, "left"] as const;
      pen.label(`${name} ${percent(creepage)}`, creepage, 0, dx, near ? 36 : 20, "ink", align);
      last = at;
    }
  }
}
