// The kernel as the build put it into the page: its module and its tables in base64.
import { Kernel } from "./kernel";

function bytesOf(id: string): Uint8Array<ArrayBuffer> {
  const text = document.getElementById(id)?.textContent;
  if (!text) throw new Error(`the page has no element "${id}"`);
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

/** Start the page's own kernel. */
export function embeddedKernel(): Promise<Kernel> {
  return Kernel.load(bytesOf("kernel"), {
    line: bytesOf("table-line"),
    elliptic: bytesOf("table-elliptic"),
  });
}
