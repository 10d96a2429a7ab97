/* The force that the contact gives over the creepage, and where the wheel is on it. */

import { Chart } from "./chart";
import { digits, percent } from "./format";
import { byStability, type Picture } from "./picture";
import type { Moment, View } from "./view";

export class CreepCurve implements View {
  private readonly chart: Chart;

  constructor(readonly place: HTMLElement) {
    this.chart = new Chart(place, {
      x: { label: "creepage \u03b6  [%]" },
      y: { label: "creep force Q  [kN]", size: 40 },
      curves: [
        { colour: "stable" },
        { colour: "unstable", dash: [8, 4] },
        { colour: "wet-ink", width: 1.6, dash: [2, 3] },
      ],
    });
  }

  show(shown: Picture): void {
    const [stable, unstable] = byStability(shown.dry.force, shown.dry.pole, 1e-3);
    const wet = shown.wet === null
      ? shown.creepage.map(() => NaN)
      : shown.wet.force.map((v) => 1e-3 * v);
    const most = 1e-3 * Math.max(...shown.dry.force);
    this.chart.show([shown.creepage.map((z) => 100 * z), stable, unstable, wet],
      [0, 100 * shown.far], [0, 1.18 * most]);
  }

  repaint(): void {
    this.chart.repaint();
  }

  describe({ run, shown }: Moment): string {
    const most = Math.max(...shown.dry.force);
    return `Creep force over creepage: it peaks with ${digits(1e-3 * most)} kN at ` +
      `${percent(shown.peak)}. The wheel is at ${percent(run.creepage)} with ` +
      `${digits(1e-3 * run.creepForce)} kN.`;
  }

  draw({ run, shown, control }: Moment): void {
    this.chart.draw((pen) => {
      const { peak, fold } = shown;
      const most = Math.max(...shown.dry.force);
      const sliding = shown.plant.vehicle.kinetic_friction * shown.plant.normalLoad;
      pen.rule("up", 1e-3 * sliding, "line", 1, [2, 3]);
      if (fold !== null) {
        pen.label(`peak ${percent(peak)}`, 100 * peak, 1e-3 * most, 0, -13, "ink", "center");
      }
      if (shown.wet !== null) {
        const at = shown.creepage.length - 1;
        pen.label(`wet, friction \u00d7 ${digits(shown.wetFriction, 2)}`, 100 * shown.far,
          1e-3 * (shown.wet.force[at] ?? 0), -4, -11, "wet-ink", "right");
      }
      if (control.mode === "creep") {
        pen.rule("across", 100 * control.creepage, "torque", 1.5, [5, 4]);
        if (control.creepage < 0.8 * shown.far) {
          pen.words("reference", pen.across(100 * control.creepage) + 5, pen.height - 12, "torque");
        }
      }
      // What the torque asks of the contact: where it meets the curve, the wheel rests.
      const { plant } = shown, { creepage, speed, friction } = run;
      const excess = run.driveTorque - plant.torque(creepage, speed, friction);
      const asked = 1e-3 * (run.creepForce + excess / plant.vehicle.radius);
      pen.rule("up", asked, "torque", 1.5);
      const below = pen.up(asked) - pen.up(1e-3 * sliding);
      if (below < 0 || below > 20) {
        pen.words("sliding f_d P", pen.width - 4, pen.up(1e-3 * sliding) + 11, "soft", "right");
      }
      pen.words("drive", 6, pen.up(asked) - 10, "torque", "left", true);
      pen.wheel(100 * run.creepage, 1e-3 * run.creepForce, "ink", percent(run.creepage));
    });
  }
}
