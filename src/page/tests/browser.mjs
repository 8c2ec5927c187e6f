// Browser for the tests, which fails a test on any message of error.
import puppeteer from "puppeteer-core";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const pictures = fileURLToPath(new URL("../../../build/page/", import.meta.url));

export function launch(...more) {
  return puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    protocolTimeout: 120_000,
    args: [
      "--no-sandbox",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      "--hide-scrollbars",
      ...more,
    ],
  });
}

/** Page of a size; `errors` collects what the console and scripts complain about. */
export async function open(
  browser,
  url,
  { width = 1280, height = 800, theme = "dark", touch = false, cache = true } = {},
) {
  const page = await browser.newPage();
  const errors = [];
  page.on(
    "console",
    (message) =>
      ["error", "warn"].includes(message.type()) &&
      errors.push(`${message.text()} ${message.location()?.url ?? ""}`),
  );
  page.on("pageerror", (error) => errors.push(error.message));
  await page.setCacheEnabled(cache);
  await page.setViewport({ width, height, hasTouch: touch, isMobile: touch });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: theme }]);
  await page.goto(url, { waitUntil: "domcontentloaded" });
  return { page, errors };
}

export const ready = (page) => page.evaluate(() => window.unimapper.ready);
export const counts = (page) => page.evaluate(() => window.unimapper.counts());

/** Waits until no tile is on its way. */
export const loaded = (page) =>
  page.waitForFunction(() => window.unimapper.counts().loading === 0, {
    timeout: 60_000,
    polling: 200,
  });

export async function picture(page, name) {
  mkdirSync(pictures, { recursive: true });
  await new Promise((resolve) => setTimeout(resolve, 600));
  await page.screenshot({ path: join(pictures, `${name}.png`) });
}

/** Share of the canvas that is not background, from a picture of it. */
export async function drawnShare(page) {
  const shot = await page.screenshot({
    encoding: "base64",
    clip: await page.evaluate(() => {
      const { x, y, width, height } = document.getElementById("canvas").getBoundingClientRect();
      return { x: x + width * 0.25, y: y + height * 0.3, width: width * 0.5, height: height * 0.4 };
    }),
  });
  return page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height),
      context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    let other = 0;
    for (let i = 0; i < pixels.length; i += 4)
      other += Math.abs(pixels[i] - pixels[0]) + Math.abs(pixels[i + 1] - pixels[1]) > 24;
    return (4 * other) / pixels.length;
  }, shot);
}
