/* What buttons, lists, files, the address and keys do. */

import { fromAddress, toAddress } from "../files";
import type { App } from "./app";
import { choose, open, presets, save } from "./choices";
import { find } from "./elements";
import { STORIES } from "./stories";

/** Let buttons, lists, files, address and keys do what they say. */
export function wire(app: App, toast: (text: string) => void, changed: () => void): void {
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
    app.layPatch();
  });
  on("share", () => void share(app, toast));
  on("open-model", () => find("model-file").click());
  on("save-model", () => save(app, toast));
  on("help-button", () => find<HTMLDialogElement>("help").showModal());
  find("playback").addEventListener("change", () => {
    app.settings.playback = Number(find<HTMLSelectElement>("playback").value);
    changed();
  });
  find("preset").addEventListener("change", () => {
    app.use(choose(find<HTMLSelectElement>("preset").value));
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
    choose(settings.preset);
    app.use(settings);
    if (problems.length > 0) toast(`Of the address: ${problems.join("; ")}`);
  });
  document.addEventListener("keydown", (event) => key(app, event));
}

/** Keys, where they mean nothing else. */
function key(app: App, event: KeyboardEvent): void {
  const target = event.target as HTMLElement;
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
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
