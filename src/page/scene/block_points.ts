// Points of a block as an object of the scene.
import { BufferAttribute, BufferGeometry, Matrix4, Points, Vector3 } from "three";
import type { Block } from "../data/blocks";
import type { PointMaterial } from "./point_material";

export class BlockPoints extends Points<BufferGeometry, PointMaterial> {
  /** Distance of neighbours on surfaces, in metres: it gives the size on the screen. */
  spacing = 0.1;

  constructor(
    readonly block: Block,
    material: PointMaterial,
    readonly session = -1,
  ) {
    super(new BufferGeometry(), material);
    this.geometry.setAttribute("position", new BufferAttribute(block.packed, 4));
    if (block.intensity)
      this.geometry.setAttribute("intensity", new BufferAttribute(block.intensity, 1, true));
    this.frustumCulled = false;
    this.matrixAutoUpdate = false;
    this.place(new Matrix4());
    this.onBeforeRender = () => {
      material.set("spacing", this.spacing);
      material.set("onlySession", this.session);
      material.uniformsNeedUpdate = true;
    };
  }

  /** T_map_frame of the block's frame. */
  place(frame: Matrix4): void {
    const { origin, step } = this.block;
    this.matrix
      .copy(frame)
      .multiply(new Matrix4().makeTranslation(...origin))
      .scale(new Vector3(step, step, step));
    this.matrixWorldNeedsUpdate = true;
  }

  release(): void {
    this.removeFromParent();
    this.geometry.dispose();
  }
}
