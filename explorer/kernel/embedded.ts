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

/** An element of bytes, which the command has compressed. */
export async function embeddedBytes(id: string): Promise<Uint8Array<ArrayBuffer>> {
  const bytes = Uint8Array.from(atob(embeddedData(id) as string), (character) => character.charCodeAt(0));
  const whole = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(whole).arrayBuffer());
}
