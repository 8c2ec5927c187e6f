// Trajectories: lines, uncertainty, error along the path.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  Group,
  type Matrix4,
  Mesh,
  MeshBasicMaterial,
  Vector3,
} from "three";
import type { KeyframeEvent, Pose, Session } from "../data/format";
import { rampAt, sessionColour } from "../palette";
import type { State } from "../state";
import { Lines } from "./lines";
import { between, position, samePose } from "./poses";

const correction_s = 0.6;
/** Uncertainty is drawn at two standard deviations. */
const deviations = 2;

export class TrajectoryLayer {
  readonly group = new Group();
  private shownPoses: Pose[][] = [];
  private fromPoses: (Pose | undefined)[][] | null = null;
  private readonly live = new Map<number, Map<number, Pose>>();
  /** Frames of the sessions in the map frame; null where a session is not shown. */
  frames: (Matrix4 | null)[] = [];
  private moved_s = 0;
  private lines: Lines[] = [];
  private ribbons: Mesh[] = [];

  constructor(private readonly state: State) {}

  /** New poses are reached over 0.6 s where there were others, also of what just arrived. */
  show(): void {
    const target = this.state.map!.sessions.map((session) => session.poses);
    const before = target.map((poses, i) => poses.map((_, k) => this.pose(i, k)));
    const differs = target.some((poses, i) =>
      poses.some((pose, k) => before[i]![k] && !samePose(before[i]![k]!, pose)),
    );
    for (const [session, live] of this.live)
      for (const keyframe of live.keys()) if (target[session]?.[keyframe]) live.delete(keyframe);
    this.fromPoses = differs ? before : null;
    this.moved_s = 0;
    this.shownPoses = target.map((poses, i) =>
      poses.map((pose, k) => (differs && before[i]![k]) || pose),
    );
    this.rebuild();
  }

  /** A keyframe arrived: its path grows until the next map. */
  arrived({ session, keyframe, pose }: KeyframeEvent): void {
    const live = this.live.get(session) ?? new Map<number, Pose>();
    this.live.set(session, live.set(keyframe, pose));
    this.rebuild();
  }

  step(seconds: number): boolean {
    if (!this.fromPoses) return false;
    this.moved_s += seconds;
    const part = Math.min(1, this.moved_s / correction_s);
    const target = this.state.map!.sessions.map((session) => session.poses);
    const eased = part * part * (3 - 2 * part);
    this.shownPoses = target.map((poses, i) =>
      poses.map((pose, k) => {
        const from = this.fromPoses![i]?.[k];
        return from ? between(from, pose, eased) : pose;
      }),
    );
    if (part === 1) this.fromPoses = null;
    this.rebuild();
    return true;
  }

  /** Pose as drawn now, while a correction moves it. */
  pose(session: number, keyframe: number): Pose | undefined {
    return this.shownPoses[session]?.[keyframe] ?? this.live.get(session)?.get(keyframe);
  }

  private path(session: number): Pose[] {
    return [...(this.shownPoses[session] ?? []), ...(this.live.get(session)?.values() ?? [])];
  }

  rebuild(): void {
    this.lines.forEach((line) => line.release());
    this.ribbons.forEach((mesh) => {
      mesh.removeFromParent();
      mesh.geometry.dispose();
    });
    this.lines = [];
    this.ribbons = [];
    if (!this.state.settings.trajectories) return;
    this.state.map!.sessions.forEach((session, index) => this.draw(session, index));
  }

  private draw(session: Session, index: number): void {
    const { settings } = this.state;
    const frame = this.frames[index];
    if (!frame || settings.hiddenSessions.has(index)) return;
    const places: Vector3[] = [];
    for (const [k, pose] of this.path(index).entries()) {
      if (!this.state.driven(index, k)) break;
      places.push(position(pose).applyMatrix4(frame));
    }
    const apart = !this.state.inMap(index);
    const errors = settings.pathError ? this.state.map!.evaluation?.ate_m?.[index] : undefined;
    const segments: number[] = [],
      colours: number[] = [];
    for (let k = 1; k < places.length; ++k) {
      segments.push(...places[k - 1]!.toArray(), ...places[k]!.toArray());
      if (errors) colours.push(...this.errorColour(errors[k - 1]), ...this.errorColour(errors[k]));
    }
    const line = new Lines(
      segments,
      {
        width: errors ? 5 : 2.5,
        ...(errors ? {} : { colour: sessionColour(index, settings.theme) }),
        opacity: apart ? 0.6 : 1,
        ...(apart ? { dash: [1.5, 1] as [number, number] } : {}),
      },
      errors ? colours : undefined,
    );
    this.lines.push(line);
    this.group.add(line);
    if (settings.uncertainty && session.sigma_m)
      this.addRibbon(places, session.sigma_m, sessionColour(index, settings.theme));
  }

  get largestError(): number {
    const errors = (this.state.map?.evaluation?.ate_m ?? [])
      .flat()
      .filter((value): value is number => typeof value === "number");
    return Math.max(0.1, ...errors);
  }

  private errorColour(error: number | null | undefined): number[] {
    if (typeof error !== "number") return [0.5, 0.5, 0.5];
    return rampAt(error / this.largestError).map((value) => value / 255);
  }

  /** Band as wide as the uncertainty to both sides of the path. */
  private addRibbon(places: Vector3[], sigma: number[], colour: string): void {
    if (places.length < 2) return;
    const vertices: number[] = [],
      triangles: number[] = [];
    places.forEach((place, k) => {
      const ahead = places[Math.min(k + 1, places.length - 1)]!.clone().sub(
        places[Math.max(k - 1, 0)]!,
      );
      const side = new Vector3(-ahead.y, ahead.x, 0)
        .normalize()
        .multiplyScalar(deviations * (sigma[k] ?? 0));
      vertices.push(...place.clone().add(side).toArray(), ...place.clone().sub(side).toArray());
      if (k > 0) triangles.push(2 * k - 2, 2 * k - 1, 2 * k, 2 * k, 2 * k - 1, 2 * k + 1);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(vertices), 3));
    geometry.setIndex(triangles);
    const material = new MeshBasicMaterial({
      color: new Color(colour),
      transparent: true,
      opacity: 0.4,
      depthWrite: false,
      depthTest: false,
      side: DoubleSide,
    });
    const mesh = new Mesh(geometry, material);
    this.ribbons.push(mesh);
    this.group.add(mesh);
  }
}
