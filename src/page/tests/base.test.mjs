// Test of the page on a base that merges while robots drive, in a network namespace of its own.
import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { launch, open, picture, ready } from "./browser.mjs";
import { click, closed, until } from "./town_page.mjs";

const program = process.env.UNIMAPPER ?? fileURLToPath(new URL("../../../build/release/bin/unimapper", import.meta.url));
const url = "udpm://239.255.76.67:7667?ttl=0";

/** This file once more, with multicast on a loopback of its own; undefined: not allowed here. */
function inNamespace() {
  const flags = ["-n", "-rn"].find((one) => spawnSync("unshare", [one, "true"]).status === 0);
  if (!flags) return undefined;
  const script = 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$0" --test "$1"';
  return spawnSync("unshare", [flags, "sh", "-c", script, process.execPath, fileURLToPath(import.meta.url)], {
    env: { ...process.env, IN_NAMESPACE: "1", NODE_TEST_CONTEXT: undefined },
    encoding: "utf8",
  });
}

async function drive() {
  const folder = mkdtempSync(join(tmpdir(), "unimapper-base-"));
  const children = [];
  const start = (...words) => {
    const child = spawn(program, words, { stdio: ["ignore", "ignore", "pipe"] });
    child.said = "";
    child.stderr.on("data", (text) => (child.said += text));
    child.ended = new Promise((resolve) => child.once("exit", resolve));
    children.push(child);
    return child;
  };
  let browser;
  try {
    for (const day of ["0", "1"])
      execFileSync(program, ["simulate", "--scene", "town", "--sensor", "vlp-16", "--columns", "512", "--seed", "3", "--day", day, "--scans", day === "0" ? "150" : "400", "--out", join(folder, "data", day)], { stdio: "ignore" });
    const base = start("base", "--store", join(folder, "site"), "--listen", url, "--merge", "--http", "127.0.0.1:0");
    let address;
    while (!(address = /http:\/\/127\.0\.0\.1:\d+\/#token=[0-9a-f]+/.exec(base.said)?.[0])) {
      assert.equal(base.exitCode, null, base.said);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    browser = await launch();
    const session = await open(browser, address);
    const { page } = session;
    await ready(page);
    const robot = (day, ...more) =>
      start("onboard", join(folder, "data", day), "--out", join(folder, "runs", `day-${day}`), "--publish", url, ...more);
    // The one that is heard first has the name that comes last.
    const late = robot("1", "--realtime");
    await until(page, () => window.unimapper.map()?.sessions.length === 1);
    const early = robot("0");
    assert.equal(await early.ended, 0, early.said);
    const accepted = () =>
      window.unimapper.map().loops.findIndex((one) => one.state === "accepted" && one.query[0] !== one.match[0]);
    await page.waitForFunction(`(${accepted})() >= 0`, { timeout: 60_000 });
    assert.deepEqual(await page.evaluate(() => window.unimapper.map().sessions.map((one) => one.name)), ["day-1", "day-0"]);
    await until(page, () => document.querySelector(".place.robot"));
    await picture(page, "base-live");

    // A person speaks while keyframes arrive and the base merges every half second.
    const name = await page.evaluate(() => {
      const { loops, sessions } = window.unimapper.map();
      const index = loops.findIndex((one) => one.state === "accepted" && one.query[0] !== one.match[0]);
      window.unimapper.selectLoop(index);
      return [loops[index].query, loops[index].match].map(([s, k]) => `${sessions[s].name}:${sessions[s].sequences[k]}`).sort().join(" ");
    });
    const said = (wanted) =>
      page.waitForFunction(
        (ends, statement) => {
          const { loops, sessions } = window.unimapper.map();
          const of = ([s, k]) => `${sessions[s].name}:${sessions[s].sequences[k]}`;
          const same = loops.filter((one) => [of(one.query), of(one.match)].sort().join(" ") === ends);
          return same.some((one) => one.statement === "wrong") === (statement === "wrong");
        },
        { timeout: 60_000 },
        name,
        wanted,
      );
    await click(page, "wrong");
    await said("wrong");
    await picture(page, "base-refused");
    await until(page, () => document.querySelector("#loop .undo:not([disabled])"));
    await click(page, "undo");
    await said(null);
    assert.equal(await late.ended, 0, late.said);
    await closed(session);
    base.kill("SIGTERM");
    assert.equal(await base.ended, 0, base.said);
    execFileSync(program, ["map", "check", "--store", join(folder, "site")]);
  } finally {
    for (const child of children) child.kill("SIGKILL");
    await browser?.close();
    rmSync(folder, { recursive: true });
  }
}

test("a base that merges is followed live, and a person is heard while it does", { timeout: 240_000 }, async (context) => {
  if (process.env.IN_NAMESPACE) return drive();
  const outcome = inNamespace();
  if (!outcome) return context.skip("making a namespace is not allowed here");
  assert.equal(outcome.status, 0, outcome.stdout + outcome.stderr);
});
