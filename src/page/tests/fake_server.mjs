// Server with generated data that answers as the contract of the page says.
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { gunzipSync, gzipSync } from "node:zlib";
import { fileURLToPath } from "node:url";
import { keyframeBlock } from "./keyframes.mjs";
import { scene } from "./scene.mjs";

const pagePath = fileURLToPath(new URL("../built/page.html", import.meta.url));
export const token = "secret";

export class FakeServer {
  constructor(data) {
    this.data = data;
    this.history = [structuredClone({ ...data.map, layers: null })];
    this.streams = new Set();
    this.bytes = 0;
    this.requests = [];
    this.health = [];
    this.alarms = [];
    this.server = createServer((request, response) => this.answer(request, response));
  }

  async start(port = 0) {
    await new Promise((resolve) => this.server.listen(port, "127.0.0.1", resolve));
    this.url = `http://127.0.0.1:${this.server.address().port}/`;
    return this;
  }

  async stop() {
    this.dropStreams();
    this.server.closeAllConnections();
    await new Promise((resolve) => this.server.close(resolve));
  }

  get map() {
    return { ...this.history.at(-1), layers: this.withoutLayers ? {} : this.data.map.layers };
  }

  emit(name, data) {
    for (const stream of this.streams)
      stream.write(`event: ${name}\ndata: ${JSON.stringify(data)}\n\n`);
  }

  dropStreams() {
    for (const stream of this.streams) stream.destroy();
    this.streams.clear();
  }

  send(response, status, body, headers = {}) {
    this.bytes += body.length;
    response.writeHead(status, { "Content-Length": body.length, ...headers });
    response.end(body);
  }

  json(response, status, value) {
    this.send(response, status, gzipSync(JSON.stringify(value)), {
      "Content-Type": "application/json",
      "Content-Encoding": "gzip",
      "Cache-Control": "no-store",
    });
  }

  points(response, compressed) {
    this.send(response, 200, compressed, {
      "Content-Type": "application/octet-stream",
      "Content-Encoding": "gzip",
      "Cache-Control": "public, max-age=31536000, immutable",
    });
  }

  answer(request, response) {
    const [, first, second, ...rest] = new URL(request.url, "http://x").pathname.split("/");
    this.requests.push(request.url);
    if (request.method === "POST") return this.post(request, response, [second, ...rest]);
    if (!first)
      return this.send(response, 200, gzipSync(readFileSync(pagePath)), {
        "Content-Type": "text/html; charset=utf-8",
        "Content-Encoding": "gzip",
      });
    if (second === "map") return this.json(response, 200, this.map);
    if (second === "health") return this.json(response, 200, { robots: this.health, alarms: this.alarms });
    if (second === "events") return this.events(response);
    if (second === "tiles") {
      const tile = this.data.tiles[rest[1]]?.get(rest[2]);
      if (tile && this.brokenTile === rest[2])
        return this.send(response, 200, gunzipSync(tile).subarray(0, 100), {
          "Cache-Control": "no-store",
        });
      if (tile) return this.points(response, tile);
    }
    if (second === "keyframes") {
      const pose = this.map.sessions[rest[1]]?.poses[rest[2]] ?? this.livePose;
      if (pose)
        return this.points(response, gzipSync(keyframeBlock(this.data, pose), { level: 1 }));
    }
    return this.send(response, 404, Buffer.from("not found"));
  }

  events(response) {
    if (this.refuseEvents) return this.send(response, 503, Buffer.from("closed"));
    response.writeHead(200, { "Content-Type": "text/event-stream", "Cache-Control": "no-store" });
    response.write(": connected\n\n");
    this.streams.add(response);
    response.on("close", () => this.streams.delete(response));
  }

  post(request, response, [what]) {
    let text = "";
    request.on("data", (part) => {
      text += part;
    });
    request.on("end", () => {
      if (request.headers.authorization !== `Bearer ${token}`)
        return this.json(response, 401, { error: "no valid token" });
      const body = JSON.parse(text || "{}");
      if (body.epoch !== this.map.epoch)
        return this.json(response, 409, { error: `epoch ${body.epoch} is no longer the latest` });
      const outcome = what === "undo" ? this.undo() : this.say(this.named(body), body.statement);
      this.json(response, 200, { epoch: this.map.epoch, outcome });
      return this.emit("map", { epoch: this.map.epoch });
    });
  }

  /** Index of a loop that is named by its keyframes. */
  named({ query, match }) {
    const { sessions, loops } = this.map;
    const name = ([session, k]) => `${sessions[session].name}:${sessions[session].sequences[k]}`;
    return loops.findIndex((loop) => name(loop.query) === query && name(loop.match) === match);
  }

  /** The base merges: loops have other indices, in an epoch of its own. */
  merge() {
    const next = structuredClone(this.history.at(-1));
    next.epoch += 1;
    next.loops.reverse();
    this.history.push(next);
    this.emit("map", { epoch: next.epoch });
  }

  undo() {
    if (this.history.length > 1) this.history.pop();
    return `back to epoch ${this.map.epoch}`;
  }

  say(index, statement) {
    const next = structuredClone(this.history.at(-1));
    next.epoch += 1;
    Object.assign(next.loops[index], {
      state: statement === "wrong" ? "refused" : "accepted",
      statement: statement === "not yet" ? null : statement,
      by_person: statement !== "not yet",
      reason: "a person said so",
    });
    next.sessions[1].poses.forEach((pose) => {
      pose[0] += 0.4;
    });
    next.epochs.push({
      number: next.epoch,
      parent: next.epoch - 1,
      made_s: 1764040000,
      command: "statement",
      outcome: `loop ${index} is ${statement}`,
    });
    this.history.push(next);
    return "merged 3 of 5 sessions";
  }
}

/** `known`: rows whose messages have a latency. */
export function robotHealth(session, name, length = 60, known = length) {
  const time_s = Array.from({ length }, (_, i) => 1764040000 + i * 2);
  const seconds = time_s.map((at) => at - time_s[0]);
  const wave = (mean, swing, rate) =>
    seconds.map((t) => +(mean + swing * Math.sin(t / rate)).toFixed(2));
  return {
    session,
    name,
    time_s,
    stage_ms: {
      "removal p50": wave(6, 1, 9),
      "registration p50": wave(9, 2, 14),
      "coding p50": wave(3, 0.5, 5),
    },
    deadline_misses: seconds.map((t) => (t > 70 ? 2 : t > 30 ? 1 : 0)),
    fill: { voxels: wave(0.6, 0.2, 40), keyframes: wave(0.3, 0.1, 30) },
    dropped: { "queue full": seconds.map((t) => (t > 60 ? 3 : 0)) },
    spool_bytes: wave(4e6, 3e6, 20),
    acknowledged: seconds,
    missing: seconds.map((t) => (t > 50 ? 2 : 0)),
    clock_offset_ms: wave(0.4, 0.3, 25),
    latency_ms: wave(12, 5, 11).map((value, i) => (i < known ? value : null)),
  };
}

/** Robot that drives on where a session ended: keyframes, places, health, an alarm. */
function drive(server) {
  let k = 0;
  const { poses } = server.map.sessions[1];
  setInterval(() => {
    const pose = poses[k % poses.length];
    server.livePose = pose;
    server.emit("keyframe", {
      session: 1,
      name: "avia",
      keyframe: poses.length + k,
      sequence: poses.length + k,
      stamp_s: 0.8 * k,
      pose,
    });
    server.emit("robot", {
      session: 1,
      name: "avia",
      pose,
      state: "localised",
      latency_ms: 12 + 5 * Math.sin(k),
    });
    server.health = [robotHealth(0, "ouster"), robotHealth(1, "avia", 20 + k)];
    const late = k % 20 === 6;
    if (late || k % 20 === 16)
      server.emit("alarm", {
        session: 1,
        name: "avia",
        kind: "deadline",
        text: "missed its deadline 3 times within a minute",
        since_s: Date.now() / 1000,
        state: late ? "raised" : "over",
      });
    k += 1;
  }, 800);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const points = Number(process.argv[2] ?? 2e6);
  const server = await new FakeServer(scene(points)).start(Number(process.argv[3] ?? 8765));
  server.health = [robotHealth(0, "ouster"), robotHealth(1, "avia")];
  drive(server);
  console.log(`${server.url}#token=${token}`);
}
