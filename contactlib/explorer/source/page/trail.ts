/* Where the wheel has been: two columns of its history as points. */

import type { Column, History } from "../physics/history";

const MOST = 700; // points of a trail; more are not seen

/** Points of two columns since a time, in the units of the axes; `least` holds y above it. */
export function* trail(history: History, x: Column, y: Column, from: number, perX: number,
  perY: number, least = -Infinity): Generator<[number, number]> {
  const rows = history.window(from), xs = rows[x], ys = rows[y], last = xs.length - 1;
  const stride = Math.max(1, Math.ceil(xs.length / MOST));
  for (let i = 0; i < last; i += stride) {
    yield [perX * (xs[i] as number), Math.max(perY * (ys[i] as number), least)];
  }
  if (last >= 0) yield [perX * (xs[last] as number), Math.max(perY * (ys[last] as number), least)];
}
