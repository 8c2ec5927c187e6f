// Browser and server with the generated town, for the tests of one file.
import assert from "node:assert/strict";
import { after, before } from "node:test";
import { launch, loaded, open, ready } from "./browser.mjs";
import { FakeServer, token } from "./fake_server.mjs";
import { scene } from "./scene.mjs";

export const data = scene(400_000);

/** `browser` and `server` are there once the first test runs. */
export function townPage() {
  const town = {};
  before(async () => {
    town.browser = await launch();
    town.server = await new FakeServer(data).start();
  });
  after(async () => {
    await town.browser.close();
    await town.server.stop();
  });
  town.opened = async (options = {}, fragment = `#token=${token}`) => {
    const session = await open(town.browser, town.server.url + fragment, options);
    await ready(session.page);
    await loaded(session.page);
    return session;
  };
  return town;
}

/** Closes a page that must not have complained. */
export async function closed({ page, errors }) {
  assert.deepEqual(errors, [], "messages on the console");
  await page.close();
}

/** What points can be coloured by. */
export const colourings = (page) =>
  page.$$eval("[aria-label='Colour by'] button", (all) => all.map((button) => button.textContent));

export const until = (page, condition, ...values) =>
  page.waitForFunction(condition, { timeout: 15_000, polling: 50 }, ...values);

export const click = (page, text) =>
  page.evaluate((wanted) => {
    const shown = [...document.querySelectorAll("button")].filter((button) => button.offsetParent);
    shown.find((button) => button.textContent === wanted).click();
  }, text);
