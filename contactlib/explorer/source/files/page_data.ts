/** What the build or the command put into the page as JSON under this id; null without. */
export function pageData(id: string): unknown {
  const text = document.getElementById(id)?.textContent?.trim();
  return text ? JSON.parse(text) : null;
}
