// Loops as lines: colour and dashes by state, picked by pixel distance.
import { Group, Vector3 } from "three";
import type { Loop, LoopState } from "../data/format";
import { loopColour } from "../palette";
import type { State } from "../state";
import { Lines } from "./lines";
import { position } from "./poses";
import type { TrajectoryLayer } from "./trajectory_layer";
import { pixelsToSegment } from "./picking";
import type { Viewer } from "./viewer";

/** Without colour: accepted solid, provisional long dashes, refused dots. */
const dashes: Record<LoopState, [number, number] | undefined> = {
  accepted: undefined,
  provisional: [1.2, 0.6],
  refused: [0.3, 0.5],
};

export class LoopLayer {
  readonly group = new Group();
  private lines: Lines[] = [];
  drawn = 0;

  constructor(
    private readonly state: State,
    private readonly trajectories: TrajectoryLayer,
  ) {}

  end(reference: [number, number]): Vector3 | null {
    const [session, keyframe] = reference;
    const pose = this.trajectories.pose(session, keyframe),
      frame = this.trajectories.frames[session];
    return pose && frame ? position(pose).applyMatrix4(frame) : null;
  }

  ends(loop: Loop): [Vector3, Vector3] | null {
    const query = this.end(loop.query),
      match = this.end(loop.match);
    return query && match ? [query, match] : null;
  }

  shown(loop: Loop): boolean {
    const { settings } = this.state;
    return (
      settings.loops &&
      settings.loopStates[loop.state] &&
      [loop.query, loop.match].every(
        ([session, keyframe]) =>
          !settings.hiddenSessions.has(session) && this.state.driven(session, keyframe),
      )
    );
  }

  rebuild(): void {
    this.lines.forEach((line) => line.release());
    this.lines = [];
    this.drawn = 0;
    const { theme } = this.state.settings;
    for (const state of ["refused", "provisional", "accepted"] as LoopState[]) {
      const segments = this.state
        .map!.loops.filter((loop) => loop.state === state && this.shown(loop))
        .flatMap((loop) => this.ends(loop)?.flatMap((end) => end.toArray()) ?? []);
      this.drawn += segments.length / 6;
      const dash = dashes[state];
      this.add(
        new Lines(segments, {
          colour: loopColour[theme][state]!,
          width: state === "accepted" ? 2 : 2.5,
          ...(dash ? { dash } : {}),
        }),
      );
    }
    this.addSelected();
  }

  private addSelected(): void {
    const loop = this.state.map!.loops[this.state.selectedLoop ?? -1];
    const ends = loop && this.ends(loop);
    if (!ends) return;
    const segments = ends.flatMap((end) => end.toArray());
    for (const end of ends)
      segments.push(
        ...end
          .clone()
          .add(new Vector3(0, 0, 4))
          .toArray(),
        ...end.toArray(),
      );
    this.add(
      new Lines(segments, {
        colour: this.state.settings.theme === "dark" ? "#ffffff" : "#000000",
        width: 4,
        hidden: 0.9,
      }),
    );
  }

  private add(line: Lines): void {
    this.lines.push(line);
    this.group.add(line);
  }

  /** Loop nearest to a position of the canvas, within some pixels. */
  at(viewer: Viewer, x: number, y: number, reach: number): number | null {
    let best: number | null = null,
      least = reach;
    this.state.map!.loops.forEach((loop, index) => {
      const ends = this.shown(loop) ? this.ends(loop) : null;
      const distance = ends ? pixelsToSegment(viewer, x, y, ...ends) : Infinity;
      if (distance < least) [best, least] = [index, distance];
    });
    return best;
  }
}
