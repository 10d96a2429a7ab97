/* A colour scale that rises evenly in lightness, for readers of every colour vision: the map
 * "viridis" of S. van der Walt and N. Smith at nine places (its data are in the public domain,
 * CC0), straight lines between. */

const PLACES = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37],
] as const;

const STEPS = 255;
const COLOURS = Uint32Array.from({ length: STEPS + 1 }, (_, i) => {
  const at = (i / STEPS) * (PLACES.length - 1);
  const low = Math.min(Math.floor(at), PLACES.length - 2), part = at - low;
  const mix = (channel: 0 | 1 | 2): number => {
    const from = PLACES[low]?.[channel] ?? 0, to = PLACES[low + 1]?.[channel] ?? 0;
    return Math.round(from + part * (to - from));
  };
  return ((255 << 24) | (mix(2) << 16) | (mix(1) << 8) | mix(0)) >>> 0;
});

/** Colour of a value from 0 to 1, as a pixel of a canvas: its bytes are red, green, blue, 255. */
export function viridis(value: number): number {
  return COLOURS[Math.round(STEPS * Math.min(Math.max(value, 0), 1))] as number;
}
