// Bundle the page's script and style; print both as JSON.
import { build } from "esbuild";

const { outputFiles } = await build({
  entryPoints: ["main.ts", "style.css"],
  bundle: true,
  minify: true,
  write: false,
  outdir: ".",
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none", // the licences stand whole in the page
});
const texts = outputFiles.map(({ path, text }) => [path.split(/[./\\]/).at(-1), text]);
process.stdout.write(JSON.stringify(Object.fromEntries(texts)));
