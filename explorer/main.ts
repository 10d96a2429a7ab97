/* Starts the explorer with what the build put into the page, and shows its parts to scripts. */

import * as kernelModule from "./kernel/kernel";

/** Start the kernel, and then the parts that call it. */
async function start(): Promise<object> {
  const kernel = await kernelModule.startKernel();
  const [declared, modelFile, settings, limits, clearing, patch, plant, recorder, run, stability,
    vehicle, { begin }] = await Promise.all([
    import("./files/declared"), import("./files/model_file"), import("./files/settings"),
    import("./physics/limits"), import("./physics/clearing"), import("./physics/patch"),
    import("./physics/plant"), import("./physics/recorder"), import("./physics/run"),
    import("./physics/stability"), import("./physics/vehicle"), import("./page/begin"),
  ]);
  const files = { ...declared, ...limits, ...modelFile, ...settings };
  Object.assign(contactlib, {
    clearing, files, kernel: kernelModule, patch, plant, recorder, run, stability, vehicle,
  });
  return { kernel, app: begin() };
}

/** The app, when the kernel has been compiled. */
const ready = start();
ready.catch((error: unknown) => {
  const place = document.getElementById("story");
  if (place !== null) place.textContent = `The page cannot start: ${String(error)}`;
});
const contactlib = { ready };
Object.assign(globalThis, { contactlib });
