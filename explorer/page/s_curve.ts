/* Steady creepage over the drive torque: the S-curve, its fold and its hysteresis. */

import { View } from "./chart";
import { digits, percent } from "./format";
import { trail } from "./pen";
import { byStability, type Moment, type Picture } from "./picture";

const FINGER = 32; // distance at which a finger takes hold of the handle [px]

/** Called with the torque [N.m] and creepage [1] to which a visitor drags. */
type Dragged = (driveTorque: number, creepage: number) => void;

export class SteadyStates extends View {
  private handle = 0; // place of the torque's [px]

  constructor(place: HTMLElement, dragged: Dragged) {
    super(place, {
      turned: true,
      x: { label: "creepage \u03b6  [%]", per: 100, log: true, size: 46 },
      y: { label: "drive torque T  [kN m]", per: 1e-3 },
      curves: [{ colour: "stable" }, { colour: "unstable", dash: [8, 4] }],
    });
    const area = this.chart.plot.over;
    const drag = (event: PointerEvent): void => {
      const { across, up } = this.chart.at(event);
      dragged(Math.max(0, across), up);
    };
    let held: number | null = null; // the pointer that drags; a finger has capture anyway
    area.addEventListener("pointerdown", (event) => {
      // A finger that is put down elsewhere may want to scroll.
      if (event.pointerType === "touch" && Math.abs(event.offsetX - this.handle) > FINGER) return;
      area.setPointerCapture(event.pointerId);
      held = event.pointerId;
      drag(event);
    });
    area.addEventListener("pointermove", (event) => {
      if (event.pointerId === held) drag(event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      area.addEventListener(end, () => (held = null));
    }
  }

  override show({ states, fold, largest: { torque }, ends: [lowest], axes: { highest } }: Picture): void {
    const back = fold?.return_torque ?? 0.75 * torque;
    const low = Math.min(0.84 * torque, back - 0.4 * (torque - back));
    this.chart.show([states.creepage, ...byStability(states.torque, states)], [lowest, highest],
      [Math.max(0, low), torque + 0.2 * (torque - low)]);
  }

  describe({ run, shown: { fold } }: Moment): string {
    const at = `The wheel is at ${digits(1e-3 * run.now.drive_torque)} kN m and ${percent(run.now.creepage)}.`;
    return fold === null ? `Steady creepage over torque, without a fold. ${at}`
      : `Steady creepage over torque: stable up to the fold at ${digits(1e-3 * fold.drive_torque, 4)} ` +
        `kN m and ${percent(fold.creepage)}. ${at}`;
  }

  draw({ run, shown, control, span }: Moment): void {
    this.chart.draw((pen) => {
      const { fold, ends: [lowest] } = shown, held = control.mode === "creep";
      const { drive_torque: acting, creepage } = run.now, target = control.drive_torque;
      if (held) pen.rule("up", control.creepage, "torque", 1.2, [4, 4]);
      else pen.rule("across", target, "torque", 1.2, [4, 4]);
      const past = trail(run.history, "drive_torque", "creepage", run.now.time - 6 * span, lowest);
      pen.line(past, "trail", 1.6);
      pen.rule("across", acting, "torque", 1.8);
      if (!held) pen.handle(target, "torque");
      this.handle = held ? Infinity : pen.across(target);
      if (fold !== null) {
        pen.dot(fold.drive_torque, fold.creepage, "ink", false, 3.5);
        const text = `fold ${digits(1e-3 * fold.drive_torque, 4)} kN m`;
        pen.label(text, fold.drive_torque, fold.creepage, 9, 18, "ink");
        if (fold.return_creepage < shown.axes.highest) {
          pen.dot(fold.return_torque, fold.return_creepage, "ink", false, 3.5);
          pen.label("return", fold.return_torque, fold.return_creepage, -9, -4, "ink", "right");
        }
      }
      if (held) pen.words("reference", 6, pen.up(control.creepage) - 10, "torque", "left", true);
      pen.wheel(acting, Math.max(creepage, 1e-3 * lowest), "ink",
        `${digits(1e-3 * acting)} kN m, ${percent(creepage)}`);
    });
  }
}
