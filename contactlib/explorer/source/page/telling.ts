/* How a guided experiment is told: step by step, each until something is so. */

import type { RunEvent } from "../physics/run";
import type { App } from "./app";

/** One thing that is done, what is said meanwhile, and when it is over. */
export interface Step {
  say(app: App): string;
  begin?(app: App): void;
  /** Over after so many simulated seconds, when something happens, or when this is true. */
  until: number | RunEvent["name"] | ((app: App) => boolean);
}

export interface Story {
  name: string;
  /** Why it cannot be told of this wheel, in one line; null if it can. */
  cannot(app: App): string | null;
  steps: Step[];
}

/** A story as it is told. */
export class Telling {
  private step = -1;
  private since = 0;

  constructor(private readonly app: App, readonly story: Story) {
    this.next();
  }

  /** Go on if the step is over; told of what happened since the last frame. */
  frame(events: RunEvent[]): void {
    const { until } = this.story.steps[this.step] as Step;
    const over = typeof until === "number" ? this.app.run.time - this.since >= until
      : typeof until === "function" ? until(this.app)
      : events.some((event) => event.name === until);
    if (over) this.next();
  }

  private next(): void {
    const step = this.story.steps[++this.step];
    if (step === undefined) return;
    step.begin?.(this.app);
    this.since = this.app.run.time;
    this.app.say(step.say(this.app));
  }
}
