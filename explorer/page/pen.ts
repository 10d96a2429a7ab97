/* Draws what moves on a chart, in the units of its axes. */

import type uPlot from "uplot";
import type { Column, History } from "../physics/recorder";
import { colour, type Colour } from "./theme";

const USUAL = 15; // size of the page's type for which lengths on charts are given [px]

/** Times the usual size of the page's type, which grows with the screen: so does that of charts. */
export const typeScale = (): number =>
  Number.parseFloat(getComputedStyle(document.documentElement).fontSize) / USUAL;
export const typeSize = (): number => Math.round(12 * typeScale()); // of a chart [px]
export const font = (size: number): string =>
  `${size}px system-ui, -apple-system, 'Segoe UI', Roboto, Helvetica, Arial, sans-serif`;

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

/** Values of both axes, or a place [px]: across, and up. */
type Place = [number, number];

interface Text {
  text: string;
  left: number;
  y: number;
  width: number;
  ink: Colour;
  font: string;
  ways?: Way[];
}

/** How a text may move [px]. */
interface Way {
  dx: number;
  dy: number;
}

/** A part of a canvas: its centre and half its size [px]. */
interface Box {
  x: number;
  y: number;
  wide: number;
  high: number;
}

const HIGH = 8; // half the height of a line of text in the usual size [px]
const CELL = 2; // of the map of lines [px]

// Ways that a text may move to a place of its own [px], the shortest first. They lead further along a
// horizontal line than away from it.
const WAYS = Array.from({ length: 33 * 25 }, (_, i) => [8 * ((i % 33) - 16), 4 * (Math.floor(i / 33) - 12)])
  .map(([dx, dy]) => ({ dx: dx!, dy: dy!, far: Math.hypot(dx!, 2 * dy!) }))
  .sort((a, b) => a.far - b.far);

/** A pen over a chart. Its texts are written last, each in the free place nearest to where it is
 * meant to be: clear of other texts, dots and lines. Without a free place a text is left out. */
export class Pen {
  private readonly texts: Text[] = []; // those first that matter most
  private readonly taken: Box[] = [];
  private readonly columns: number; // of the map of lines
  private readonly lines: Uint8Array; // 1 where a line passes, row by row
  private readonly beside: Way[]; // on which the name of a line may move
  private readonly scale = typeScale();
  private readonly high = HIGH * this.scale;
  private readonly font = font(typeSize());

  constructor(
    readonly context: CanvasRenderingContext2D,
    private readonly plot: uPlot,
    private readonly turned: boolean,
    readonly width: number,
    readonly height: number,
  ) {
    this.columns = Math.ceil(width / CELL);
    this.lines = new Uint8Array(this.columns * Math.ceil(height / CELL));
    this.beside = Array.from({ length: 2 * Math.ceil(width / 8) }, (_, i) =>
      ({ dx: -8 * (i >> 1), dy: i % 2 === 0 ? 0 : 18 * this.scale }));
    const [xs, ...curves] = plot.data;
    for (const ys of curves) { // texts keep off them
      this.mark(Array.from(xs, (value, i): Place => {
        const x = plot.valToPos(value, "x"), y = plot.valToPos(ys[i] ?? NaN, "y");
        return turned ? [y, x] : [x, y];
      }));
    }
  }

  /** Mark where straight lines pass from place to place; one that is not finite interrupts them. */
  private mark(places: Place[]): void {
    places.slice(1).forEach(([toX, toY], i) => {
      const [x, y] = places[i]!;
      const within = (from: number, to: number, end: number): boolean =>
        Math.max(from, to) >= 0 && Math.min(from, to) < end && Number.isFinite(to - from);
      if (!within(x, toX, this.width) || !within(y, toY, this.height)) return;
      const steps = Math.ceil(Math.max(Math.abs(toX - x), Math.abs(toY - y)) / CELL);
      for (let k = 0; k <= steps; k++) {
        const part = k / Math.max(steps, 1);
        const across = Math.floor((x + part * (toX - x)) / CELL);
        const up = Math.floor((y + part * (toY - y)) / CELL);
        if (across >= 0 && across < this.columns) this.lines[up * this.columns + across] = 1;
      }
    });
  }

  /** Whether a line passes through a box. */
  private crossed({ x, y, wide, high }: Box): boolean {
    const first = Math.max(0, Math.floor((x - wide) / CELL));
    const last = Math.min(this.columns - 1, Math.floor((x + wide) / CELL));
    for (let row = Math.floor((y - high) / CELL); row <= Math.floor((y + high) / CELL); row++) {
      for (let column = first; column <= last; column++) {
        if (this.lines[row * this.columns + column] === 1) return true;
      }
    }
    return false;
  }

  /** Place of a value on the horizontal and on the vertical axis [px]. */
  across(value: number): number {
    return this.plot.valToPos(value, this.turned ? "y" : "x");
  }

  up(value: number): number {
    return this.plot.valToPos(value, this.turned ? "x" : "y");
  }

  line(points: Iterable<Place>, stroke: Colour, width = 1.5, dash: number[] = []): void {
    const places = Array.from(points, ([x, y]): Place => [this.across(x), this.up(y)]);
    this.trace(places.filter(([x, y]) => Number.isFinite(x + y)), stroke, width, dash);
  }

  /** A line across the whole chart at a value of one axis. */
  rule(axis: "across" | "up", value: number, stroke: Colour, width = 1, dash: number[] = []): void {
    const at = axis === "across" ? this.across(value) : this.up(value);
    this.trace(axis === "across" ? [[at, 0], [at, this.height]] : [[0, at], [this.width, at]],
      stroke, width, dash);
  }

  private trace(places: Place[], stroke: Colour, width: number, dash: number[]): void {
    const c = this.context;
    this.mark(places);
    c.beginPath();
    places.forEach(([x, y], i) => (i === 0 ? c.moveTo(x, y) : c.lineTo(x, y)));
    c.strokeStyle = colour(stroke);
    c.lineWidth = width;
    c.setLineDash(dash);
    c.lineJoin = "round";
    c.stroke();
    c.setLineDash([]);
  }

  /** A disc at a place [px], which texts keep off. */
  private disc(x: number, y: number, radius: number, fill: Colour, rim: Colour, width: number): void {
    const c = this.context;
    this.taken.push({ x, y, wide: radius, high: radius });
    c.beginPath();
    c.arc(x, y, radius, 0, 2 * Math.PI);
    c.fillStyle = colour(fill);
    c.fill();
    c.strokeStyle = colour(rim);
    c.lineWidth = width;
    c.stroke();
  }

  /** An arrow head about a place [px] that points in a direction. */
  private arrow(x: number, y: number, dx: number, dy: number, ink: Colour, size: number): void {
    const c = this.context, long = size / Math.hypot(dx, dy), ux = long * dx, uy = long * dy;
    c.beginPath();
    c.moveTo(x + ux, y + uy);
    c.lineTo(x - 0.7 * ux + 0.8 * uy, y - 0.7 * uy - 0.8 * ux);
    c.lineTo(x - 0.7 * ux - 0.8 * uy, y - 0.7 * uy + 0.8 * ux);
    c.fillStyle = colour(ink);
    c.fill();
  }

  /** A dot, hollow for an unstable state. */
  dot(x: number, y: number, ink: Colour, hollow = false, radius = 4.5): void {
    this.disc(this.across(x), this.up(y), this.scale * radius, hollow ? "card" : ink, ink, 2);
  }

  /** The wheel; outside the chart it is drawn at the edge, with an arrow and its value. */
  wheel(x: number, y: number, ink: Colour, outside: string): void {
    const r = 7.5 * this.scale;
    const px = this.across(x), py = this.up(y);
    const beyondX = px > this.width ? 1 : px < 0 ? -1 : 0;
    const beyondY = py < 0 ? 1 : py > this.height ? -1 : 0;
    const cx = Math.min(Math.max(px, r + 2), this.width - r - 2);
    const cy = Math.min(Math.max(py, r + 2), this.height - r - 2);
    this.disc(cx, cy, r, ink, "card", 2.5);
    if (beyondX === 0 && beyondY === 0) return;
    this.arrow(cx, cy, beyondX, -beyondY, "card", 5);
    const below = cy < 40 * this.scale;
    this.words(outside, cx - beyondX * 14, cy + this.scale * (below ? 22 : -14), ink,
      beyondX > 0 ? "right" : beyondX < 0 ? "left" : cx > this.width - 60 ? "right" : "left", true);
    this.texts.unshift(this.texts.pop()!);
  }

  /** An arrow head at a point, along the horizontal axis. */
  head(x: number, y: number, way: 1 | -1, ink: Colour, size: number): void {
    const px = this.across(x), py = this.up(y);
    this.taken.push({ x: px, y: py, wide: size, high: size });
    this.arrow(px, py, way, 0, ink, size);
  }

  /** A handle at the upper end of a vertical line. */
  handle(value: number, ink: Colour): void {
    const c = this.context, x = Math.min(Math.max(this.across(value), 12), this.width - 12), y = 11;
    this.taken.push({ x, y, wide: 11, high: 8 });
    c.beginPath();
    c.roundRect(x - 11, y - 8, 22, 16, 6);
    c.fillStyle = colour(ink);
    c.fill();
    for (const way of [-1, 1]) this.arrow(x + 5 * way, y, way, 0, "card", 3.5);
  }

  /** Text at a point, shifted by so many px of the usual size. */
  label(text: string, x: number, y: number, dx: number, dy: number, ink: Colour = "ink",
    align: CanvasTextAlign = "left"): void {
    this.words(text, this.across(x) + this.scale * dx, this.up(y) + this.scale * dy, ink, align);
  }

  /** Text at a place [px]. */
  words(text: string, x: number, y: number, ink: Colour, align: CanvasTextAlign = "left",
    bold = false): void {
    const c = this.context, font = bold ? `600 ${this.font}` : this.font;
    c.font = font;
    const width = c.measureText(text).width + 6; // with a margin
    const left = align === "left" ? x : align === "right" ? x - width : x - 0.5 * width;
    this.texts.push({ text, left, y, width, ink, font });
  }

  /** Name of a horizontal line, which stays beside it: above or below, as far right as there is room. */
  nameLine(text: string, y: number, ink: Colour): void {
    this.words(text, this.width - 5, this.up(y) - 9 * this.scale, ink, "right");
    this.texts.at(-1)!.ways = this.beside;
  }

  /** Write all texts, with a rim of the card's colour that keeps them legible over lines. */
  write(): void {
    const c = this.context;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.lineWidth = 4;
    c.lineJoin = "round";
    c.strokeStyle = colour("card");
    for (const text of this.texts) {
      const place = this.placeOf(text);
      if (place === undefined) continue;
      this.taken.push(place);
      c.font = text.font;
      c.strokeText(text.text, place.x, place.y);
      c.fillStyle = colour(text.ink);
      c.fillText(text.text, place.x, place.y);
    }
  }

  /** The free place inside the chart that is nearest to where a text is meant to be. */
  private placeOf({ left, y, width, ways = WAYS }: Text): Box | undefined {
    const within = (at: number, size: number, room: number): number =>
      Math.min(Math.max(at, size), Math.max(size, room - size));
    const wide = 0.5 * width, x = within(left + wide, wide, this.width);
    const { high } = this, up = within(y, high, this.height);
    const way = ways.find(({ dx, dy }) => within(x + dx, wide, this.width) === x + dx &&
      within(up + dy, high, this.height) === up + dy &&
      this.taken.every((other) => Math.abs(other.x - x - dx) >= other.wide + wide ||
        Math.abs(other.y - up - dy) >= other.high + high) &&
      !this.crossed({ x: x + dx, y: up + dy, wide, high }));
    return way && { x: x + way.dx, y: up + way.dy, wide, high };
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

/** Where the wheel has been since a time: two columns of the history, y at least at `lowest`. */
export function* trail(history: History, x: Column, y: Column, from: number, lowest = -Infinity):
  Generator<Place> {
  const rows = history.window(from), xs = rows[x], ys = rows[y], last = xs.length - 1;
  const stride = Math.max(1, Math.ceil(xs.length / TRAIL));
  for (let i = 0; last >= 0; i = Math.min(i + stride, last)) {
    yield [xs[i]!, Math.max(ys[i]!, lowest)];
    if (i === last) return;
  }
}
