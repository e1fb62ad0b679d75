// bundle.mjs - third-party code for the page, from what `npm ci` installed.
//
//   node bundle.mjs NODE_MODULES OUT
//
// Writes one minified ES module per file of entry/, with what they share in
// chunks of their own, uPlot's style sheet, and the licences of every package
// that went in.  The same lock file gives the same bytes.
import { mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, dirname, join, relative, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const [modules, out] = process.argv.slice(2).map((path) => resolve(path));
const entries = readdirSync(join(here, "entry"))
  .sort()
  .map((name) => join(here, "entry", name));
const { build } = createRequire(join(modules, "esbuild", "package.json"))("esbuild");

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });

const result = await build({
  absWorkingDir: here,
  bundle: true,
  chunkNames: "shared-[hash]",
  entryPoints: entries,
  format: "esm",
  legalComments: "none",
  logLevel: "warning",
  metafile: true,
  minify: true,
  nodePaths: [modules],
  outdir: out,
  splitting: true,
  target: "es2022",
});

const packages = new Set();
for (const input of Object.keys(result.metafile.inputs)) {
  const inside = relative(modules, resolve(here, input));
  if (inside.startsWith("..")) continue;
  const parts = inside.split(/[\\/]/);
  packages.add(parts[0].startsWith("@") ? `${parts[0]}/${parts[1]}` : parts[0]);
}

function licence(name) {
  const folder = join(modules, name);
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
  if (file === undefined) throw new Error(`${name}: no licence file`);
  const text = readFileSync(join(folder, file), "utf8").trim();
  return `${name} ${about.version} (${about.license})\n\n${text}\n`;
}

const rule = `\n${"-".repeat(72)}\n\n`;
writeFileSync(join(out, "LICENSES.txt"), [...packages].sort().map(licence).join(rule));
writeFileSync(
  join(out, "strip.css"),
  readFileSync(join(modules, "uplot", "dist", "uPlot.min.css")),
);
for (const name of readdirSync(out).sort()) {
  const size = readFileSync(join(out, name)).length;
  console.log(`${basename(name).padEnd(28)} ${String(size).padStart(8)} bytes`);
}
