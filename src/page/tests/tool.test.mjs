// Tests of the page with the real program: a store that is changed, and the report in one file.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { counts, launch, loaded, open, picture, ready } from "./browser.mjs";
import { click, closed, colourings, until } from "./town_page.mjs";

const program = process.env.UNIMAPPER ?? fileURLToPath(new URL("../../../build/release/bin/unimapper", import.meta.url));
const folder = mkdtempSync(join(tmpdir(), "unimapper-tool-"));
const store = join(folder, "site");
let browser;
let server;
const servers = [];

const run = (...words) => execFileSync(program, words, { stdio: ["ignore", "ignore", "ignore"] });

/** Two short drives along one street on two days, merged. */
before(async () => {
  mkdirSync(join(folder, "runs"), { recursive: true });
  for (const day of ["0", "1"]) {
    const recording = join(folder, "data", day);
    run("simulate", "--scene", "town", "--sensor", "vlp-16", "--columns", "512", "--seed", "3", "--day", day, "--scans", "150", "--out", recording);
    run("onboard", recording, "--out", join(folder, "runs", `day-${day}`));
  }
  run("map", "create", "--store", store);
  run("map", "add", "--store", store, join(folder, "runs", "day-0"), join(folder, "runs", "day-1"));
  run("map", "merge", "--store", store);
  browser = await launch();
});

after(async () => {
  for (const one of servers) one.kill("SIGTERM");
  await browser?.close();
  rmSync(folder, { recursive: true });
});

/** The address that the program prints. */
async function view(...words) {
  server = spawn(program, ["view", ...words, "--http", "127.0.0.1:0"], { stdio: ["ignore", "pipe", "inherit"] });
  servers.push(server);
  let text = "";
  for await (const part of server.stdout) {
    text += part;
    if (text.includes("\n")) return text.trim().split(" ").at(-1);
  }
  throw new Error(`the program ended: ${text}`);
}

async function stopped() {
  const ended = new Promise((resolve) => server.once("exit", resolve));
  server.kill("SIGTERM");
  assert.equal(await ended, 0);
  server = undefined;
}

test("a store is shown; a loop is refused, which is an epoch, and that is undone", async () => {
  const session = await open(browser, await view(store));
  const { page } = session;
  await ready(page);
  await loaded(page);
  await until(page, () => window.unimapper.counts().points > 20_000);
  const epoch = await page.evaluate(() => window.unimapper.epoch());
  const loop = await page.evaluate(() => window.unimapper.map().loops.findIndex((one) => one.state === "accepted" && one.query[0] !== one.match[0]));
  assert.ok(loop >= 0);
  await page.evaluate((index) => window.unimapper.selectLoop(index), loop);
  await click(page, "wrong");
  await until(page, (before) => window.unimapper.epoch() > before, epoch);
  await until(page, () => window.unimapper.map().loops.some((one) => one.statement === "wrong"));
  const moved = await page.evaluate(() => window.unimapper.map().sessions.map((session) => session.epoch));
  assert.ok(moved.every((number) => number >= 1 && number <= epoch + 1), `epochs ${moved}`);
  await picture(page, "tool-refused");
  const said = execFileSync(program, ["map", "show", "--store", store], { encoding: "utf8" });
  assert.match(said, /forbidden/);
  await until(page, () => document.querySelector("#loop .undo"));
  await click(page, "undo");
  await until(page, () => window.unimapper.map().loops.every((one) => one.statement !== "wrong"));
  // The slider shows the epoch in which it was wrong, and the latest again.
  const latest = await page.evaluate(() => window.unimapper.epoch());
  const choose = (number) =>
    page.evaluate((wanted) => {
      const slider = document.querySelector("#times input[aria-label=Epoch]");
      slider.value = window.unimapper.map().epochs.findIndex((one) => one.number === wanted);
      slider.dispatchEvent(new Event("change"));
    }, number);
  await choose(epoch + 1);
  await until(page, (number) => window.unimapper.epoch() === number, epoch + 1);
  assert.ok(await page.evaluate(() => window.unimapper.map().loops.some((one) => one.statement === "wrong")));
  await choose(latest);
  await until(page, (number) => window.unimapper.epoch() === number, latest);
  // Once nothing has changed for some seconds the whole map is there.
  await until(page, () => (window.unimapper.map().layers.static?.nodes.length ?? 0) > 0);
  await loaded(page);
  await picture(page, "tool-whole");
  await closed(session);
  await stopped();
  execFileSync(program, ["map", "check", "--store", store]);
});

test("an evaluated map has its errors where they are, from its folder and in its report", async () => {
  const map = join(folder, "evaluated");
  const runs = ["0", "1"].map((day) => join(folder, "runs", `day-${day}`));
  const named = (path) => ["0", "1"].map((day) => `day-${day}=${path(day)}`);
  run("merge", ...runs, "--out", map);
  run("evaluate", "view", "--map", map, "--truth", ...named((day) => join(folder, "data", day)), "--run", ...named((day) => join(folder, "runs", `day-${day}`)));
  const check = async ({ page }) => {
    await ready(page);
    await loaded(page);
    const { evaluation, layers } = await page.evaluate(() => window.unimapper.map());
    assert.equal(evaluation.ate_m.length, 2);
    assert.ok(evaluation.ate_m.every((errors) => errors.length > 10 && errors.every((value) => value < 1)));
    assert.ok(evaluation.precision_recall.length > 0);
    const count = (name) => layers[name].nodes.reduce((sum, node) => sum + node[1], 0);
    assert.ok(count("false_static") > 0 && count("false_dynamic") > 0);
    assert.ok(count("false_static") <= evaluation.summary.false_static_points);
    const before = (await counts(page)).points;
    await page.evaluate(() => ["falseStatic", "falseDynamic", "pathError"].forEach((name) => window.unimapper.set(name, true)));
    await until(page, (few) => window.unimapper.counts().points > few, before);
    await loaded(page);
    await page.click("#tab-evaluation");
    const said = await page.evaluate(() => document.querySelector("#pane-evaluation").textContent);
    assert.match(said, /Absolute trajectory error/);
    assert.match(said, /false static/);
    assert.match(said, /Labelssession/);
    assert.match(said, /Precision over recall/);
  };
  const shown = await open(browser, await view(map));
  await check(shown);
  await picture(shown.page, "tool-evaluation");
  await closed(shown);
  await stopped();
  const report = await open(browser, pathToFileURL(join(map, "report.html")).href);
  await check(report);
  await closed(report);
});

test("a store that is not there yet is said, and shown once it is", async () => {
  const late = join(folder, "late");
  const session = await open(browser, await view(late));
  const { page } = session;
  const says = (text) => until(page, (wanted) => document.getElementById("message").hidden === !wanted && document.getElementById("message").textContent.includes(wanted), text);
  await says("There is no store yet");
  run("map", "create", "--store", late);
  await says("No keyframe is stored yet");
  run("map", "add", "--store", late, join(folder, "runs", "day-0"));
  await until(page, () => document.getElementById("message").hidden && window.unimapper.map()?.sessions.length === 1);
  await until(page, () => window.unimapper.counts().keyframes > 0);
  await closed(session);
  await stopped();
});

test("an exported map is shown from its folder, and its report opens from disk", async () => {
  const map = join(folder, "map");
  run("map", "export", "--store", store, "--out", map);
  const shown = await open(browser, await view(map));
  await ready(shown.page);
  await loaded(shown.page);
  assert.ok((await counts(shown.page)).points > 20_000);
  assert.ok((await colourings(shown.page)).includes("intensity"));
  const points = () =>
    shown.page.screenshot({ encoding: "base64", clip: { x: 500, y: 300, width: 200, height: 150 } });
  const bySession = await points();
  await shown.page.evaluate(() => window.unimapper.set("colour", "intensity"));
  await picture(shown.page, "tool-intensity");
  assert.notEqual(await points(), bySession);
  await closed(shown);
  await stopped();

  const report = join(map, "report.html");
  assert.ok(existsSync(report) && statSync(report).size < 6e6);
  const offline = await launch("--proxy-server=127.0.0.1:9");
  try {
    const session = await open(offline, pathToFileURL(report).href);
    await ready(session.page);
    await loaded(session.page);
    assert.ok((await counts(session.page)).points > 20_000);
    await session.page.click("#report-button");
    await until(session.page, () => document.querySelector("#report-dialog[open] .report-content").shadowRoot.querySelector("h2"));
    await picture(session.page, "tool-report");
    await closed(session);
  } finally {
    await offline.close();
  }
});
