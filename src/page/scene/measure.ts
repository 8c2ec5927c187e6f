// Distance between two points that were picked.
import { Group, Vector3 } from "three";
import type { BlockPoints } from "./block_points";
import type { Labels } from "./labels";
import { Lines } from "./lines";
import type { Viewer } from "./viewer";

const reach_px = 8;

/** Point under a position of the canvas: the nearest to the eye within some pixels. */
export function pickedPoint(
  viewer: Viewer,
  blocks: BlockPoints[],
  x: number,
  y: number,
): Vector3 | null {
  let best: Vector3 | null = null,
    nearest = Infinity;
  for (const block of blocks) {
    if (!block.visible) continue;
    const clip = viewer.camera.projectionMatrix
      .clone()
      .multiply(viewer.camera.matrixWorldInverse)
      .multiply(block.matrixWorld).elements;
    const { packed, count } = block.block;
    for (let i = 0; i < 4 * count; i += 4) {
      const px = packed[i]!,
        py = packed[i + 1]!,
        pz = packed[i + 2]!;
      const w = clip[3]! * px + clip[7]! * py + clip[11]! * pz + clip[15]!;
      if (w <= 0 || w >= nearest) continue;
      const screenX =
        (((clip[0]! * px + clip[4]! * py + clip[8]! * pz + clip[12]!) / w + 1) * viewer.width) / 2 -
        x;
      const screenY =
        ((1 - (clip[1]! * px + clip[5]! * py + clip[9]! * pz + clip[13]!) / w) * viewer.height) /
          2 -
        y;
      if (screenX * screenX + screenY * screenY > reach_px * reach_px) continue;
      nearest = w;
      best = new Vector3(px, py, pz).applyMatrix4(block.matrixWorld);
    }
  }
  return best;
}

export class Measure {
  readonly group = new Group();
  active = false;
  private from: Vector3 | null = null;
  private lines: Lines | null = null;
  /** Words of the last measurement. */
  text = "";

  constructor(
    private readonly labels: Labels,
    private readonly viewer: Viewer,
  ) {}

  setActive(active: boolean): void {
    this.active = active;
    if (!active) this.clear();
  }

  clear(): void {
    this.from = null;
    this.text = "";
    this.lines?.release();
    this.lines = null;
    this.labels.remove("measure/");
  }

  pick(point: Vector3): void {
    if (!this.from) {
      this.clear();
      this.from = point;
      this.labels.set("measure/a", "first point", point, "measure");
      return;
    }
    const from = this.from;
    this.from = null;
    const difference = point.clone().sub(from);
    const level = Math.hypot(difference.x, difference.y);
    this.text = [difference.length(), level, difference.z]
      .map((metres, i) => `${["", "level ", "dz "][i]}${metres.toFixed(2)} m`)
      .join(" · ");
    const corner = [point.x, point.y, from.z];
    this.lines = new Lines(
      [
        ...from.toArray(),
        ...point.toArray(),
        ...from.toArray(),
        ...corner,
        ...corner,
        ...point.toArray(),
      ],
      { colour: "#ff4fa3", width: 2.5, hidden: 0.9 },
    );
    this.group.add(this.lines);
    this.labels.remove("measure/");
    this.labels.set("measure/d", this.text, from.clone().add(point).multiplyScalar(0.5), "measure");
    this.viewer.invalidate();
  }
}
