/** Shear traction and stick along the contact, as `contactlib.laws.CarterGriffith` has them.
 *
 * Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
 * Carter solution revisited". The kernel solves for the law's parameter t; lengths from the edges
 * and from the stick boundary follow from m = t^4/(1 + t^4) and s = 1 - m, without differences of
 * nearly equal numbers.
 */
import { type Contact, kernel } from "../kernel/kernel";
import { layeredState } from "./layer_patch";

/** Traction along a line contact or a strip of an ellipse, from trailing to leading edge. */
export interface Strip {
  eta: number; // y/b of the strip [1]
  position: Float64Array; // x/a [1], the leading edge of a line contact being +1
  shear_traction: Float64Array; // over f_d p0 [1]
  stick_boundary: number; // c/a: the contact sticks from there to the leading edge, if at all
}

const THINNEST = 1e-3; // lam of a layer that makes a difference to the picture [1]
const LEAST = 1e-6; // creepage over zeta0 that a layer has a picture of [1]
const NEAREST = 1e-4; // least distance to the stick boundary, where the traction is infinite, over the zone

/**
 * A line contact as one strip, or the strips of an ellipse over eta from -1 to 1, the first and the
 * last of no width. Each has an even number of points, or with a layer some more; creepages below zero
 * brake.
 */
export function stripsOf(
  contact: Contact, normalizedCreepage: number, kHat: number, strips: number, points: number, layerRatio = 0,
): Strip[] {
  const solved = (eta: number, width: number): Strip => ({
    eta,
    ...(layerRatio > THINNEST && width > 0
      ? layeredStrip(normalizedCreepage, kHat, width, points, layerRatio)
      : strip(normalizedCreepage, kHat, width, points)),
  });
  if (contact === "line") return [solved(0, 1)];
  const found = new Array<Strip>(strips);
  for (let i = 0, j = strips - 1; i <= j; i++, j--) {
    const angle = (Math.PI * i) / (strips - 1); // denser where the ellipse is narrow
    found[j] = solved(i === j ? 0 : Math.cos(angle), i === 0 ? 0 : Math.sin(angle));
    found[i] = { ...found[j]!, eta: -found[j]!.eta }; // the ellipse is symmetric
  }
  return found;
}

/** Strip of the half-width w a. */
function strip(x: number, kHat: number, w: number, points: number): Omit<Strip, "eta"> {
  const half = points >> 1;
  const position = new Float64Array(2 * half);
  const traction = new Float64Array(2 * half);
  if (w === 0) return { position, shear_traction: traction, stick_boundary: 0 };

  const sign = Math.sign(x);
  const t = x === 0 ? 0 : kernel.module.creep_table_coordinate(Math.abs(x) / w, kHat / w); // Eq. (22)
  const s = 1 / (1 + t ** 4);
  const m = t < 1 ? t ** 4 * s : 1 / (1 + t ** -4);
  const boundary = w * (m - s);
  const slip = 2 * w * m; // lengths of the zones
  const stick = 2 * w * s;
  const intensity = kHat * (4 * m * s) ** 0.25; // Eq. (17): 1 - (c/a)^2 = 4 m s
  const singular = s > 0 ? intensity / Math.sqrt(2 * s) : 0;

  for (let i = 0; i < half; i++) {
    const part = i / (half - 1);
    const beyond = Math.max(part * part * (3 - 2 * part), NEAREST); // denser at either end
    const behind = half - 1 - i; // counted from the stick boundary to the trailing edge
    position[behind] = boundary - beyond * slip;
    traction[behind] = sign * Math.sqrt((stick + beyond * slip) * ((1 - beyond) * slip));

    const from = beyond * stick;
    const lead = (1 - beyond) * stick;
    position[half + i] = boundary + from;
    if (lead === 0) continue; // zero at the leading edge
    const bounded = slip / (Math.sqrt(slip + from) + Math.sqrt(from)); // equal to a difference of roots
    // Eq. (16)
    traction[half + i] = sign * Math.sqrt(lead) * (bounded + singular / Math.sqrt(from));
  }
  return { position, shear_traction: traction, stick_boundary: boundary };
}

/** Strip of the half-width w a with a layer, whose compliance is lam times that of the bodies. */
function layeredStrip(x: number, kHat: number, w: number, points: number, lam: number): Omit<Strip, "eta"> {
  const size = Math.abs(x) / w, half = points >> 1;
  const { boundary, position, traction } = size > LEAST ? layeredState(size, kHat / w, lam / w)
    : { boundary: -1, position: [-1, 1], traction: [0, 0] };
  // Behind the boundary it slips, denser at either end.
  const slip = Array.from({ length: half }, (_, i) => {
    const part = i / (half - 1);
    return -1 + (boundary + 1) * part * part * (3 - 2 * part);
  });
  const slides = slip.map((at) => Math.sqrt((1 - at) * (1 + at)));
  const scaled = (values: number[], by: number): Float64Array => Float64Array.from(values, (value) => by * value);
  return {
    position: scaled([...slip, ...position], w),
    shear_traction: scaled([...slides, ...traction], w * Math.sign(x)),
    stick_boundary: w * boundary,
  };
}
