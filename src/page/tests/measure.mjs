// Measurement of the first view and of frames, with ten million points unless told otherwise.
import { cpus, loadavg } from "node:os";
import { counts, launch, loaded, open, picture, ready } from "./browser.mjs";
import { FakeServer } from "./fake_server.mjs";
import { scene } from "./scene.mjs";

const points = Number(process.argv[2] ?? 10e6);
const server = await new FakeServer(scene(points)).start();
const browser = await launch();
const start = performance.now();
const { page } = await open(browser, server.url, { cache: false });
await ready(page);
const first = {
  seconds: (performance.now() - start) / 1000,
  bytes: server.bytes,
  ...(await counts(page)),
};
await loaded(page);
const whole = {
  seconds: (performance.now() - start) / 1000,
  bytes: server.bytes,
  ...(await counts(page)),
};
const renderer = await page.evaluate(() => window.unimapper.renderer);
const frames = [];
for (let turn = 0; turn < 3; ++turn) {
  const measured_ms = await page.evaluate(() => window.unimapper.frameTime_ms(40));
  frames.push({ measured_ms, ...(await counts(page)) });
}
await picture(page, "ten-million");
console.log(
  `${points / 1e6} million points, ${renderer}, ${cpus().length} cores, load ${loadavg()[0].toFixed(1)}`,
);
console.log(
  `first view: ${first.seconds.toFixed(2)} s, ${(first.bytes / 1e6).toFixed(2)} MB, ${first.points} points`,
);
console.log(
  `no tile missing: ${whole.seconds.toFixed(2)} s, ${(whole.bytes / 1e6).toFixed(2)} MB, ${whole.points} points`,
);
for (const { measured_ms, script_ms, points: drawn, budget } of frames)
  console.log(
    `turn: ${measured_ms.toFixed(1)} ms a frame, ${script_ms.toFixed(1)} ms of it script, budget ${budget} points, ${drawn} drawn`,
  );
await browser.close();
await server.stop();
