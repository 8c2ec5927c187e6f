// Tests of the page from a file: without a network, without WebGL.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { pathToFileURL } from "node:url";
import { counts, launch, loaded, open, picture, ready } from "./browser.mjs";
import { offlinePage } from "./offline.mjs";
import { closed, data, until } from "./town_page.mjs";

const folder = mkdtempSync(join(tmpdir(), "unimapper-page-"));
after(() => rmSync(folder, { recursive: true }));

test("a file opens without a network", async () => {
  const path = join(folder, "map.html");
  writeFileSync(path, offlinePage(data, [data.map.loops[2].query, data.map.loops[2].match]));
  const offline = await launch("--proxy-server=127.0.0.1:9");
  try {
    const session = await open(offline, pathToFileURL(path).href);
    const { page } = session;
    const requests = [];
    page.on(
      "request",
      (request) =>
        request.url().startsWith("file:") ||
        request.url().startsWith("data:") ||
        requests.push(request.url()),
    );
    await ready(page);
    await loaded(page);
    assert.ok((await counts(page)).points > 100_000);
    await page.evaluate(() => window.unimapper.selectLoop(2));
    await until(page, () => document.getElementById("loop").checkVisibility());
    await picture(page, "file");
    assert.deepEqual(requests, []);
    await closed(session);
  } finally {
    await offline.close();
  }
});

test("without WebGL a sentence and the flat picture are shown", async () => {
  const path = join(folder, "flat.html");
  const picture1 = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7";
  writeFileSync(path, offlinePage({ ...data, tiles: {} }, [], picture1));
  const without = await launch("--disable-gpu", "--disable-3d-apis");
  try {
    const session = await open(without, pathToFileURL(path).href);
    const { page } = session;
    await ready(page);
    assert.match(
      await page.evaluate(() => document.getElementById("message").textContent),
      /no WebGL 2/,
    );
    assert.equal(await page.evaluate(() => document.querySelector("#message img").src), picture1);
    assert.match(
      await page.evaluate(() => document.getElementById("pane-map").textContent),
      /ouster/,
    );
    await picture(page, "no-webgl");
    await closed(session);
  } finally {
    await without.close();
  }
});

test("an empty map and one of another format are shown in words", async () => {
  const browser = await launch();
  try {
    for (const [map, words] of [
      [{ format: 1, title: "empty", epoch: 0 }, /changed objects/],
      [{ format: 2 }, /reads format 1/],
    ]) {
      const path = join(folder, "other.html");
      writeFileSync(path, offlinePage({ map, tiles: {} }));
      const session = await open(browser, pathToFileURL(path).href);
      await until(
        session.page,
        (text) => new RegExp(text).test(document.body.innerText),
        words.source,
      );
      await closed(session);
    }
  } finally {
    await browser.close();
  }
});
