/* A chart: uPlot draws curves and axes when they change; a canvas over them is drawn every frame. */

import uPlot from "uplot";
import { emptied, font, Pen, typeScale, typeSize } from "./pen";
import type { Moment, Picture } from "./picture";
import { colour, type Colour } from "./theme";

interface Axis {
  label: string;
  /** What the label shows for one SI unit. */
  per?: number;
  log?: boolean;
  /** Smallest distance between two labels, and width of the axis, in the usual size of type [px]. */
  space?: number;
  size?: number;
  values?: (value: number) => string;
  hidden?: boolean;
}

export interface Curve {
  colour: Colour;
  width?: number;
  dash?: number[];
  fill?: Colour;
}

interface ChartSpec {
  x: Axis;
  y: Axis;
  curves: Curve[];
  /** Whether x runs upwards and y to the right. */
  turned?: boolean;
}

type Range = [number, number];

/** Ticks at 1, 2 and 5 times powers of ten, or at 1 and 3, or at 1 alone. */
function logTicks(min: number, max: number, room: number): number[] {
  const decades = Math.log10(max / min);
  const steps = room / decades > 130 ? [1, 2, 5] : room / decades > 60 ? [1, 3] : [1];
  const found: number[] = [];
  for (let power = Math.floor(Math.log10(min)); power <= Math.log10(max) + 1e-9; power++) {
    for (const step of steps) {
      const at = step * 10 ** power;
      if (at >= min * (1 - 1e-9) && at <= max * (1 + 1e-9)) found.push(Number(at.toPrecision(1)));
    }
  }
  return found;
}

/** The range that was set; before that, one that suits any axis. */
const asGiven = (_: uPlot, min: number | null, max: number | null): Range => [min ?? 0.1, max ?? 1];

export class Chart {
  readonly plot: uPlot;
  private readonly over = document.createElement("canvas");

  constructor(private readonly place: HTMLElement, private readonly spec: ChartSpec) {
    this.plot = new uPlot(this.options(), [[], ...spec.curves.map(() => [])] as uPlot.AlignedData,
      place);
    this.over.className = "over";
    this.over.setAttribute("aria-hidden", "true");
    this.plot.over.append(this.over);
    new ResizeObserver(() => this.fit()).observe(place);
    this.fit();
  }

  /** Show curves over a range of each axis. */
  show(data: (ArrayLike<number | null> | number[])[], x: Range, y: Range): void {
    this.plot.batch(() => {
      this.plot.setData(data as uPlot.AlignedData, false);
      this.plot.setScale("x", { min: x[0], max: x[1] });
      this.plot.setScale("y", { min: y[0], max: y[1] });
    });
  }

  /** Draw again with the theme's colours. */
  repaint(): void {
    this.plot.redraw(false, true);
  }

  /** Draw what moves. */
  draw(paint: (pen: Pen) => void): void {
    const { clientWidth: width, clientHeight: height } = this.plot.over;
    const c = emptied(this.over, width, height);
    const pen = new Pen(c, this.plot, this.spec.turned ?? false, width, height);
    paint(pen);
    pen.write();
  }

  /** Values of both axes under a pointer. */
  at(event: PointerEvent): { across: number; up: number } {
    const box = this.plot.over.getBoundingClientRect();
    const turned = this.spec.turned ?? false;
    return {
      across: this.plot.posToVal(event.clientX - box.left, turned ? "y" : "x"),
      up: this.plot.posToVal(event.clientY - box.top, turned ? "x" : "y"),
    };
  }

  private fit(): void {
    const width = this.place.clientWidth, height = this.place.clientHeight;
    const size = typeSize(), drawn = Math.round(size * devicePixelRatio);
    for (const axis of this.plot.axes) { // uPlot keeps a font as text, size as drawn, and size
      for (const kept of [axis.font, axis.labelFont]) Object.assign(kept!, [font(drawn), drawn, size]);
      if (axis.labelSize !== 0) axis.labelSize = 16 * typeScale();
    }
    if (width > 0 && height > 0) this.plot.setSize({ width, height });
  }

  private options(): uPlot.Options {
    const { x, y, curves, turned = false } = this.spec;
    return {
      width: 300,
      height: 200,
      legend: { show: false },
      cursor: { show: false },
      padding: [8, () => 16 * typeScale(), 0, 0],
      pxAlign: 0,
      scales: {
        x: { time: false, auto: false, range: asGiven, distr: x.log ? 3 : 1, ori: turned ? 1 : 0 },
        y: { auto: false, range: asGiven, distr: y.log ? 3 : 1, ori: turned ? 0 : 1 },
      },
      axes: [this.axis("x", x, turned ? 3 : 2), this.axis("y", y, turned ? 2 : 3)],
      series: [{}, ...curves.map((curve): uPlot.Series => ({
        stroke: () => colour(curve.colour),
        width: curve.width ?? 2.5,
        points: { show: false },
        spanGaps: false,
        ...(curve.dash ? { dash: curve.dash.map((v) => v * devicePixelRatio) } : {}),
        ...(curve.fill ? { fill: () => colour(curve.fill as Colour) } : {}),
      }))],
    };
  }

  private axis(scale: "x" | "y", axis: Axis, side: 2 | 3): uPlot.Axis {
    const upright = side === 3;
    const { per = 1, values = (v: number): string => String(Number((per * v).toPrecision(6))) } = axis;
    return {
      scale,
      side,
      font: font(typeSize()),
      labelFont: font(typeSize()),
      label: axis.hidden ? "" : axis.label,
      labelSize: axis.hidden ? 0 : 16,
      labelGap: upright ? 2 : 0,
      size: (_, values) => typeScale() * Math.max(axis.size ?? (upright ? 46 : 24),
        upright ? 12 + 7 * Math.max(0, ...(values ?? []).map((text) => text.length)) : 0), // its numbers
      gap: 4,
      space: () => typeScale() * (axis.space ?? (upright ? 26 : 52)),
      stroke: () => colour("soft"),
      grid: { stroke: () => colour("faint"), width: 1 },
      ticks: { stroke: () => colour("line"), width: 1, size: 4 },
      values: (_, splits) => splits.map((v) => (v === null || axis.hidden ? "" : values(v))),
      ...(axis.log
        ? { filter: (_: uPlot, splits: number[]) => splits, splits: (u: uPlot, _axis: number, min: number, max: number) =>
            logTicks(min, max, upright ? u.over.clientHeight : u.over.clientWidth) }
        : {}),
    };
  }
}

/** A figure of the page with a chart. */
export abstract class View {
  protected readonly chart: Chart;

  constructor(readonly place: HTMLElement, spec: ChartSpec, chartPlace = place) {
    this.chart = new Chart(chartPlace, spec);
  }

  /** Take new curves. */
  show(_shown: Picture): void {}

  /** Take new colours. */
  repaint(): void {
    this.chart.repaint();
  }

  /** Draw a frame. */
  abstract draw(moment: Moment): void;

  /** What the chart shows, in words, for visitors who do not see it. */
  abstract describe(moment: Moment): string;
}
