/* A chart: curves and axes drawn by uPlot when something changes, and over them a canvas for what
   moves, drawn every frame. */

import uPlot from "uplot";
import { colour, type Colour } from "./theme";

export interface Axis {
  label: string;
  log?: boolean;
  /** Smallest distance between two labels [px]. */
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

export interface ChartSpec {
  x: Axis;
  y: Axis;
  curves: Curve[];
  /** Whether x runs upwards and y to the right. */
  turned?: boolean;
}

export type Range = [number, number];

const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif";

/** What draws over a chart, in the chart's own numbers. */
export class Pen {
  constructor(
    readonly context: CanvasRenderingContext2D,
    private readonly plot: uPlot,
    private readonly turned: boolean,
    readonly width: number,
    readonly height: number,
  ) {}

  /** Place of a number on the horizontal and on the vertical axis [px]. */
  across(value: number): number {
    return this.plot.valToPos(value, this.turned ? "y" : "x");
  }

  up(value: number): number {
    return this.plot.valToPos(value, this.turned ? "x" : "y");
  }

  line(points: Iterable<[number, number]>, stroke: Colour, width = 1.5, dash: number[] = []): void {
    const c = this.context;
    c.beginPath();
    let begun = false;
    for (const [x, y] of points) {
      const px = this.across(x), py = this.up(y);
      if (!Number.isFinite(px) || !Number.isFinite(py)) continue;
      if (begun) c.lineTo(px, py);
      else c.moveTo(px, py);
      begun = true;
    }
    this.stroke(stroke, width, dash);
  }

  /** A line across the whole chart at a number of one axis. */
  rule(axis: "across" | "up", value: number, stroke: Colour, width = 1, dash: number[] = []): void {
    const c = this.context, at = axis === "across" ? this.across(value) : this.up(value);
    c.beginPath();
    if (axis === "across") {
      c.moveTo(at, 0);
      c.lineTo(at, this.height);
    } else {
      c.moveTo(0, at);
      c.lineTo(this.width, at);
    }
    this.stroke(stroke, width, dash);
  }

  private stroke(stroke: Colour, width: number, dash: number[]): void {
    const c = this.context;
    c.strokeStyle = colour(stroke);
    c.lineWidth = width;
    c.setLineDash(dash);
    c.lineJoin = "round";
    c.stroke();
    c.setLineDash([]);
  }

  /** A dot, hollow for what is unstable. */
  dot(x: number, y: number, ink: Colour, hollow = false, radius = 4.5): void {
    const c = this.context;
    c.beginPath();
    c.arc(this.across(x), this.up(y), radius, 0, 2 * Math.PI);
    c.fillStyle = colour(hollow ? "card" : ink);
    c.fill();
    c.strokeStyle = colour(ink);
    c.lineWidth = 2;
    c.stroke();
  }

  /** Where the wheel is; at the edge, with an arrow and its value, if that is outside. */
  wheel(x: number, y: number, ink: Colour, outside: string): void {
    const c = this.context, r = 7.5;
    const px = this.across(x), py = this.up(y);
    const beyondX = px > this.width ? 1 : px < 0 ? -1 : 0;
    const beyondY = py < 0 ? 1 : py > this.height ? -1 : 0;
    const cx = Math.min(Math.max(px, r + 2), this.width - r - 2);
    const cy = Math.min(Math.max(py, r + 2), this.height - r - 2);
    c.beginPath();
    c.arc(cx, cy, r, 0, 2 * Math.PI);
    c.fillStyle = colour(ink);
    c.fill();
    c.strokeStyle = colour("card");
    c.lineWidth = 2.5;
    c.stroke();
    if (beyondX === 0 && beyondY === 0) return;
    this.arrow(cx, cy, beyondX, -beyondY, ink);
    const below = cy < 40;
    this.words(outside, cx - beyondX * 14, cy + (below ? 22 : -14), ink,
      beyondX > 0 ? "right" : beyondX < 0 ? "left" : cx > this.width - 60 ? "right" : "left", true);
  }

  /** Triangle inside a dot at a place [px] that points a way. */
  private arrow(x: number, y: number, dx: number, dy: number, _ink: Colour): void {
    const c = this.context, size = Math.hypot(dx, dy) || 1;
    const ux = dx / size, uy = dy / size;
    c.beginPath();
    c.moveTo(x + 5 * ux, y + 5 * uy);
    c.lineTo(x - 3 * ux + 4 * uy, y - 3 * uy - 4 * ux);
    c.lineTo(x - 3 * ux - 4 * uy, y - 3 * uy + 4 * ux);
    c.closePath();
    c.fillStyle = colour("card");
    c.fill();
  }

  /** A solid arrow head at numbers of the axes, pointing along the horizontal one. */
  head(x: number, y: number, way: 1 | -1, ink: Colour, size = 6): void {
    const c = this.context, px = this.across(x), py = this.up(y);
    c.beginPath();
    c.moveTo(px + way * size, py);
    c.lineTo(px - way * size * 0.7, py - size * 0.8);
    c.lineTo(px - way * size * 0.7, py + size * 0.8);
    c.closePath();
    c.fillStyle = colour(ink);
    c.fill();
  }

  /** A handle on a vertical line at its upper end. */
  handle(value: number, ink: Colour): void {
    const c = this.context, x = this.across(value), y = 11;
    c.beginPath();
    c.roundRect(x - 11, y - 8, 22, 16, 6);
    c.fillStyle = colour(ink);
    c.fill();
    c.fillStyle = colour("card");
    for (const way of [-1, 1]) {
      c.beginPath();
      c.moveTo(x + way * 8, y);
      c.lineTo(x + way * 3, y - 4);
      c.lineTo(x + way * 3, y + 4);
      c.fill();
    }
  }

  /** Text at numbers of the axes, moved by so many px, kept inside the chart. */
  label(text: string, x: number, y: number, dx: number, dy: number, ink: Colour = "ink",
    align: CanvasTextAlign = "left"): void {
    this.words(text, this.across(x) + dx, this.up(y) + dy, ink, align);
  }

  /** Text at a place [px], with a rim of the card's colour so that it reads over lines. */
  words(text: string, x: number, y: number, ink: Colour, align: CanvasTextAlign = "left",
    bold = false): void {
    const c = this.context;
    c.font = bold ? `600 ${FONT}` : FONT;
    c.textAlign = align;
    c.textBaseline = "middle";
    const width = c.measureText(text).width;
    const left = align === "left" ? x : align === "right" ? x - width : x - 0.5 * width;
    const held = Math.min(Math.max(left, 3), Math.max(3, this.width - width - 3));
    const at = x + held - left, py = Math.min(Math.max(y, 8), this.height - 8);
    c.lineWidth = 4;
    c.lineJoin = "round";
    c.strokeStyle = colour("card");
    c.strokeText(text, at, py);
    c.fillStyle = colour(ink);
    c.fillText(text, at, py);
  }

  /** A band between two numbers of the horizontal axis. */
  band(from: number, to: number, fill: Colour): void {
    const a = Math.max(0, this.across(from)), b = Math.min(this.width, this.across(to));
    if (!(b > a)) return;
    this.context.fillStyle = colour(fill);
    this.context.fillRect(a, 0, b - a, this.height);
  }
}

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

/** The range that is set; before that, one that any axis can have. */
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
    place.setAttribute("role", "img");
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

  /** Draw again with the colours of the theme. */
  repaint(): void {
    this.plot.redraw(false, true);
  }

  /** Draw what moves. */
  draw(paint: (pen: Pen) => void): void {
    const c = this.over.getContext("2d");
    if (c === null) return;
    const { clientWidth: width, clientHeight: height } = this.plot.over;
    const ratio = devicePixelRatio;
    if (this.over.width !== Math.round(width * ratio) || this.over.height !== Math.round(height * ratio)) {
      this.over.width = Math.round(width * ratio);
      this.over.height = Math.round(height * ratio);
    }
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    paint(new Pen(c, this.plot, this.spec.turned ?? false, width, height));
  }

  /** Numbers of both axes under a pointer. */
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
    if (width > 0 && height > 0) this.plot.setSize({ width, height });
  }

  private options(): uPlot.Options {
    const { x, y, curves, turned = false } = this.spec;
    return {
      width: 300,
      height: 200,
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 16, 0, 0],
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
    const values = axis.values ?? ((v: number) => String(Number(v.toPrecision(6))));
    return {
      scale,
      side,
      font: FONT,
      labelFont: FONT,
      label: axis.hidden ? "" : axis.label,
      labelSize: axis.hidden ? 0 : 16,
      labelGap: upright ? 2 : 0,
      size: axis.size ?? (upright ? 46 : 24),
      gap: 4,
      space: axis.space ?? (upright ? 26 : 52),
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
