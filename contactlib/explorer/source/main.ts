// What the page starts with.
import { embeddedKernel } from "./kernel/embedded";

const ready = embeddedKernel().then((kernel) => ({ kernel }));

Object.assign(globalThis, { contactlib: { ready } });
