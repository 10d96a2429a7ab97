/* The models that a visitor can choose: those that are shipped, and those that were opened. */

import { readModel, writeModel } from "../files/model_file";
import { ModelError } from "../files/reading";
import { givenModel, PRESETS, type Settings, settingsOf } from "../files/settings";
import type { App } from "./app";
import { find, made, toast } from "./elements";

const MAX_BYTES = 1e6; // bytes of a model file

const base = Object.keys(PRESETS)[0]!; // the preset of an opened model in the address

const choices = new Map<string, Settings>(Object.entries(PRESETS));
let choice = base; // the one in use

/** The model that the command put into the page, if there is one. */
export function takeGiven(): Settings | null {
  const given = givenModel();
  return given === null ? null : add("given", given);
}

/** Add a model file to the choices, and choose it; a shipped model keeps its name. */
function add(file: string, text: string): Settings {
  const settings = settingsOf(readModel(text), base);
  choice = file in PRESETS ? `${file}.toml` : file;
  choices.delete(choice); // so that it goes to the end of the list, even if it was there
  choices.set(choice, settings);
  offer();
  return structuredClone(settings);
}

/** Choose one; returns the settings that it begins with. */
export function choose(key: string): Settings {
  choice = key;
  return structuredClone(choices.get(key) as Settings);
}

/** Choose the model of an address: one of that name, else that of the link. */
export function chooseLinked(settings: Settings): void {
  const { name } = settings.vehicle;
  const same = [...choices].find(([, { vehicle }]) => vehicle.name === name);
  choice = same?.[0] ?? "link";
  if (same !== undefined) return;
  choices.set(choice, structuredClone(settings));
  offer();
}

/** Show the choices in the page. */
export function offer(): void {
  find("preset").replaceChildren(...[...choices].map(([key, { vehicle }]) =>
    new Option(key in PRESETS ? vehicle.name : `${vehicle.name} (${key})`, key)));
}

/** Show which is in use. */
export function showChoice(): void {
  find<HTMLSelectElement>("preset").value = choice;
}

/** Open a model file, or show what is wrong with it. */
export async function open(app: App, file: File): Promise<void> {
  try {
    if (file.size > MAX_BYTES) {
      throw new ModelError(`has ${file.size} bytes: a model has at most ${MAX_BYTES}`);
    }
    app.use(add(file.name, await file.text()));
    toast(`${file.name}: ${app.settings.vehicle.name}`);
  } catch (error) {
    if (!(error instanceof ModelError)) throw error;
    toast(`${file.name}: ${error.message}`);
  }
}

/** Save the present model as a file, or show why no file can hold it. */
export function save(app: App): void {
  const { vehicle, axleLoad, speed } = app.settings;
  const file = choice !== "given" && choice !== "link" ? choice.replace(/\.toml$/, "")
    : vehicle.name.toLowerCase().replace(/[^a-z0-9]+/g, "_");
  try {
    const initial_speed = speed > 0 ? speed : vehicle.initial_speed; // a file's model rolls
    const text = writeModel({ ...vehicle, initial_speed }, axleLoad);
    const link = made("a", {
      href: URL.createObjectURL(new Blob([text], { type: "application/toml" })),
      download: `${file}_explored.toml`,
    });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  } catch (error) {
    if (!(error instanceof ModelError)) throw error;
    toast(error.message);
  }
}
