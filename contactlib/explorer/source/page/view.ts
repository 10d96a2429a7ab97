/* What every chart is given, and what it does with it. */

import type { Control, Run } from "../physics/run";
import type { SteadyState } from "../physics/stability";
import type { Picture } from "./picture";

/** The moment that is drawn. */
export interface Moment {
  run: Run;
  control: Control;
  shown: Picture;
  /** States in which the present torque keeps the creepage, on the friction under the wheel. */
  rests: SteadyState[];
  /** Simulated time that the charts look back [s]. */
  span: number;
}

export interface View {
  /** Curves have changed. */
  show(shown: Picture): void;
  /** A frame. */
  draw(moment: Moment): void;
  /** Colours have changed. */
  repaint(): void;
  /** What the chart shows, in words, for who does not see it. */
  describe(moment: Moment): string;
  readonly place: HTMLElement;
}
