/* Creep force over creepage, and where the wheel is on that curve. */

import { View } from "./chart";
import { digits, percent } from "./format";
import { byStability, type Moment, type Picture } from "./picture";

export class CreepCurve extends View {
  constructor(place: HTMLElement) {
    super(place, {
      x: { label: "creepage \u03b6  [%]" },
      y: { label: "creep force Q  [kN]", size: 40 },
      curves: [
        { colour: "stable" },
        { colour: "unstable", dash: [8, 4] },
        { colour: "wet-ink", width: 1.6, dash: [2, 3] },
      ],
    });
  }

  override show({ dry, wet, most, far }: Picture): void {
    const [stable, unstable] = byStability(dry.force, dry.pole, 1e-3);
    const kilo = wet?.force.map((v) => 1e-3 * v) ?? dry.force.map(() => NaN);
    this.chart.show([dry.creepage.map((z) => 100 * z), stable, unstable, kilo],
      [0, 100 * far], [0, 1.25e-3 * most.force]);
  }

  describe({ run, shown }: Moment): string {
    return `Creep force over creepage: its peak is ${digits(1e-3 * shown.most.force)} kN at ` +
      `${percent(shown.peak)}. The wheel is at ${percent(run.now.creepage)} with ` +
      `${digits(1e-3 * run.now.creep_force)} kN.`;
  }

  draw({ run, shown, control }: Moment): void {
    this.chart.draw((pen) => {
      const { peak, fold } = shown;
      const sliding = shown.plant.vehicle.kinetic_friction * shown.plant.normalLoad;
      pen.rule("up", 1e-3 * sliding, "line", 1, [2, 3]);
      if (fold !== null) {
        pen.label(`peak ${percent(peak)}`, 100 * peak, 1e-3 * shown.most.force, 0, -13, "ink", "center");
      }
      if (shown.wet !== null) {
        pen.label(`wet, friction \u00d7 ${digits(shown.wetFriction, 2)}`, 100 * shown.far,
          1e-3 * shown.wet.force.at(-1)!, -4, -11, "wet-ink", "right");
      }
      if (control.mode === "creep") {
        pen.rule("across", 100 * control.creepage, "torque", 1.5, [5, 4]);
        if (control.creepage < 0.8 * shown.far) {
          pen.words("reference", pen.across(100 * control.creepage) + 5, pen.height - 12, "torque");
        }
      }
      // Force with which the contact would balance the torque: the wheel rests where it meets the
      // curve.
      const { plant } = shown, { creepage, speed, friction } = run.now;
      const excess = run.now.drive_torque - plant.torque(creepage, speed, friction);
      const balancing = 1e-3 * (run.now.creep_force + excess / plant.vehicle.radius);
      pen.rule("up", balancing, "torque", 1.5);
      pen.words("drive", pen.width - 5, pen.up(balancing) - 10, "torque", "right", true);
      if (run.now.creepage <= shown.far) { // else the wheel's mark at the edge needs the room
        pen.words("sliding f_d P", pen.width - 4, pen.up(1e-3 * sliding) + 11, "soft", "right");
      }
      pen.wheel(100 * run.now.creepage, 1e-3 * run.now.creep_force, "ink", percent(run.now.creepage));
    });
  }
}
