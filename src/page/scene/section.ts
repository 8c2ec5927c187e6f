// Section box: points outside are not drawn.
import { Box3, Group, Vector3 } from "three";
import { boxEdges } from "./change_layer";
import { Lines } from "./lines";
import type { PointUniforms } from "./point_material";

export class Section {
  readonly group = new Group();
  /** Limits as shares 0..1 of the map's extent: low x, high x, low y, high y, low z, high z. */
  shares = [0, 1, 0, 1, 0, 1];
  active = false;
  private lines: Lines | null = null;

  constructor(
    private readonly uniforms: PointUniforms,
    private readonly bounds: () => Box3,
  ) {}

  get box(): Box3 {
    const { min, max } = this.bounds();
    const at = (axis: "x" | "y" | "z", share: number) =>
      min[axis] + (max[axis] - min[axis]) * share;
    const [x0, x1, y0, y1, z0, z1] = this.shares as [
      number,
      number,
      number,
      number,
      number,
      number,
    ];
    return new Box3(
      new Vector3(at("x", x0), at("y", y0), at("z", z0)),
      new Vector3(at("x", x1), at("y", y1), at("z", z1)),
    );
  }

  apply(): void {
    const { boxLow, boxHigh } = this.uniforms.shared;
    this.lines?.release();
    this.lines = null;
    if (!this.active) {
      boxLow.value.setScalar(-1e9);
      boxHigh.value.setScalar(1e9);
      return;
    }
    const box = this.box;
    boxLow.value.copy(box.min);
    boxHigh.value.copy(box.max);
    this.lines = new Lines(
      boxEdges({
        centre: box.getCenter(new Vector3()).toArray(),
        size: box.getSize(new Vector3()).toArray(),
        heading: 0,
      }),
      { colour: "#8a93a3", width: 1.5, hidden: 0.5 },
    );
    this.group.add(this.lines);
  }
}
