// Changed objects as boxes.
import { Group, Vector3 } from "three";
import type { Box, Change } from "../data/format";
import { changeColour } from "../palette";
import type { State } from "../state";
import { Lines } from "./lines";
import { pixelsToSegment } from "./picking";
import type { Viewer } from "./viewer";

export function boxEdges(box: Box): number[] {
  const [cx, cy, cz] = box.centre as [number, number, number];
  const [sx, sy, sz] = box.size as [number, number, number];
  const cos = Math.cos(box.heading),
    sin = Math.sin(box.heading);
  const corner = (i: number): number[] => {
    const x = ((i & 1) - 0.5) * sx,
      y = (((i >> 1) & 1) - 0.5) * sy,
      z = (((i >> 2) & 1) - 0.5) * sz;
    return [cx + cos * x - sin * y, cy + sin * x + cos * y, cz + z];
  };
  const edges: number[] = [];
  for (let i = 0; i < 8; ++i)
    for (const bit of [1, 2, 4]) if (!(i & bit)) edges.push(...corner(i), ...corner(i | bit));
  return edges;
}

export class ChangeLayer {
  readonly group = new Group();
  private lines: Lines[] = [];

  constructor(private readonly state: State) {}

  private shown(change: Change): boolean {
    const { boxes, changeKinds, hiddenSessions } = this.state.settings;
    return boxes && changeKinds[change.kind] && !hiddenSessions.has(change.session);
  }

  /** Changed object whose box is nearest to a position of the canvas, within some pixels. */
  at(viewer: Viewer, x: number, y: number, reach: number): Change | null {
    let best: Change | null = null;
    let least = reach;
    for (const change of this.state.map!.changes) {
      const edges = this.shown(change) ? boxEdges(change.box) : [];
      for (let i = 0; i < edges.length; i += 6) {
        const ends = [
          new Vector3(...edges.slice(i, i + 3)),
          new Vector3(...edges.slice(i + 3, i + 6)),
        ] as const;
        const distance = pixelsToSegment(viewer, x, y, ...ends);
        if (distance < least) [best, least] = [change, distance];
      }
    }
    return best;
  }

  rebuild(): void {
    this.lines.forEach((line) => line.release());
    this.lines = [];
    const { settings, map } = this.state;
    if (!settings.boxes) return;
    for (const [kind, colour] of Object.entries(changeColour)) {
      const shown = map!.changes.filter((change) => change.kind === kind && this.shown(change));
      this.add(
        new Lines(
          shown.flatMap((change) => boxEdges(change.box)),
          { colour, width: 2 },
        ),
      );
      this.add(
        new Lines(
          shown.flatMap((change) =>
            change.before
              ? [...boxEdges(change.before), ...change.before.centre, ...change.box.centre]
              : [],
          ),
          { colour, width: 1.5, dash: [0.4, 0.3] },
        ),
      );
    }
  }

  private add(line: Lines): void {
    this.lines.push(line);
    this.group.add(line);
  }
}
