// Tests of the page while robots drive: events, corrections, lost connections, wrong blocks.
import assert from "node:assert/strict";
import { test } from "node:test";
import { counts, open, picture, ready } from "./browser.mjs";
import { robotHealth } from "./fake_server.mjs";
import { closed, townPage, until } from "./town_page.mjs";

const town = townPage();

test("a keyframe appears within a second of its event, a robot and its health too", async () => {
  const session = await town.opened();
  const { page } = session;
  const pose = [...town.server.map.sessions[1].poses[60]];
  town.server.livePose = pose;
  const start = performance.now();
  town.server.emit("keyframe", {
    session: 1,
    name: "avia",
    keyframe: 9000,
    sequence: 9000,
    stamp_s: 1,
    pose,
  });
  await until(page, () => window.unimapper.keyframeDrawn(1, 9000));
  const delay_ms = performance.now() - start;
  console.log(`keyframe drawn after ${delay_ms.toFixed(0)} ms`);
  town.server.emit("robot", {
    session: 1,
    name: "avia",
    pose,
    state: "localised",
    latency_ms: 12.3,
  });
  town.server.health = [robotHealth(1, "avia")];
  const alarm = { session: 1, name: "<b>avia</b>", kind: "deadline", since_s: Date.now() / 1000 };
  town.server.emit("alarm", { ...alarm, text: "late once", state: "raised" });
  town.server.emit("alarm", { ...alarm, text: "late twice", state: "raised" });
  await until(page, () => document.querySelector(".alarms")?.textContent.includes("<b>avia</b>: late twice"));
  assert.equal(await page.evaluate(() => document.querySelectorAll(".alarms li").length), 1);
  await until(page, () => document.querySelector(".place.robot")?.textContent === "avia · 12 ms");
  await page.evaluate(() => document.getElementById("tab-robots").click());
  await until(page, () => document.querySelectorAll(".chart").length >= 9);
  await picture(page, "robots");
  // The server keeps one row a minute and replaces the latest: the page keeps what it has seen.
  const before = await page.evaluate(() => window.unimapper.health(1).time_s.length);
  town.server.health = [robotHealth(1, "avia", 70, 65)];
  await until(page, (rows) => window.unimapper.health(1).time_s.length === rows + 10, before);
  const gap = await page.evaluate(() => window.unimapper.health(1).latency_ms.slice(-5));
  assert.deepEqual(gap, [null, null, null, null, null]);
  // What a message lacks is not drawn.
  await until(page, () => {
    const chart = [...document.querySelectorAll(".chart")].find((one) => one.querySelector("figcaption").textContent.startsWith("Latency"));
    const lines = [...chart.querySelectorAll(".line")];
    return lines.length === 1 && lines[0].getAttribute("points").split(" ").length === 65;
  });
  town.server.emit("alarm", { ...alarm, text: "late twice", state: "over" });
  await until(page, () => !document.querySelector(".alarms"));
  town.server.alarms = [{ ...alarm, kind: "silence", text: "sends nothing" }];
  await until(page, () => document.querySelector(".alarms")?.textContent.includes("sends nothing"));
  town.server.alarms = [];
  await until(page, () => !document.querySelector(".alarms"));
  town.server.emit("robot", { session: 1, name: "avia", pose: [1, 2] });
  await until(page, () => document.querySelector(".alarms")?.textContent.includes("event robot"));
  assert.ok(delay_ms < 1000, `${delay_ms} ms`);
  await closed(session);
});

test("while a map is computed keyframes are drawn, and a correction moves them over time", async () => {
  town.server.withoutLayers = true;
  const session = await town.opened();
  const { page } = session;
  await until(
    page,
    () => window.unimapper.counts().keyframes >= 8 && window.unimapper.counts().tiles === 0,
  );
  await picture(page, "computing");
  const x = () => window.unimapper.pose(1, 10)[0];
  const before = await page.evaluate(x);
  town.server.say(3, "right");
  town.server.emit("map", { epoch: town.server.map.epoch });
  await until(
    page,
    (start) => {
      const now = window.unimapper.pose(1, 10)[0];
      return now > start + 0.01 && now < start + 0.39;
    },
    before,
  );
  await until(
    page,
    (start) => Math.abs(window.unimapper.pose(1, 10)[0] - start - 0.4) < 1e-6,
    before,
  );
  town.server.undo();
  town.server.withoutLayers = false;
  await closed(session);
});

test("a lost connection is said, and comes back", async () => {
  const session = await town.opened();
  const { page } = session;
  await until(page, () => document.getElementById("connection").textContent === "connected");
  town.server.dropStreams();
  await until(page, () => document.getElementById("connection").className === "lost");
  await until(page, () => document.getElementById("connection").textContent === "connected");
  session.errors.length = 0; // the browser reports the lost stream
  await closed(session);
});

test("a wrong block of points is an error in words, and the rest is drawn", async () => {
  town.server.brokenTile = "r0";
  const session = await open(town.browser, town.server.url, { cache: false });
  await ready(session.page);
  await until(session.page, () =>
    document.querySelector(".alarms li.error")?.textContent.includes("r0"),
  );
  assert.ok((await counts(session.page)).points > 0);
  town.server.brokenTile = undefined;
  await session.page.close();
});
