/* Creep force over creepage, and where the wheel is on that curve. */

import { View } from "./chart";
import { digits, percent } from "./format";
import { byStability, type Moment, type Picture, POINTS } from "./picture";

export class CreepCurve extends View {
  constructor(place: HTMLElement) {
    super(place, {
      x: { label: "creepage \u03b6  [%]", per: 100 },
      y: { label: "creep force Q  [kN]", per: 1e-3, size: 40 },
      curves: [
        { colour: "stable" },
        { colour: "unstable", dash: [8, 4] },
        { colour: "wet-ink", width: 1.6, dash: [2, 3] },
      ],
    });
  }

  override show({ dry, wet, largest, base }: Picture): void {
    const curves = [...byStability(dry.force, dry), wet?.force ?? dry.force.map(() => NaN)];
    this.chart.show([dry.creepage, ...curves], [0, base], [0, 1.25 * largest.force]);
  }

  describe({ run, shown }: Moment): string {
    return `Creep force over creepage: its peak is ${digits(1e-3 * shown.largest.force)} kN at ` +
      `${percent(shown.peak)}. The wheel is at ${percent(run.now.creepage)} with ` +
      `${digits(1e-3 * run.now.creep_force)} kN.`;
  }

  draw({ run, shown, control }: Moment): void {
    this.chart.draw((pen) => {
      const { peak, fold } = shown;
      const sliding = shown.plant.vehicle.kinetic_friction * shown.plant.axleLoad;
      pen.rule("up", sliding, "line", 1, [2, 3]);
      if (fold !== null) {
        pen.label(`peak ${percent(peak)}`, peak, shown.largest.force, 0, -13, "ink", "center");
      }
      if (shown.wet !== null) {
        pen.label(`wet, friction \u00d7 ${digits(shown.wetFriction, 2)}`, shown.base,
          shown.wet.force[POINTS - 1]!, -4, -11, "wet-ink", "right");
      }
      if (control.mode === "creep") {
        pen.rule("across", control.creepage, "torque", 1.5, [5, 4]);
        if (control.creepage < 0.8 * shown.base) {
          pen.words("reference", pen.across(control.creepage) + 5, pen.height - 12, "torque");
        }
      }
      // Force with which the contact would balance the torque: the wheel rests where it meets the
      // curve.
      const { plant } = shown, { creepage, creep_force, creepage_rate, speed } = run.now;
      const balancing = creep_force + creepage_rate / (plant.gain(speed) * plant.vehicle.radius);
      pen.rule("up", balancing, "torque", 1.5);
      pen.words("drive", pen.width - 5, pen.up(balancing) - 10, "torque", "right", true);
      if (creepage <= shown.base) { // else the wheel's mark at the edge needs the room
        pen.words("sliding f_d P", pen.width - 4, pen.up(sliding) + 11, "soft", "right");
      }
      pen.wheel(creepage, creep_force, "ink", percent(creepage));
    });
  }
}
