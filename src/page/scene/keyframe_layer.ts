// Keyframes as points of their own, each moved by its pose.
import { Group, Matrix4 } from "three";
import type { KeyframeEvent } from "../data/format";
import type { Source } from "../data/source";
import type { State } from "../state";
import { BlockPoints } from "./block_points";
import { PointMaterial, type PointUniforms } from "./point_material";
import { matrixOf } from "./poses";
import type { TrajectoryLayer } from "./trajectory_layer";

const parallelRequests = 4;
const spacing_m = 0.18;
/** A keyframe has some ten thousand points. */
const mostKeyframes = 500;
/** So many that just arrived come before all others. */
const newest = 60;
/** Of a drive up to a time: so many of each session come before those farther back. */
const recentOfDrive = 8;
/** Sessions beside the map are shown by a part of their keyframes. */
const ofProvisionalSession = 24;

interface Entry {
  session: number;
  keyframe: number;
  points: BlockPoints | null;
  used: number;
}
type Reference = [session: number, keyframe: number];
const keyOf = ([session, keyframe]: Reference): string => `${session}/${keyframe}`;

export class KeyframeLayer {
  readonly group = new Group();
  readonly material: PointMaterial;
  readonly fadedMaterial: PointMaterial;
  pointsDrawn = 0;
  drawn = 0;
  private entries = new Map<string, Entry>();
  private failed = new Set<string>();
  private live = new Map<string, Reference>();
  private epoch = 0;
  private wanted: Reference[] = [];
  private shown: BlockPoints[] = [];
  private loading = 0;
  private round = 0;

  constructor(
    private readonly source: Source,
    private readonly state: State,
    uniforms: PointUniforms,
    private readonly trajectories: TrajectoryLayer,
    private readonly limit: () => number,
    private readonly changed: () => void,
  ) {
    this.material = new PointMaterial(uniforms, "keyframe");
    this.fadedMaterial = new PointMaterial(uniforms, "keyframe");
    this.fadedMaterial.set("opacity", 0.5);
  }

  arrived(event: KeyframeEvent): void {
    const reference: Reference = [event.session, event.keyframe];
    this.live.set(keyOf(reference), reference);
    this.choose();
  }

  /** Keyframes that the tiles now hold leave; the others keep the pose of the new map. */
  show(): void {
    const map = this.state.map!;
    for (const [key, [session, keyframe]] of this.live)
      if (map.sessions[session]?.poses[keyframe]) this.live.delete(key);
    this.failed.clear();
    // Labels of a stored map belong to its epoch; while there is none, keyframes stay as they came.
    if (map.epoch !== this.epoch && map.layers["static"]) this.forget();
    this.epoch = map.epoch;
    this.choose();
  }

  /** Which keyframes the settings ask for: the newest and the evenly distributed first. */
  choose(): void {
    const map = this.state.map!;
    const { settings } = this.state;
    const chosen = new Map<string, Reference>();
    const add = (reference: Reference) => {
      if (chosen.size < mostKeyframes && this.source.hasKeyframe(...reference))
        chosen.set(keyOf(reference), reference);
    };
    [...this.live.values()].slice(-newest).reverse().forEach(add);
    const all = !map.layers["static"] || settings.driveTime_s !== null;
    const lists = map.sessions.map((session, index) => {
      if (settings.hiddenSessions.has(index)) return [];
      const provisional = !this.state.inMap(index);
      if (provisional ? settings.placement === "hidden" : !all) return [];
      const driven = session.poses
        .map((_, k): Reference => [index, k])
        .filter(([, k]) => this.state.driven(index, k));
      const every = provisional ? Math.ceil(session.poses.length / ofProvisionalSession) : 1;
      const kept = driven.filter(([, k]) => k % every === 0);
      const recent = settings.driveTime_s === null ? 0 : recentOfDrive;
      return [
        ...kept.slice(Math.max(0, kept.length - recent)).reverse(),
        ...evenly(kept.slice(0, Math.max(0, kept.length - recent))),
      ];
    });
    lists.push(evenly([...this.live.values()]));
    for (let i = 0; lists.some((list) => i < list.length); ++i)
      for (const list of lists) if (list[i]) add(list[i]!);
    this.wanted = [...chosen.values()];
    this.round += 1;
    this.refresh();
    this.request();
  }

  private refresh(): void {
    for (const entry of this.entries.values()) if (entry.points) entry.points.visible = false;
    this.shown = this.wanted.flatMap((reference) => {
      const entry = this.entries.get(keyOf(reference));
      if (!entry?.points || this.state.settings.hiddenSessions.has(entry.session)) return [];
      entry.used = this.round;
      return this.place(entry) ? [entry.points] : [];
    });
    this.thin(this.limit());
    this.changed();
  }

  /** The first of the chosen ones, as many as a number of points permits. */
  thin(limit: number): void {
    this.drawn = this.pointsDrawn = 0;
    for (const points of this.shown) {
      points.visible = this.pointsDrawn + points.block.count <= limit;
      if (!points.visible) continue;
      this.drawn += 1;
      this.pointsDrawn += points.block.count;
    }
  }

  isDrawn(...reference: Reference): boolean {
    return this.entries.get(keyOf(reference))?.points?.visible ?? false;
  }

  private get pointsReady(): number {
    return this.shown.reduce((sum, points) => sum + points.block.count, 0);
  }

  get visibleBlocks(): BlockPoints[] {
    return this.shown.filter((points) => points.visible);
  }

  /** Puts each keyframe at its pose of now: corrections move them. */
  follow(): void {
    for (const entry of this.entries.values()) if (entry.points?.visible) this.place(entry);
  }

  /** False where the keyframe has no place. */
  private place({ session, keyframe, points }: Entry): boolean {
    const frame =
      this.trajectories.frames[session] ??
      (this.live.has(keyOf([session, keyframe])) ? new Matrix4() : null);
    const pose = this.trajectories.pose(session, keyframe);
    if (!pose || !frame || !points) return false;
    points.place(matrixOf(pose).premultiply(frame));
    const faded = !this.state.inMap(session) && this.state.settings.placement === "provisional";
    points.material = faded ? this.fadedMaterial : this.material;
    return true;
  }

  /** Keyframes that were held back may be fetched. */
  release(): void {
    this.held = false;
    this.request();
  }

  private held = true;

  private request(): void {
    for (const reference of this.wanted) {
      if (this.loading >= parallelRequests || this.pointsReady >= this.limit()) return;
      const key = keyOf(reference);
      if (this.held && !this.live.has(key)) continue;
      if (this.entries.has(key) || this.failed.has(key)) continue;
      this.entries.set(key, {
        session: reference[0],
        keyframe: reference[1],
        points: null,
        used: this.round,
      });
      void this.load(reference, key);
    }
  }

  private async load(reference: Reference, key: string): Promise<void> {
    this.loading += 1;
    try {
      const block = await this.source.keyframe(this.state.map!.epoch, ...reference);
      const points = new BlockPoints(block, this.material, reference[0]);
      points.spacing = spacing_m;
      this.group.add(points);
      this.entries.get(key)!.points = points;
    } catch (error) {
      this.entries.delete(key);
      this.failed.add(key);
      this.state.alarm("error", (error as Error).message);
    }
    this.loading -= 1;
    this.evict();
    this.refresh();
    this.request();
  }

  private forget(): void {
    for (const [key, entry] of this.entries) {
      if (!entry.points || this.live.has(key)) continue;
      entry.points.release();
      this.entries.delete(key);
    }
  }

  private evict(): void {
    if (this.entries.size <= 1.5 * mostKeyframes) return;
    const unused = [...this.entries]
      .filter(([, entry]) => entry.points && entry.used < this.round)
      .sort((a, b) => a[1].used - b[1].used);
    for (const [key, entry] of unused.slice(0, this.entries.size - mostKeyframes)) {
      entry.points!.release();
      this.entries.delete(key);
    }
  }
}

/** Order in which every beginning covers the whole evenly. */
function evenly<T>(list: T[]): T[] {
  const bits = Math.max(1, Math.ceil(Math.log2(list.length + 1)));
  const reversed = (i: number): number => {
    let result = 0;
    for (let bit = 0; bit < bits; ++bit) if (i & (1 << bit)) result |= 1 << (bits - 1 - bit);
    return result;
  };
  return list
    .map((value, i) => ({ value, order: reversed(i) }))
    .sort((a, b) => a.order - b.order)
    .map(({ value }) => value);
}
