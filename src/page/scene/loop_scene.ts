// Small 3D view: both scans of a loop, one over the other.
import {
  Color,
  Group,
  LinearSRGBColorSpace,
  Matrix4,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Block } from "../data/blocks";
import { background, bytes, scanColour, type Theme } from "../palette";
import { BlockPoints } from "./block_points";
import { PointMaterial, PointUniforms } from "./point_material";

export class LoopScene {
  readonly canvas = document.createElement("canvas");
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(40, 1, 0.1, 2000);
  private readonly controls: OrbitControls;
  private readonly scans = new Group();
  private readonly uniforms = new PointUniforms();
  private readonly materials: PointMaterial[];
  private scheduled = false;

  constructor() {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: false });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.invalidate());
    this.scene.add(this.scans);
    this.uniforms.setSession(0, bytes(scanColour.match), true, [0, 0, 0]);
    this.uniforms.setSession(1, bytes(scanColour.query), true, [0, 0, 0]);
    this.uniforms.shared.smallest.value = 1.6;
    this.uniforms.shared.largest.value = 3;
    this.materials = [0, 1].map(() => new PointMaterial(this.uniforms, "keyframe"));
    for (const material of this.materials)
      for (let kind = 1; kind < 4; ++kind) material.setKind(kind, [128, 128, 128], false);
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  setTheme(theme: Theme): void {
    this.renderer.setClearColor(new Color(background[theme]), 1);
    this.invalidate();
  }

  /** Scan of the match at the origin, scan of the query at T_match_query. */
  show(match: Block, query: Block, T_match_query: Matrix4): void {
    this.clear();
    const frames = [new Matrix4(), T_match_query];
    [match, query].forEach((block, index) => {
      const points = new BlockPoints(block, this.materials[index]!, index);
      points.spacing = 0.12;
      points.place(frames[index]!);
      this.scans.add(points);
    });
    const size = extent(match);
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(-0.35 * size, -0.9 * size, 1.1 * size);
    this.camera.far = 20 * size;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.resize();
  }

  clear(): void {
    for (const child of [...this.scans.children]) (child as BlockPoints).release();
    this.invalidate();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.uniforms.shared.pixelsPerUnit.value =
      (clientHeight * ratio) / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  private invalidate(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      if (this.canvas.isConnected) this.renderer.render(this.scene, this.camera);
    });
  }
}

/** Extent of the middle of a scan: single far points do not make the view small. */
function extent(block: Block): number {
  const distances: number[] = [];
  const place = new Vector3();
  const every = Math.max(1, Math.floor(block.count / 2000)) * 4;
  for (let i = 0; i < 4 * block.count; i += every) {
    place
      .set(block.packed[i]!, block.packed[i + 1]!, 0)
      .multiplyScalar(block.step)
      .add(new Vector3(block.origin[0], block.origin[1], 0));
    distances.push(place.length());
  }
  distances.sort((a, b) => a - b);
  return Math.max(5, 1.7 * (distances[Math.floor(0.8 * distances.length)] ?? 10));
}
