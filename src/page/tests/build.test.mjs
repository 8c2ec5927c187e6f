// Tests of the built file: up to date, self-contained, licences.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const folder = fileURLToPath(new URL("..", import.meta.url));
const page = readFileSync(`${folder}built/page.html`, "utf8");

test("the committed file is what the build gives", () => {
  execFileSync(process.execPath, ["build.mjs", "--check"], { cwd: folder });
});

test("the file has one place for data and no reference to others", () => {
  assert.equal(page.split("<!-- data -->").length, 2);
  assert.doesNotMatch(page, /<(script|img|iframe|link)[^>]*(src|href)="(?!data:)/);
  assert.equal(page.match(/<\/script>/gi).length, 1);
});

test("the licence of three.js is kept", () => {
  assert.match(
    page,
    /Contains three\.js [\d.]+[\s\S]*MIT License[\s\S]*Permission is hereby granted/,
  );
});
