/* Starts the explorer with what the build put into the page, and shows its parts to scripts. */

import * as declared from "./files/declared";
import * as hertz from "./files/hertz";
import * as modelFile from "./files/model_file";
import * as settings from "./files/settings";
import { Kernel } from "./kernel/kernel";
import { begin } from "./page/begin";
import * as clearing from "./physics/clearing";
import * as limits from "./physics/limits";
import * as patch from "./physics/patch";
import * as plant from "./physics/plant";
import * as recorder from "./physics/recorder";
import * as roots from "./physics/roots";
import * as run from "./physics/run";
import * as stability from "./physics/stability";
import * as vehicle from "./physics/vehicle";

/** The app, when the kernel has been compiled. */
const ready = Kernel.embedded().then((kernel) => ({ kernel, app: begin(kernel) }));
ready.catch((error: unknown) => {
  const place = document.getElementById("story");
  if (place !== null) place.textContent = `The page cannot start: ${String(error)}`;
});

const files = { ...declared, ...hertz, ...limits, ...modelFile, ...settings };
Object.assign(globalThis, {
  contactlib: { ready, clearing, files, patch, plant, recorder, roots, run, stability, vehicle },
});
