/* Puts the page together: charts, controls, files, address and keys. */

import {
  fromAddress, givenModel, ModelError, pagePresets, readModel, type Settings, settingsOf, toAddress,
  writeModel,
} from "../files";
import type { Kernel } from "../kernel/kernel";
import { App } from "./app";
import { CreepCurve } from "./creep_curve";
import { TimeHistory } from "./history";
import { fillHelp } from "./help";
import { PatchView } from "./patch_view";
import { PhasePortrait } from "./phase";
import { makeRows, modelNote, type Rows, spanRows } from "./rows";
import { SteadyStates } from "./s_curve";
import { STORIES } from "./stories";
import { beginTheme } from "./theme";

const PLAYBACK: [number, string][] = [
  [0.01, "100 \u00d7 slower"], [0.02, "50 \u00d7 slower"],
  [0.05, "20 \u00d7 slower"], [0.1, "10 \u00d7 slower"], [0.2, "5 \u00d7 slower"],
  [0.5, "2 \u00d7 slower"], [1, "real time"], [2, "2 \u00d7 faster"], [5, "5 \u00d7 faster"],
];
const WELCOME = "Drag the torque up slowly, past the fold, or choose an experiment.";
const TOAST = 6000; // that a message stays [ms]
const ADDRESS = 400; // after a change until it is in the address [ms]

const find = <T extends HTMLElement>(id: string): T => {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`the page has no element ${id}`);
  return found as T;
};
const plot = (id: string): HTMLElement => find(id).querySelector<HTMLElement>(".plot") as HTMLElement;

const presets = pagePresets();
const base = Object.keys(presets)[0] as string; // what the address of an opened model counts from

/** Settings to choose from: of the shipped models, and of those that were opened. */
const choices = new Map<string, Settings>(Object.entries(presets));
let choice = base; // the one in use

/** Start the app in the page. */
export function begin(kernel: Kernel): App {
  let rows: Rows | null = null;
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
  const views = [
    new CreepCurve(plot("creep-curve")), curve, new PhasePortrait(plot("phase")),
    new TimeHistory(find("history")),
    new PatchView(plot("patch"), find<HTMLCanvasElement>("patch").querySelector("canvas") as HTMLCanvasElement),
  ];

  /** Show everywhere what holds now, and keep it in the address. */
  const changed = (): void => {
    if (rows === null) return;
    spanRows(rows, app);
    for (const row of Object.values(rows).flat()) row.show();
    const { mode } = app.control;
    find("drive-rows").replaceChildren(...(mode === "torque" ? rows.torque : rows.creep).map((r) => r.element));
    find("s-curve").classList.toggle("creep", mode === "creep");
    check("mode", mode);
    check("contact", app.settings.vehicle.contact);
    find("play").textContent = app.playing ? "Pause" : "Play";
    find<HTMLSelectElement>("playback").value = String(app.settings.playback);
    find<HTMLSelectElement>("preset").value = choice;
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

  const given = givenModel();
  if (given !== null) choices.set("given", settingsOf(readModel(given), base));
  const { settings, problems } = fromAddress(location.hash, presets);
  choice = given !== null && location.hash === "" ? "given" : settings.preset;
  const first = choice === "given" ? choices.get("given") : settings;
  const app = new App(kernel, structuredClone(first as Settings), {
    views, numbers: find("numbers"), warning: find("warning"), clearing: find("clearing"),
    clock: find("clock"), say, toast, changed,
    speak: (text) => (find("spoken").textContent = text),
  });
  rows = makeRows(app);
  find("kick-rows").prepend(...rows.kick.map((row) => row.element));
  find("wet-rows").prepend(...rows.wet.map((row) => row.element));
  find("wheel-rows").append(...rows.wheel.map((row) => row.element));
  fillHelp(find("help-text"));
  offer();
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

function offer(): void {
  find("preset").replaceChildren(
    ...[...choices].map(([key, { vehicle }]) =>
      new Option(key in presets ? vehicle.name : `${vehicle.name} (${key})`, key)));
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

function wire(app: App, toast: (text: string) => void, changed: () => void): void {
  const on = (id: string, act: () => void): void => find(id).addEventListener("click", act);
  on("play", () => app.play(!app.playing));
  on("reset", () => {
    app.endStory();
    app.restart();
  });
  on("more", () => {
    const more = find("drive").classList.toggle("more");
    find("more").setAttribute("aria-expanded", String(more));
    find("more").textContent = more ? "Less" : "More";
  });
  on("kick", () => app.kick());
  on("wet", () => app.layPatch());
  on("share", () => void share(app, toast));
  on("open-model", () => find("model-file").click());
  on("save-model", () => save(app));
  on("help-button", () => find<HTMLDialogElement>("help").showModal());
  find("playback").addEventListener("change", () => {
    app.settings.playback = Number(find<HTMLSelectElement>("playback").value);
    changed();
  });
  find("preset").addEventListener("change", () => {
    choice = find<HTMLSelectElement>("preset").value;
    app.use(structuredClone(choices.get(choice) as Settings));
  });
  for (const input of document.querySelectorAll<HTMLInputElement>("input[type=radio]")) {
    input.addEventListener("change", () => {
      app.endStory();
      if (input.name === "mode") {
        if (input.value === "torque") app.control.drive_torque = app.run.driveTorque;
        else app.control.creepage = app.run.creepage;
        app.control.mode = input.value as "torque" | "creep";
      } else {
        app.change(() => (app.settings.vehicle.contact = input.value as "line" | "elliptic"));
      }
      changed();
    });
  }
  const file = find<HTMLInputElement>("model-file");
  const take = async (chosen: File | undefined): Promise<void> => {
    if (chosen !== undefined) await open(app, chosen, toast);
    file.value = "";
  };
  file.addEventListener("change", () => void take(file.files?.[0]));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    void take(event.dataTransfer?.files[0]);
  });
  addEventListener("hashchange", () => {
    const { settings, problems } = fromAddress(location.hash, presets);
    choice = settings.preset;
    app.use(settings);
    if (problems.length > 0) toast(`Of the address: ${problems.join("; ")}`);
  });
  document.addEventListener("keydown", (event) => key(app, event));
}

/** Keys, where they mean nothing else. */
function key(app: App, event: KeyboardEvent): void {
  const target = event.target as HTMLElement;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (target instanceof HTMLInputElement && target.type === "text") return;
  if (target instanceof HTMLSelectElement) return; // letters choose in it
  if (document.querySelector("dialog[open]") !== null) return;
  const story = STORIES[Number(event.key) - 1];
  const button: Record<string, string> = { k: "kick", w: "wet", r: "reset", "?": "help-button" };
  if (story !== undefined) app.tell(story);
  else if (event.key === " " && !/^(BUTTON|INPUT|SUMMARY)$/.test(target.tagName)) app.play(!app.playing);
  else if (event.key.toLowerCase() in button) find(button[event.key.toLowerCase()] as string).click();
  else return;
  event.preventDefault();
}

async function share(app: App, toast: (text: string) => void): Promise<void> {
  history.replaceState(null, "", toAddress(app.settings, presets));
  try {
    await navigator.clipboard.writeText(location.href);
    toast("The link is copied. It opens the page as it is now.");
  } catch {
    toast("The link is in the address bar: copy it from there.");
  }
}

async function open(app: App, file: File, toast: (text: string) => void): Promise<void> {
  try {
    if (file.size > 1e6) throw new ModelError(`${file.name} has ${file.size} bytes: a model has at most 1000000`);
    const settings = settingsOf(readModel(await file.text()), base);
    choices.set(file.name, settings);
    choice = file.name;
    offer();
    app.use(structuredClone(settings));
    toast(`${file.name}: ${app.settings.vehicle.name}`);
  } catch (error) {
    if (!(error instanceof ModelError)) throw error;
    toast(`${file.name}: ${error.message}`);
  }
}

function save(app: App): void {
  const { vehicle, normalLoad, speed, control } = app.settings;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(
    new Blob([writeModel({ ...vehicle, initial_speed: speed }, normalLoad, control)], { type: "application/toml" }));
  link.download = `${choice.replace(/\.toml$/, "")}_explored.toml`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
