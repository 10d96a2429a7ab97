// What the build or the command has put into the page, by the ids of its elements.

function text(id: string): string {
  const found = document.getElementById(id)?.textContent?.trim();
  if (!found) throw new Error(`the page has no element "${id}"`);
  return found;
}

/** An element of JSON. */
export function embeddedData(id: string): unknown {
  return JSON.parse(text(id));
}

/** An element of bytes in base64. */
export function embeddedBytes(id: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text(id)), (character) => character.charCodeAt(0));
}
