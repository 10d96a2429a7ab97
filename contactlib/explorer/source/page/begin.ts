/* Puts the page together: charts, controls, files, address and keys. */

import { fromAddress, toAddress } from "../files";
import type { Kernel } from "../kernel/kernel";
import { App } from "./app";
import { choose, offer, presets, showChoice, takeGiven } from "./choices";
import { CreepCurve } from "./creep_curve";
import { find, plot } from "./elements";
import { TimeHistory } from "./history";
import { fillHelp } from "./help";
import { PatchView } from "./patch_view";
import { PhasePortrait } from "./phase";
import { makeRows, modelNote, type Rows, spanRows } from "./rows";
import { SteadyStates } from "./s_curve";
import { STORIES } from "./stories";
import { beginTheme } from "./theme";
import type { View } from "./view";
import { wire } from "./wire";

const PLAYBACK: [number, string][] = [
  [0.01, "100 \u00d7 slower"], [0.02, "50 \u00d7 slower"],
  [0.05, "20 \u00d7 slower"], [0.1, "10 \u00d7 slower"], [0.2, "5 \u00d7 slower"],
  [0.5, "2 \u00d7 slower"], [1, "real time"], [2, "2 \u00d7 faster"], [5, "5 \u00d7 faster"],
];
const WELCOME = "Drag the torque up slowly, past the fold, or choose an experiment.";
const TOAST = 6000; // that a message stays [ms]
const ADDRESS = 400; // after a change until it is in the address [ms]

/** Start the app in the page. */
export function begin(kernel: Kernel): App {
  let rows: Rows | null = null, modeShown = "";
  let toastTimer = 0, addressTimer = 0;
  const say = (text: string): void => {
    find("story").textContent = text || WELCOME;
  };
  const toast = (text: string): void => {
    find("toast").textContent = text;
    clearTimeout(toastTimer);
    toastTimer = window.setTimeout(() => (find("toast").textContent = ""), TOAST);
  };

  const curve = new SteadyStates(plot("s-curve"), (driveTorque, creepage) => {
    app.endStory();
    if (app.control.mode === "torque") app.control.drive_torque = driveTorque;
    else app.control.creepage = Math.min(creepage, app.shown.far);
    changed();
  });
  const views: View[] = [
    new CreepCurve(plot("creep-curve")), curve, new PhasePortrait(plot("phase")),
    new TimeHistory(find("history")), new PatchView(plot("patch"), find<HTMLCanvasElement>("above")),
  ];

  /** Show everywhere what holds now, and keep it in the address. */
  const changed = (): void => {
    if (rows === null) return;
    spanRows(rows, app);
    for (const row of Object.values(rows).flat()) row.show();
    const { mode } = app.control;
    if (mode !== modeShown) { // else the row that has the focus would lose it
      const drive = mode === "torque" ? rows.torque : rows.creep;
      find("drive-rows").replaceChildren(...drive.map((row) => row.element));
      find("s-curve").classList.toggle("creep", mode === "creep");
      modeShown = mode;
    }
    check("mode", mode);
    check("contact", app.settings.vehicle.contact);
    find("play").textContent = app.playing ? "Pause" : "Play";
    showPlayback(app.settings.playback);
    showChoice();
    find("model-note").textContent = modelNote(app);
    for (const button of find("stories").children) {
      button.setAttribute("aria-pressed", String(button.textContent === app.story?.name));
    }
    keepAddress();
  };
  const keepAddress = (): void => {
    clearTimeout(addressTimer);
    addressTimer = window.setTimeout(() => {
      history.replaceState(null, "", toAddress(app.settings, presets));
    }, ADDRESS);
  };

  offer();
  const given = takeGiven();
  const { settings, problems } = fromAddress(location.hash, presets);
  const fresh = given !== null && location.hash === "";
  if (!fresh) choose(settings.preset);
  const app = new App(kernel, fresh ? given : settings, {
    views, numbers: find("numbers"), warning: find("warning"), clearing: find("clearing"),
    clock: find("clock"), say, toast, changed,
    moved: () => rows?.following.forEach((row) => row.show()),
    speak: (text) => (find("spoken").textContent = text),
  });
  for (const { place } of views) place.setAttribute("role", "img");
  new ResizeObserver(() => app.redraw()).observe(find("charts"));
  rows = makeRows(app);
  find("kick-rows").prepend(...rows.kick.map((row) => row.element));
  find("wet-rows").prepend(...rows.wet.map((row) => row.element));
  find("wheel-rows").append(...rows.wheel.map((row) => row.element));
  fillHelp(find("help-text"));
  fillStories(app);
  say("");
  wire(app, toast, changed);
  beginTheme(find("theme"), () => app.repaint());
  if (problems.length > 0) toast(`Of the address: ${problems.join("; ")}`);
  changed();

  const frame = (now: number): void => {
    requestAnimationFrame(frame);
    try {
      app.frame(now);
    } catch (error) {
      app.fail(error);
    }
  };
  requestAnimationFrame(frame);
  return app;
}

function check(name: string, value: string): void {
  const input = document.querySelector<HTMLInputElement>(`input[name="${name}"][value="${value}"]`);
  if (input !== null) input.checked = true;
}

function showPlayback(playback: number): void {
  const select = find<HTMLSelectElement>("playback"), value = String(playback);
  if (![...select.options].some((option) => option.value === value)) { // an address may say any
    select.append(new Option(`${value} \u00d7 real time`, value));
  }
  select.value = value;
}

function fillStories(app: App): void {
  STORIES.forEach((story, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = story.name;
    button.title = `Key ${i + 1}`;
    button.addEventListener("click", () => app.tell(story));
    find("stories").append(button);
  });
  for (const [value, text] of PLAYBACK) find("playback").append(new Option(text, String(value)));
}
