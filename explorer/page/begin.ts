/* Puts the page together: charts, controls, files, address and keys. */

import { fromAddress, type Settings, toAddress } from "../files/settings";
import type { Vehicle } from "../physics/vehicle";
import { App } from "./app";
import type { View } from "./chart";
import { choose, chooseLinked, offer, open, save, showChoice, takeGiven } from "./choices";
import { CreepCurve } from "./creep_curve";
import { find, made, plot, toast } from "./elements";
import { TimeHistory } from "./history";
import { PatchView } from "./patch_view";
import { PhasePortrait } from "./phase";
import { makeRows, modelNote, type Rows, spanRows } from "./rows";
import { SteadyStates } from "./s_curve";
import { STORIES } from "./stories";
import { beginTheme } from "./theme";

const ADDRESS = 400; // from a change until it is in the address [ms]

/** Start the app in the page. */
export function begin(): App {
  let rows: Rows | null = null, modeShown = "";
  let addressTimer = 0;

  const curve = new SteadyStates(plot("s-curve"), (driveTorque, creepage) => {
    app.endStory();
    if (app.control.mode === "torque") app.control.drive_torque = driveTorque;
    else app.control.creepage = Math.min(creepage, app.shown.base);
    app.changed();
  });
  const views: View[] = [
    new CreepCurve(plot("creep-curve")), curve, new PhasePortrait(plot("phase")),
    new TimeHistory(find("history")), new PatchView(plot("patch"), find<HTMLCanvasElement>("above")),
  ];

  /** Show the present settings everywhere, and keep them in the address. */
  const changed = (): void => {
    if (rows === null) return;
    spanRows(rows, app);
    for (const row of Object.values(rows).flat()) row.settle();
    const { mode } = app.control;
    if (mode !== modeShown) { // otherwise a row would lose the focus
      const drive = mode === "torque" ? rows.torque : rows.creep;
      find("drive-rows").replaceChildren(...drive.map((row) => row.element));
      find("s-curve").classList.toggle("creep", mode === "creep");
      modeShown = mode;
    }
    check("mode", mode);
    check("contact", app.settings.vehicle.contact);
    check("memory", String(app.settings.vehicle.memory));
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
      history.replaceState(null, "", toAddress(app.settings));
    }, ADDRESS);
  };

  offer();
  const given = takeGiven();
  const { settings, problems } = fromAddress(location.hash);
  const fresh = given !== null && location.hash === "";
  if (!fresh) chooseLinked(settings);
  const app = orPreset(fresh ? given : settings, problems, (chosen) => new App(chosen, {
    views, changed, moved: () => rows?.following.forEach((row) => row.show()),
  }));
  for (const { place } of views) place.setAttribute("role", "img");
  new ResizeObserver(() => app.redraw()).observe(find("charts"));
  keepWhole(document.querySelector<HTMLElement>(".side")!);
  rows = makeRows(app);
  find("kick-rows").prepend(...rows.kick.map((row) => row.element));
  find("wet-rows").prepend(...rows.wet.map((row) => row.element));
  find("wheel-rows").append(...rows.wheel.map((row) => row.element));
  fillStories(app);
  wire(app);
  beginTheme(find("theme"), () => app.repaint());
  if (problems.length > 0) toast(`In the ${fresh ? "model" : "address"}: ${problems.join("; ")}`);
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

/** End a column that scrolls above the first control that it would cut. */
function keepWhole(side: HTMLElement): void {
  const fit = (): void => {
    side.style.maxHeight = "";
    if (getComputedStyle(side).overflowY !== "auto") return;
    const { top, bottom } = side.getBoundingClientRect(), scrolled = side.scrollTop;
    const ends = Array.from(side.querySelectorAll(".row, .switch, .select, .transport, .rows > button, .note, h2"))
      .map((control) => control.getBoundingClientRect())
      .map((box) => ({ from: box.top + scrolled, to: box.bottom + scrolled }));
    const cut = ends.filter(({ from, to }) => from < bottom && to > bottom).map(({ from }) => from);
    if (cut.length > 0) side.style.maxHeight = `${Math.floor(Math.min(...cut) - top)}px`;
  };
  const observer = new ResizeObserver(fit);
  for (const panel of side.children) observer.observe(panel);
  observer.observe(document.documentElement);
  observer.observe(find("charts"));
}

/** Begin with settings or, if they cannot run, with their preset. */
function orPreset<Begun>(
  settings: Settings, problems: string[], start: (settings: Settings) => Begun,
): Begun {
  const changes = decodeURIComponent(toAddress(settings)).split("&").slice(1).join(", ");
  try {
    return start(settings);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    problems.push(`nothing runs with all of ${changes} (${error.message})`);
    return start(choose(settings.preset));
  }
}

function check(name: string, value: string): void {
  const input = document.querySelector<HTMLInputElement>(`input[name="${name}"][value="${value}"]`);
  if (input !== null) input.checked = true;
}

function showPlayback(playback: number): void {
  const select = find<HTMLSelectElement>("playback"), value = String(playback);
  if (![...select.options].some((option) => option.value === value)) { // an address may hold any
    select.append(new Option(`${value} \u00d7 real time`, value));
  }
  select.value = value;
}

function fillStories(app: App): void {
  const buttons = STORIES.map((story, i) => {
    const button = made("button", { type: "button", title: `Key ${i + 1}` }, story.name);
    button.addEventListener("click", () => app.startStory(story));
    return button;
  });
  find("stories").append(...buttons);
}

/** Connect buttons, lists, files, the address and keys. */
function wire(app: App): void {
  const on = (id: string, act: () => void): void => find(id).addEventListener("click", act);
  on("play", () => app.play(!app.playing));
  on("reset", () => app.reset());
  on("more", () => {
    const more = find("drive").classList.toggle("more");
    find("more").setAttribute("aria-expanded", String(more));
    find("more").textContent = more ? "Less" : "More";
  });
  on("kick", () => {
    app.endStory();
    app.kick();
  });
  on("wet", () => {
    app.endStory();
    app.placePatch();
  });
  on("share", () => void share(app));
  on("open-model", () => find("model-file").click());
  on("save-model", () => save(app));
  on("help-button", () => find<HTMLDialogElement>("help").showModal());
  find("playback").addEventListener("change", () => {
    app.settings.playback = Number(find<HTMLSelectElement>("playback").value);
    app.changed();
  });
  find("preset").addEventListener("change", () => {
    app.use(choose(find<HTMLSelectElement>("preset").value));
  });
  for (const input of document.querySelectorAll<HTMLInputElement>("input[type=radio]")) {
    input.addEventListener("change", () => {
      app.endStory();
      if (input.name === "mode") {
        if (input.value === "torque") app.control.drive_torque = app.run.now.drive_torque;
        else app.control.creepage = app.run.now.creepage;
        app.control.mode = input.value as "torque" | "creep";
      } else if (input.name === "contact") {
        changeContact(app, { contact: input.value as "line" | "elliptic" });
      } else changeContact(app, { memory: input.value === "true" });
      app.changed();
    });
  }
  const file = find<HTMLInputElement>("model-file");
  const take = async (chosen: File | undefined): Promise<void> => {
    if (chosen !== undefined) await open(app, chosen);
    file.value = "";
  };
  file.addEventListener("change", () => void take(file.files?.[0]));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    void take(event.dataTransfer?.files[0]);
  });
  addEventListener("hashchange", ({ newURL }) => { // as the page may have replaced the address
    const { settings, problems } = fromAddress(new URL(newURL).hash);
    chooseLinked(settings);
    orPreset(settings, problems, (chosen) => app.use(chosen));
    if (problems.length > 0) toast(`In the address: ${problems.join("; ")}`);
  });
  document.addEventListener("keydown", (event) => key(app, event));
  document.addEventListener("click", ({ target, detail }) => { // so that Space pauses after a click
    const button = (target as Element).closest("button");
    if (detail > 0 || button?.ariaPressed === "true") button?.blur();
  });
}

/** Change the contact, or show why it cannot be changed so. */
function changeContact(app: App, changes: Partial<Vehicle>): void {
  try {
    app.change(() => Object.assign(app.settings.vehicle, changes));
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    toast(error.message);
  }
}

/** A key that has no other meaning where it was pressed. */
function key(app: App, event: KeyboardEvent): void {
  const target = event.target as HTMLElement;
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  if (target instanceof HTMLInputElement && target.type === "text") return;
  if (target instanceof HTMLSelectElement) return; // in which letters choose
  if (document.querySelector("dialog[open]") !== null) return;
  const story = STORIES[Number(event.key) - 1];
  const button: Record<string, string> = { k: "kick", w: "wet", r: "reset", "?": "help-button" };
  if (story !== undefined) app.startStory(story);
  else if (event.key === " " && !/^(BUTTON|SUMMARY)$/.test(target.tagName)) app.play(!app.playing);
  else if (event.key.toLowerCase() in button) find(button[event.key.toLowerCase()] as string).click();
  else return;
  event.preventDefault();
}

async function share(app: App): Promise<void> {
  history.replaceState(null, "", toAddress(app.settings));
  try {
    await navigator.clipboard.writeText(location.href);
    toast("The link is copied. It opens the page as it is now.");
  } catch {
    toast("The link is in the address bar: copy it from there.");
  }
}
