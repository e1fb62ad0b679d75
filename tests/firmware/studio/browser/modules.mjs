// Packages of the tests are found where `make` has installed them.
import { register } from "node:module";
import { pathToFileURL } from "node:url";

const base = pathToFileURL("build/studio/npm/main.mjs").href;
const source = `
  let base;
  export const initialize = (data) => { base = data; };
  export const resolve = (name, context, next) =>
    /^(playwright-core|axe-core)/.test(name) ? next(name, { ...context, parentURL: base }) : next(name, context);
`;
register(`data:text/javascript,${encodeURIComponent(source)}`, { data: base });
