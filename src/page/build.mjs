// Build of the page: one file with its script and style, the same bytes for the same input.
import { build } from "esbuild";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, "built", "page.html");

async function bundle(entry) {
  const result = await build({
    absWorkingDir: here,
    entryPoints: [entry],
    bundle: true,
    minify: true,
    format: "iife",
    target: ["es2022", "chrome110", "firefox113", "safari16.4"],
    legalComments: "none",
    charset: "utf8",
    write: false,
    logLevel: "warning",
  });
  return result.outputFiles[0].text.trim();
}

/** Of all that the page is built from; tests/page_source.sh computes the same without npm. */
function sourceDigest() {
  const script = join(here, "..", "..", "tests", "page_source.sh");
  return execFileSync(script, { encoding: "utf8" }).trim();
}

/** Inline code must not contain the end of its own element, nor what opens a comment. */
const escaped = (code) => code.replace(/<\/(script)/gi, "<\\/$1").replace(/<!--/g, "<\\!--");
const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

const script = escaped(await bundle("main.ts"));
const style = (await bundle("style.css")).replace(/<\/style/gi, "<\\/style");
const licence = readFileSync(join(here, "node_modules", "three", "LICENSE"), "utf8").trim();
const version = JSON.parse(
  readFileSync(join(here, "node_modules", "three", "package.json"), "utf8"),
).version;
const policy = `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'`;

const parts = {
  "<!-- source -->": `<!-- source ${sourceDigest()} -->`,
  "<!-- policy -->": `<meta http-equiv="Content-Security-Policy" content="${policy}">`,
  "<!-- style -->": `<style>${style}</style>`,
  "<!-- script -->": `<!--\nContains three.js ${version} (https://threejs.org):\n\n${licence}\n-->\n<script type="module">${script}</script>`,
};
let page = readFileSync(join(here, "index.html"), "utf8");
for (const [marker, text] of Object.entries(parts)) page = page.replace(marker, () => text);
if (page.split("<!-- data -->").length !== 2)
  throw new Error("the page must hold its marker of data once");
if (process.argv.includes("--check")) {
  if (readFileSync(out, "utf8") !== page)
    throw new Error("built/page.html is not what the build gives: npm run build");
} else {
  mkdirSync(dirname(out), { recursive: true });
  writeFileSync(out, page);
}
console.log(`${out}: ${(page.length / 1024).toFixed(0)} KiB`);
