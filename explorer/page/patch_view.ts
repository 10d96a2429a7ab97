/* The contact patch: shear traction along it, and its zones of stick and slip from above. */

import { type Strip, stripsOf } from "../physics/patch";
import { atLoad, lateralSemiAxis } from "../physics/vehicle";
import { View } from "./chart";
import { digits } from "./format";
import { emptied, font, typeScale, typeSize } from "./pen";
import type { Moment, Picture } from "./picture";
import { colour } from "./theme";

const MAX_TRACTION = 2.4; // end of the scale of traction over f_d p0, which is infinite at the stick boundary [1]
const POINTS = 81, STRIPS = 41;
const COLUMNS = 240, ROWS = 96; // pixels of the patch, before they are stretched

/* A colour scale that rises evenly in lightness, for readers of every colour vision: nine colours of
 * the map "viridis" of S. van der Walt and N. Smith (its data are in the public domain, CC0), with
 * straight lines between them. */
const PLACES: number[][] = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37],
];

const SHADES = 255;
const COLOURS = Uint32Array.from({ length: SHADES + 1 }, (_, i) => {
  const at = (i / SHADES) * (PLACES.length - 1);
  const low = Math.min(Math.floor(at), PLACES.length - 2), part = at - low;
  const [red, green, blue] = PLACES[low]!.map((from, channel) =>
    Math.round(from + part * (PLACES[low + 1]![channel]! - from)));
  return ((255 << 24) | (blue! << 16) | (green! << 8) | red!) >>> 0;
});

/** Colour of a value from 0 to 1, as a pixel of a canvas: its bytes are red, green, blue, 255. */
function viridis(value: number): number {
  return COLOURS[Math.round(SHADES * Math.min(Math.max(value, 0), 1))]!;
}

export class PatchView extends View {
  private readonly picture = document.createElement("canvas");
  private boundary = 1; // between slip and stick, over the semi-width
  private strips: Strip[] = [];
  private solved = ""; // what these are for

  constructor(place: HTMLElement, private readonly above: HTMLCanvasElement) {
    super(place, {
      x: { label: "", hidden: true, size: 6 },
      y: { label: "q / (f_d p\u2080)", size: 40 },
      curves: [
        { colour: "unstable", fill: "shade", width: 2.2 },
        { colour: "stable", fill: "shade", width: 2.2 },
      ],
    });
    Object.assign(this.picture, { width: COLUMNS, height: ROWS });
  }

  describe(_moment: Moment): string {
    const part = 50 * (1 - this.boundary);
    return part < 0.1 ? "The whole contact slips."
      : `Shear traction along the contact: ${digits(part, 2)} % of its length stick, at the leading edge.`;
  }

  draw({ run, shown }: Moment): void {
    const { plant } = shown;
    const contact = plant.force(run.now.creepage, run.now.speed, run.now.friction);
    const x = Math.max(Math.abs(contact.normalized_creepage), 1e-9), shape = plant.vehicle.contact;
    const [size, k, layer] = [x, contact.k_hat, plant.scales(run.now.friction).layer_ratio].map((value) =>
      Number(value.toPrecision(4))) as [number, number, number]; // a change that can be seen
    const key = [shape, size, k, layer].join();
    if (key !== this.solved) this.strips = stripsOf(shape, size, k, STRIPS, POINTS, layer);
    this.solved = key;
    const middle = this.strips[this.strips.length >> 1]!;
    this.boundary = middle.stick_boundary;
    this.profile(middle);
    this.fromAbove(this.strips, shown);
  }

  private profile({ position, shear_traction, stick_boundary }: Strip): void {
    const slip: (number | null)[] = [], stick: (number | null)[] = [];
    position.forEach((at, i) => {
      slip.push(at <= stick_boundary ? shear_traction[i]! : null);
      stick.push(at >= stick_boundary && stick_boundary < 0.999 ? shear_traction[i]! : null);
    });
    this.chart.show([position, slip, stick], [-1.08, 1.08], [0, MAX_TRACTION]);
    this.chart.draw((pen) => {
      if (stick_boundary < 0.999) {
        pen.rule("across", stick_boundary, "ink", 1.2, [3, 3]);
        if (stick_boundary < 0.8) pen.words("sticks", Math.max(pen.across(stick_boundary) + 6,
          pen.across(0.5 * (stick_boundary + 1)) - 16), 10, "stable", "left", true);
        pen.words("slips", Math.min(pen.across(stick_boundary) - 6,
          pen.across(0.5 * (stick_boundary - 1)) + 16), 10, "unstable", "right", true);
      } else {
        pen.words("slips everywhere", 0.5 * pen.width, 10, "unstable", "center", true);
      }
    });
  }

  private fromAbove(strips: Strip[], { plant }: Picture): void {
    const { clientWidth: width, clientHeight: height } = this.above;
    const c = emptied(this.above, width, height);
    // The axis is that of the chart above, so that places along the contact are below each other.
    const box = this.chart.plot.over, left = box.offsetLeft;
    const across = (xi: number): number => left + ((xi + 1.08) / 2.16) * box.clientWidth;
    const room = height - 22 * typeScale(), half = 0.5 * room, line = strips.length === 1;
    c.save();
    c.beginPath();
    if (line) c.rect(across(-1), 0, across(1) - across(-1), room);
    else c.ellipse(across(0), half, across(1) - across(0), half, 0, 0, 2 * Math.PI);
    c.clip();
    this.paint(strips);
    // Rows of pixels follow the strips; columns are evenly spaced from edge to edge.
    c.drawImage(this.picture, across(-1), 0, across(1) - across(-1), room);
    c.restore();
    this.drawBoundary(c, strips, across, half);
    const loaded = atLoad(plant.vehicle, plant.axleLoad), b = lateralSemiAxis(loaded);
    const along = `2a = ${digits(2e3 * loaded.semi_width)} mm`;
    const both = `${along}, 2b = ${digits(2e3 * b)} mm`, rolling = "rolling \u2192";
    c.font = font(typeSize());
    c.textBaseline = "bottom";
    c.fillStyle = colour("soft");
    c.textAlign = "right";
    c.fillText(rolling, width - 4, height - 2);
    c.textAlign = "left";
    const free = width - 20 - c.measureText(rolling).width;
    const size = (line ? [`from above, ${along}`] : [`${both}, not to scale`, both])
      .find((text) => c.measureText(text).width < free) ?? along;
    c.fillText(size, 4, height - 2);
  }

  /** Traction of all strips as pixels; beyond a strip its end value goes on, and is clipped. */
  private paint(strips: Strip[]): void {
    const c = this.picture.getContext("2d");
    if (c === null) return;
    const image = c.createImageData(COLUMNS, ROWS), pixels = new Uint32Array(image.data.buffer);
    for (let row = 0; row < ROWS; row++) {
      // Strips are denser towards the sides: eta = sin(theta), theta even.
      const eta = 1 - (2 * (row + 0.5)) / ROWS, theta = Math.asin(eta) / Math.PI + 0.5;
      const strip = strips[Math.round(theta * (strips.length - 1))]!;
      this.paintRow(pixels.subarray(row * COLUMNS, (row + 1) * COLUMNS), strip);
    }
    c.putImageData(image, 0, 0);
  }

  private paintRow(pixels: Uint32Array, { position, shear_traction: traction }: Strip): void {
    const last = position.length - 1;
    for (let column = 0, i = 0; column < COLUMNS; column++) {
      const xi = -1 + (2 * (column + 0.5)) / COLUMNS;
      while (i < last - 1 && (position[i + 1] as number) < xi) i++;
      const from = position[i] as number, width = (position[i + 1] as number) - from;
      const part = width > 0 ? Math.min(Math.max((xi - from) / width, 0), 1) : 0;
      const q = (traction[i] as number) * (1 - part) + (traction[i + 1] as number) * part;
      pixels[column] = viridis(q / MAX_TRACTION);
    }
  }

  private drawBoundary(c: CanvasRenderingContext2D, strips: Strip[],
    across: (xi: number) => number, half: number): void {
    c.strokeStyle = "#ffffff";
    c.lineWidth = 2;
    c.beginPath();
    for (const { eta, stick_boundary: c0, position } of strips) {
      if (c0 >= position.at(-1)! - 1e-3) continue;
      for (const y of strips.length === 1 ? [-1, 1] : [eta]) c.lineTo(across(c0), half - half * y);
    }
    c.stroke();
    if (this.boundary >= 0.9) return;
    c.font = `600 ${font(typeSize())}`;
    c.fillStyle = "#ffffff";
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText("stick", across(0.5 * (this.boundary + 1)), half);
  }
}
