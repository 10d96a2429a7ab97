/* Starts the explorer with what the build put into the page, and shows its parts to scripts. */

import * as files from "./files";
import { embeddedKernel } from "./kernel/embedded";
import { begin } from "./page/begin";
import * as clearing from "./physics/clearing";
import * as history from "./physics/history";
import * as patch from "./physics/patch";
import * as plant from "./physics/plant";
import * as roots from "./physics/roots";
import * as run from "./physics/run";
import * as stability from "./physics/stability";
import * as vehicle from "./physics/vehicle";

/** The app, when the kernel has been compiled. */
const ready = embeddedKernel().then((kernel) => ({ kernel, app: begin(kernel) }));
ready.catch((error: unknown) => {
  const place = document.getElementById("story");
  if (place !== null) place.textContent = `The page cannot start: ${String(error)}`;
});

Object.assign(globalThis, {
  contactlib: {
    ready, clearing, files, history, patch, plant, roots, run, stability, vehicle,
  },
});
