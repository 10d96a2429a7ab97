/* The models that a visitor can choose: those that are shipped, and those that were opened. */

import {
  givenModel, ModelError, pagePresets, readModel, type Settings, settingsOf, writeModel,
} from "../files";
import type { App } from "./app";
import { find } from "./elements";

const LARGEST = 1e6; // bytes of a model file

export const presets = pagePresets();
const base = Object.keys(presets)[0] as string; // what the address of an opened model counts from

const choices = new Map<string, Settings>(Object.entries(presets));
let choice = base; // the one in use

/** The model that the command put into the page, if there is one. */
export function takeGiven(): Settings | null {
  const given = givenModel();
  return given === null ? null : add("given", given);
}

/** Take a model file's text for a choice, and choose it; a shipped model keeps its name. */
function add(file: string, text: string): Settings {
  const settings = settingsOf(readModel(text), base);
  choice = file in presets ? `${file}.toml` : file;
  choices.delete(choice); // it may have changed: it goes to the end of the list
  choices.set(choice, settings);
  offer();
  return structuredClone(settings);
}

/** Choose one; its settings as they were when it came. */
export function choose(key: string): Settings {
  choice = key;
  return structuredClone(choices.get(key) as Settings);
}

/** Say in the page which there are. */
export function offer(): void {
  find("preset").replaceChildren(...[...choices].map(([key, { vehicle }]) =>
    new Option(key in presets ? vehicle.name : `${vehicle.name} (${key})`, key)));
}

/** Say which is in use. */
export function showChoice(): void {
  find<HTMLSelectElement>("preset").value = choice;
}

/** Open a model file; what is wrong with it is said. */
export async function open(app: App, file: File, toast: (text: string) => void): Promise<void> {
  try {
    if (file.size > LARGEST) {
      throw new ModelError(`has ${file.size} bytes: a model has at most ${LARGEST}`);
    }
    app.use(add(file.name, await file.text()));
    toast(`${file.name}: ${app.settings.vehicle.name}`);
  } catch (error) {
    if (!(error instanceof ModelError)) throw error;
    toast(`${file.name}: ${error.message}`);
  }
}

/** Give the model as it is now to the visitor, as a file; what no file can say is said. */
export function save(app: App, toast: (text: string) => void): void {
  const { vehicle, normalLoad, speed, control } = app.settings;
  try {
    const text = writeModel({ ...vehicle, initial_speed: speed }, normalLoad, control);
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
    link.download = `${choice.replace(/\.toml$/, "")}_explored.toml`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  } catch (error) {
    if (!(error instanceof ModelError)) throw error;
    toast(error.message);
  }
}
