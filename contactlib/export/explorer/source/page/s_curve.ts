/* Steady creepage over the drive torque: the S-curve, its fold and its hysteresis. */

import { View } from "./chart";
import { digits, percent } from "./format";
import { trail } from "./pen";
import { byStability, type Moment, type Picture } from "./picture";

const FINGER = 32; // distance at which a finger takes hold of the handle [px]
const MOST = 10; // creepage that the axis ends at [1]

/** Told of the torque [N.m] and creepage [1] to which a visitor drags. */
type Dragged = (driveTorque: number, creepage: number) => void;

export class SteadyStates extends View {
  private handle = 0; // place of the torque's [px]

  constructor(place: HTMLElement, dragged: Dragged) {
    super(place, {
      turned: true,
      x: { label: "creepage \u03b6  [%]", log: true, size: 46 },
      y: { label: "drive torque T  [kN m]" },
      curves: [{ colour: "stable" }, { colour: "unstable", dash: [8, 4] }],
    });
    const area = this.chart.plot.over;
    const drag = (event: PointerEvent): void => {
      const { across, up } = this.chart.at(event);
      dragged(1e3 * Math.max(0, across), 1e-2 * up);
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

  override show({ states, fold, most: { torque }, ends: [least] }: Picture): void {
    const [stable, unstable] = byStability(states.torque, states.pole, 1e-3);
    const creepage = states.creepage.map((z) => 100 * Math.max(z, 1e-3 * least));
    const most = 1e-3 * torque, back = 1e-3 * (fold?.return_torque ?? 0.75 * torque);
    const low = Math.min(0.84 * most, back - 0.4 * (most - back));
    this.chart.show([creepage, stable, unstable], [100 * least, 100 * MOST],
      [Math.max(0, low), most + 0.2 * (most - low)]);
  }

  describe({ run, shown: { fold } }: Moment): string {
    const at = `The wheel is at ${digits(1e-3 * run.now.drive_torque)} kN m and ${percent(run.now.creepage)}.`;
    return fold === null ? `Steady creepage over torque, without a fold. ${at}`
      : `Steady creepage over torque: stable up to the fold at ${digits(1e-3 * fold.drive_torque, 4)} ` +
        `kN m and ${percent(fold.creepage)}. ${at}`;
  }

  draw({ run, shown, control, span }: Moment): void {
    this.chart.draw((pen) => {
      const { fold, ends: [least] } = shown;
      const wanted = 1e-3 * control.drive_torque, acting = 1e-3 * run.now.drive_torque;
      if (control.mode === "torque") {
        pen.rule("across", wanted, "torque", 1.2, [4, 4]);
      } else {
        pen.rule("up", 100 * control.creepage, "torque", 1.2, [4, 4]);
      }
      pen.line(trail(run.history, "drive_torque", "creepage", run.now.time - 6 * span, 1e-3, 100,
        100 * least), "trail", 1.6);
      pen.rule("across", acting, "torque", 1.8);
      if (control.mode === "torque") pen.handle(wanted, "torque");
      this.handle = control.mode === "torque" ? pen.across(wanted) : Infinity;
      if (fold !== null) {
        const zeta = 100 * fold.creepage;
        pen.dot(1e-3 * fold.drive_torque, zeta, "ink", false, 3.5);
        const text = `fold ${digits(1e-3 * fold.drive_torque, 4)} kN m`;
        pen.label(text, 1e-3 * fold.drive_torque, zeta, 9, 18, "ink");
        if (fold.return_creepage < MOST) {
          pen.dot(1e-3 * fold.return_torque, 100 * fold.return_creepage, "ink", false, 3.5);
          pen.label("return", 1e-3 * fold.return_torque, 100 * fold.return_creepage, -9, -4, "ink",
            "right");
        }
      }
      if (control.mode === "creep") {
        pen.words("reference", 6, pen.up(100 * control.creepage) - 10, "torque", "left", true);
      }
      pen.wheel(acting, 100 * Math.max(run.now.creepage, 1e-3 * least), "ink",
        `${digits(acting)} kN m, ${percent(run.now.creepage)}`);
    });
  }
}
