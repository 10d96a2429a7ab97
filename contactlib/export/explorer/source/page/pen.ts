/* Draws what moves on a chart, in the units of its axes. */

import type uPlot from "uplot";
import type { Column, History } from "../physics/recorder";
import { colour, type Colour } from "./theme";

export const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif";

/** Clear a canvas, at a size [px] and the screen's resolution; its context then draws in px. */
export function emptied(canvas: HTMLCanvasElement, width: number, height: number):
  CanvasRenderingContext2D {
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("the browser does not draw on a canvas");
  const ratio = devicePixelRatio, wide = Math.round(width * ratio), high = Math.round(height * ratio);
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

/** A pen over a chart. */
export class Pen {
  constructor(
    readonly context: CanvasRenderingContext2D,
    private readonly plot: uPlot,
    private readonly turned: boolean,
    readonly width: number,
    readonly height: number,
  ) {}

  /** Place of a value on the horizontal and on the vertical axis [px]. */
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

  /** A line across the whole chart at a value of one axis. */
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

  /** A dot, hollow for an unstable state. */
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

  /** The wheel; outside the chart it is drawn at the edge, with an arrow and its value. */
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
    this.arrow(cx, cy, beyondX, -beyondY);
    const below = cy < 40;
    this.words(outside, cx - beyondX * 14, cy + (below ? 22 : -14), ink,
      beyondX > 0 ? "right" : beyondX < 0 ? "left" : cx > this.width - 60 ? "right" : "left", true);
  }

  /** Triangle inside a dot [px] that points in a direction. */
  private arrow(x: number, y: number, dx: number, dy: number): void {
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

  /** A solid arrow head at a point, along the horizontal axis. */
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

  /** A handle at the upper end of a vertical line. */
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

  /** Text at a point, shifted by so many px and kept inside the chart. */
  label(text: string, x: number, y: number, dx: number, dy: number, ink: Colour = "ink",
    align: CanvasTextAlign = "left"): void {
    this.words(text, this.across(x) + dx, this.up(y) + dy, ink, align);
  }

  /** Text at a place [px], with a rim of the card's colour that keeps it legible over lines. */
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

  /** A band between two values of the horizontal axis. */
  band(from: number, to: number, fill: Colour): void {
    const a = Math.max(0, this.across(from)), b = Math.min(this.width, this.across(to));
    if (!(b > a)) return;
    this.context.fillStyle = colour(fill);
    this.context.fillRect(a, 0, b - a, this.height);
  }
}

const TRAIL = 700; // points at most

/** Where the wheel has been since a time: two columns of the history in the units of the axes, y at
 * least at `least`. */
export function* trail(history: History, x: Column, y: Column, from: number, perX: number,
  perY: number, least = -Infinity): Generator<[number, number]> {
  const rows = history.window(from), xs = rows[x], ys = rows[y], last = xs.length - 1;
  const stride = Math.max(1, Math.ceil(xs.length / TRAIL));
  for (let i = 0; i < last; i += stride) {
    yield [perX * (xs[i] as number), Math.max(perY * (ys[i] as number), least)];
  }
  if (last >= 0) yield [perX * (xs[last] as number), Math.max(perY * (ys[last] as number), least)];
}
