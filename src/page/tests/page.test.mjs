// Tests of the page with a server: views, sessions, loops, keys, layouts.
import assert from "node:assert/strict";
import { test } from "node:test";
import { counts, drawnShare, loaded, picture } from "./browser.mjs";
import { token } from "./fake_server.mjs";
import { click, closed, colourings, townPage, until } from "./town_page.mjs";

const town = townPage();

test("points are drawn, the token leaves the address", async () => {
  const session = await town.opened();
  assert.ok((await counts(session.page)).points > 100_000);
  assert.ok((await drawnShare(session.page)) > 0.3);
  assert.ok(!session.page.url().includes(token));
  assert.ok(!(await colourings(session.page)).includes("intensity"), "the town has none");
  assert.ok(town.server.requests.every((url) => !url.includes(token)));
  await picture(session.page, "wide-dark");
  await closed(session);
});

test("a session is switched off and on", async () => {
  const session = await town.opened();
  const share = await drawnShare(session.page);
  await session.page.evaluate(() =>
    [0, 1].forEach((index) => window.unimapper.toggleSession(index)),
  );
  await new Promise((resolve) => setTimeout(resolve, 1000));
  const less = await drawnShare(session.page);
  assert.ok(less < 0.8 * share, `${less} of ${share}`);
  await session.page.evaluate(() =>
    [0, 1].forEach((index) => window.unimapper.toggleSession(index)),
  );
  await new Promise((resolve) => setTimeout(resolve, 1000));
  assert.ok((await drawnShare(session.page)) > 0.9 * share);
  await closed(session);
});

test("a click on a loop, wrong, a new epoch, undo", async () => {
  const session = await town.opened();
  const { page } = session;
  await page.evaluate(() => window.unimapper.selectLoop(2));
  await new Promise((resolve) => setTimeout(resolve, 800));
  await page.evaluate(() => window.unimapper.selectLoop(null));
  const at = await page.evaluate(() => {
    const { left, top } = document.getElementById("canvas").getBoundingClientRect();
    const place = window.unimapper.loopOnScreen(2);
    return { x: left + place.x, y: top + place.y };
  });
  await page.mouse.click(at.x, at.y);
  await until(
    page,
    () => document.querySelector("#loop:not([hidden]) h2")?.textContent === "Loop 2",
  );
  await picture(page, "loop");
  const epoch = await page.evaluate(() => window.unimapper.epoch());
  await click(page, "wrong");
  await until(page, (before) => window.unimapper.epoch() === before + 1, epoch);
  await until(page, () => document.querySelector("#loop .state").textContent === "refused");
  await until(page, () => document.querySelector("#loop .undo"));
  await picture(page, "loop-refused");
  await click(page, "undo");
  await until(page, (before) => window.unimapper.epoch() === before, epoch);
  await until(page, () => document.querySelector("#loop .state").textContent === "accepted");
  await closed(session);
});

test("while the base merges, a loop keeps its buttons whatever its index", async () => {
  const session = await town.opened();
  const { page } = session;
  const epoch = await page.evaluate(() => window.unimapper.epoch());
  const state = (wanted) =>
    until(page, (text) => document.querySelector("#loop .state").textContent === text, wanted);
  await page.evaluate(() => window.unimapper.selectLoop(2));
  town.server.merge();
  const last = await page.evaluate(() => window.unimapper.map().loops.length - 1);
  await until(
    page,
    (index) => document.querySelector("#loop h2").textContent === `Loop ${index}`,
    last - 2,
  );
  await click(page, "wrong");
  await state("refused");
  assert.equal(town.server.map.loops[last - 2].statement, "wrong");
  // Going back an epoch would take back the merge of the base that has come since.
  town.server.merge();
  await until(page, () => document.querySelector("#loop h2").textContent === "Loop 2");
  await click(page, "undo");
  await state("accepted");
  assert.equal(town.server.map.loops[2].statement, null);
  assert.equal(town.server.map.epoch, epoch + 4);
  while (town.server.map.epoch > epoch) town.server.undo();
  await closed(session);
});

test("without a token nothing can be changed; a wrong token is refused in words", async () => {
  const session = await town.opened({}, "");
  const { page, errors } = session;
  await page.evaluate(() => window.unimapper.selectLoop(1));
  assert.ok(await page.evaluate(() => document.querySelector("#loop .wrong").disabled));
  await page.type("#loop input[type=password]", "other");
  await click(page, "use");
  await click(page, "wrong");
  await until(
    page,
    () =>
      document.querySelector("#loop .status").textContent ===
      "the server does not accept this token",
  );
  assert.equal(await page.evaluate(() => window.unimapper.epoch()), town.server.map.epoch);
  assert.ok(
    errors.every((text) => text.includes("401")),
    errors.join("; "),
  );
  await page.close();
});

test("the drive up to a time: keyframes so far, and the whole again", async () => {
  const session = await town.opened();
  const { page } = session;
  await page.evaluate(() => window.unimapper.set("driveTime_s", 40));
  await until(page, () => window.unimapper.keyframeDrawn(0, 50));
  await until(page, () => window.unimapper.counts().keyframes >= 40);
  await picture(page, "drive");
  assert.ok(!(await page.evaluate(() => window.unimapper.keyframeDrawn(0, 51))));
  await page.evaluate(() => window.unimapper.set("driveTime_s", null));
  await until(page, () => !window.unimapper.keyframeDrawn(0, 50));
  await closed(session);
});

test("keys: section box, measure, removed points, views", async () => {
  const session = await town.opened();
  const { page } = session;
  await page.focus("#canvas");
  await page.keyboard.press("r");
  assert.ok(await page.evaluate(() => window.unimapper.settings().removed));
  const kinds = await page.evaluate(() => {
    const parts = [...document.querySelectorAll("#pane-layers section")];
    const part = parts.find((one) => one.querySelector("h2").textContent === "Removed points");
    return [...part.querySelectorAll(".nested label")].map((label) => label.textContent);
  });
  assert.deepEqual(kinds, ["online, on the robot", "by refinement at the base"]);
  await page.keyboard.press("v");
  await until(page, () => document.getElementById("divider").checkVisibility());
  await picture(page, "divider");
  for (const [key, mode] of [
    ["2", "walk"],
    ["3", "top"],
    ["1", "orbit"],
  ]) {
    await page.keyboard.press(key);
    await until(
      page,
      (name) => document.querySelector("#tools [aria-pressed=true]").textContent === name,
      mode,
    );
  }
  for (const key of ["v", "f", "m"]) await page.keyboard.press(key);
  await loaded(page);
  const canvas = await page.evaluate(() => {
    const { x, y, width, height } = document.getElementById("canvas").getBoundingClientRect();
    return { x: x + width / 2, y: y + height / 2 };
  });
  await page.mouse.click(canvas.x - 60, canvas.y);
  await page.mouse.click(canvas.x + 40, canvas.y + 60);
  await until(page, () =>
    /dz -?\d/.test(document.querySelector(".place.measure")?.textContent ?? ""),
  );
  await page.keyboard.press("b");
  await until(page, () => document.getElementById("section").checkVisibility());
  await picture(page, "measure");
  await closed(session);
});

test("fingers turn, move and go nearer", async () => {
  const session = await town.opened({ width: 390, height: 844, touch: true });
  const { page } = session;
  const client = await page.createCDPSession();
  const touch = (type, points) =>
    client.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y]) => ({ x, y })) });
  // A slow renderer draws fewer frames in any given time: wait until the camera stands still.
  const settled = async () => {
    let before;
    for (let look = 0; look < 25; ++look) {
      await new Promise((resolve) => setTimeout(resolve, 300));
      const now = JSON.stringify(await page.evaluate(() => window.unimapper.camera()));
      if (now === before) return;
      before = now;
    }
    assert.fail("the camera never stands still");
  };
  const drag = async (from, by) => {
    await touch("touchStart", from);
    for (let step = 1; step <= 8; ++step)
      await touch("touchMove", from.map(([x, y], i) => [x + (by[i][0] * step) / 8, y + (by[i][1] * step) / 8]));
    await touch("touchEnd", []);
    await settled();
  };
  // Two places of the first session's path, on the screen.
  const ends = () =>
    page.evaluate(() => {
      const { poses } = window.unimapper.map().sessions[0];
      return [poses[0], poses.at(-1)].map((pose) => window.unimapper.onScreen(...pose.slice(0, 3)));
    });
  const length = ([a, b]) => Math.hypot(a.x - b.x, a.y - b.y);
  const moved = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);

  const before = await ends();
  await drag([[200, 300]], [[80, 0]]);
  const turned = await ends();
  assert.ok(moved(before[0], turned[0]) > 5, "one finger turns");
  await drag([[180, 300], [220, 300]], [[-60, 0], [60, 0]]);
  const nearer = await ends();
  assert.ok(length(nearer) > 1.3 * length(turned), `two fingers go nearer: ${length(turned)} to ${length(nearer)}`);

  await page.evaluate(() => window.unimapper.setMode("top"));
  await settled();
  const top = await ends();
  await drag([[200, 300]], [[60, 40]]);
  const panned = await ends();
  assert.ok(Math.abs(length(panned) - length(top)) < 0.05 * length(top), "one finger moves the top view");
  assert.ok(moved(top[0], panned[0]) > 30, `by ${moved(top[0], panned[0])} pixels`);

  await page.evaluate(() => window.unimapper.setMode("walk"));
  const standing = await page.evaluate(() => window.unimapper.camera());
  await drag([[200, 300]], [[80, 0]]);
  const looking = await page.evaluate(() => window.unimapper.camera());
  assert.deepEqual(looking.position, standing.position);
  assert.ok(Math.abs(looking.direction[0] - standing.direction[0]) > 0.05, "one finger looks around");
  await drag([[180, 300], [220, 300]], [[0, -80], [0, -80]]);
  const walked = await page.evaluate(() => window.unimapper.camera());
  const way = [0, 1].map((i) => walked.position[i] - looking.position[i]);
  assert.ok(way[0] * looking.direction[0] + way[1] * looking.direction[1] > 1, `two fingers walk: ${way}`);
  await closed(session);
});

for (const [name, options] of Object.entries({
  "narrow-dark": { width: 390, height: 844, touch: true },
  "narrow-light": { width: 390, height: 844, theme: "light", touch: true },
  "wide-light": { theme: "light" },
}))
  test(`layout: ${name}`, async () => {
    const session = await town.opened(options);
    const { page } = session;
    assert.equal(
      await page.evaluate(() => document.documentElement.dataset.theme),
      options.theme ?? "dark",
    );
    const overflow = await page.evaluate(() => [
      document.documentElement.scrollWidth - innerWidth,
      ...[...document.querySelectorAll("header, #tools, #side, #times")].map(
        (part) => part.getBoundingClientRect().right - innerWidth,
      ),
    ]);
    assert.ok(
      overflow.every((pixels) => pixels <= 1),
      overflow.join(" "),
    );
    await picture(page, name);
    await page.evaluate(() => window.unimapper.selectLoop(2));
    await picture(page, `${name}-loop`);
    await closed(session);
  });

test("changed objects are named from the list and by a press on their box", async () => {
  const session = await town.opened();
  const { page } = session;
  await page.evaluate(() => {
    document.getElementById("tab-changes").click();
    document.querySelector(".change-row").click();
  });
  const label = () =>
    /appeared · avia · confidence/.test(document.getElementById("labels").innerText);
  await until(page, label);
  const { corner, empty } = await page.evaluate(() => {
    const { left, top, width } = document.getElementById("canvas").getBoundingClientRect();
    const { centre, size, heading } = window.unimapper.map().changes[0].box;
    const [x, y] = [size[0] / 2, size[1] / 2];
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    const [px, py] = [centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y];
    const place = window.unimapper.onScreen(px, py, centre[2] + size[2] / 2);
    return {
      corner: { x: left + place.x, y: top + place.y },
      empty: { x: left + width - 20, y: top + 20 },
    };
  });
  await page.mouse.click(empty.x, empty.y);
  await until(page, () => !document.getElementById("labels").innerText.includes("confidence"));
  await page.mouse.click(corner.x, corner.y);
  await until(page, label);
  await closed(session);
});
