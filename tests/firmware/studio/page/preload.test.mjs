// What the page needs at once is fetched at once.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";

const web = "firmware/studio/web";

// The modules that one imports, and those that these import; packages hold no more.
function importsOf(path, found = new Set()) {
  if (found.has(path) || path.startsWith("vendor/")) return found.add(path);
  found.add(path);
  const text = readFileSync(join(web, path), "utf8");
  for (const [, name] of text.matchAll(/^(?:import|export)\s[^;]*?from\s+"(\.[^"]+)"/gm))
    importsOf(join(dirname(path), name), found);
  return found;
}

test("index.html names every module that main.js needs", () => {
  const page = readFileSync(join(web, "index.html"), "utf8");
  const named = [...page.matchAll(/rel="modulepreload" href="([^"]+)"/g)].map(([, name]) => name);
  const needed = importsOf("main.js");
  needed.delete("main.js");
  assert.ok(needed.size > 30, `${needed.size} modules`);
  assert.deepEqual(named, [...needed].sort());
});
