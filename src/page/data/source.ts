// Sources of the map: a server, or the page itself.
import { decodeBlock, type Block } from "./blocks";
import { checkedMap, type MapData, type RobotAlarm, type RobotHealth } from "./format";

export interface Health {
  robots: RobotHealth[];
  alarms: RobotAlarm[];
}

export interface Source {
  /** Whether a server answers: then there are events, and changes of the map. */
  readonly live: boolean;
  /** Bytes of points read so far, as transferred. */
  bytes: number;
  /** The epoch that is looked at; null: the latest. */
  shownEpoch: number | null;
  map(): Promise<MapData>;
  tile(epoch: number, layer: string, key: string): Promise<Block>;
  keyframe(epoch: number, session: number, keyframe: number): Promise<Block>;
  hasKeyframe(session: number, keyframe: number): boolean;
  health(): Promise<Health>;
}

/** `cache`: tiles never change, the map and health do under the same address. */
async function answer(url: string, cache: RequestCache): Promise<Response> {
  const response = await fetch(url, { cache });
  if (!response.ok) throw new Error(`${url}: the server answers ${response.status}`);
  return response;
}

class Server implements Source {
  readonly live = true;
  shownEpoch: number | null = null;
  bytes = 0;

  /** What points are of: an epoch that grows, or whose map is made later, has several. */
  private version: string | undefined;
  private summaries: Set<number>[] = [];

  async map(): Promise<MapData> {
    const raw = await (await answer(this.shownEpoch === null ? "api/map" : `api/map?epoch=${this.shownEpoch}`, "no-store")).json();
    this.version = typeof raw?.version === "string" ? raw.version : undefined;
    const map = checkedMap(raw);
    this.summaries = map.sessions.map((session) => new Set(session.summaries));
    return map;
  }

  async tile(epoch: number, layer: string, key: string): Promise<Block> {
    return this.block(`api/tiles/${this.version ?? epoch}/${encodeURIComponent(layer)}/${encodeURIComponent(key)}`);
  }

  async keyframe(epoch: number, session: number, keyframe: number): Promise<Block> {
    return this.block(`api/keyframes/${this.version ?? epoch}/${session}/${keyframe}`);
  }

  hasKeyframe(session: number, keyframe: number): boolean {
    return !this.summaries[session]?.has(keyframe);
  }

  async health(): Promise<Health> {
    const raw = await (await answer("api/health", "no-store")).json();
    return {
      robots: Array.isArray(raw?.robots) ? raw.robots : [],
      alarms: Array.isArray(raw?.alarms) ? raw.alarms : [],
    };
  }

  private async block(url: string): Promise<Block> {
    const response = await answer(url, "default");
    const transferred = Number(response.headers.get("Content-Length") ?? 0);
    const buffer = await response.arrayBuffer();
    this.bytes += transferred || buffer.byteLength;
    try {
      return decodeBlock(buffer);
    } catch (error) {
      throw new Error(`${url}: ${(error as Error).message}`);
    }
  }
}

class Inlined implements Source {
  readonly live = false;
  shownEpoch: number | null = null;
  bytes = 0;

  async map(): Promise<MapData> {
    return checkedMap(JSON.parse(document.getElementById("map-json")!.textContent ?? ""));
  }

  async tile(_epoch: number, layer: string, key: string): Promise<Block> {
    return this.block(`points/${layer}/${key}`);
  }

  async keyframe(_epoch: number, session: number, keyframe: number): Promise<Block> {
    return this.block(`points/keyframe/${session}/${keyframe}`);
  }

  hasKeyframe(session: number, keyframe: number): boolean {
    return document.getElementById(`points/keyframe/${session}/${keyframe}`) !== null;
  }

  async health(): Promise<Health> {
    return { robots: [], alarms: [] };
  }

  private async block(id: string): Promise<Block> {
    const text = document.getElementById(id)?.textContent?.trim();
    if (!text) throw new Error(`${id}: not in this file`);
    try {
      const compressed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      this.bytes += compressed.byteLength;
      const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("gzip"));
      return decodeBlock(await new Response(stream).arrayBuffer());
    } catch (error) {
      throw new Error(`${id}: ${(error as Error).message}`);
    }
  }
}

export function chosenSource(): Source {
  return document.getElementById("map-json") ? new Inlined() : new Server();
}
