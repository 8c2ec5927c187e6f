// Canvas with the frame loop: drawn only where something changed.
import {
  Color,
  ColorManagement,
  Frustum,
  LinearSRGBColorSpace,
  Matrix4,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { Budget } from "./budget";
import { EyeDome } from "./eye_dome";
import { behindPoints } from "./lines";
import type { View } from "./octree";

/** Part of the scene with a state per frame; true asks for another frame. */
export type FramePart = (seconds: number) => boolean;
const rest_ms = 220;
const error_px = 1.3;

/** Name of the renderer; null where the browser has no WebGL 2. */
export function rendererName(): string | null {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return null;
  const information = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(
    context.getParameter(information ? information.UNMASKED_RENDERER_WEBGL : context.RENDERER),
  );
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}

export class Viewer {
  readonly camera = new PerspectiveCamera(55, 1, 0.1, 5000);
  readonly points = new Scene();
  readonly overlay = new Scene();
  readonly renderer: WebGLRenderer;
  readonly budget: Budget;
  readonly parts: FramePart[] = [];
  width = 1;
  height = 1;
  /** Device pixels per pixel of the page, as drawn now. */
  ratio = 1;
  shading = 1;
  frames = 0;
  /** Time of the page's own work in a frame, without that of the graphics card. */
  script_ms = 0;
  private readonly eyeDome = new EyeDome();
  private scheduled = false;
  private last_ms = 0;
  private moved_ms = 0;
  private moved = false;
  private wasMoving = false;

  constructor(
    readonly canvas: HTMLCanvasElement,
    readonly name: string,
    private readonly selectTiles: (view: View) => void,
  ) {
    const software = /swiftshader|llvmpipe|software|basic render/i.test(name);
    ColorManagement.enabled = false;
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: !software,
      powerPreference: "high-performance",
    });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    this.budget = new Budget(software);
    this.ratio = this.budget.fullRatio;
    this.camera.up.set(0, 0, 1);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  get pixelsPerUnit(): number {
    return (this.height * this.ratio) / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
  }

  setBackground(colour: string): void {
    this.renderer.setClearColor(new Color(colour), 1);
    this.invalidate();
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    this.width = Math.max(1, clientWidth);
    this.height = Math.max(1, clientHeight);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(this.width, this.height, false);
    this.eyeDome.resize(
      Math.floor(this.width * this.ratio),
      Math.floor(this.height * this.ratio),
      this.ratio,
    );
    this.camera.aspect = this.width / this.height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  private setRatio(ratio: number): void {
    if (ratio === this.ratio) return;
    this.ratio = ratio;
    this.resize();
  }

  /** The view moves: fewer points until it rests. */
  move(): void {
    this.moved_ms = performance.now();
    this.moved = true;
    this.invalidate();
  }

  invalidate(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  private frame(now: number): void {
    const start = performance.now();
    this.scheduled = false;
    const elapsed_ms = now - this.last_ms;
    let again = false;
    for (const part of this.parts) again = part(Math.min(elapsed_ms / 1000, 0.25)) || again;
    // A frame may take longer than the pause that counts as rest.
    const moving = this.moved || performance.now() - this.moved_ms < rest_ms;
    this.moved = false;
    if (moving && this.wasMoving) this.budget.measured(elapsed_ms);
    this.setRatio(moving ? this.budget.ratio : this.budget.fullRatio);
    this.last_ms = now;
    this.draw(moving);
    this.wasMoving = moving;
    this.script_ms = 0.8 * this.script_ms + 0.2 * (performance.now() - start);
    again = again || moving;
    if (again) this.invalidate();
  }

  private draw(moving: boolean): void {
    this.camera.updateMatrixWorld();
    const projection = new Matrix4().multiplyMatrices(
      this.camera.projectionMatrix,
      this.camera.matrixWorldInverse,
    );
    this.selectTiles({
      frustum: new Frustum().setFromProjectionMatrix(projection),
      eye: this.camera.getWorldPosition(new Vector3()),
      pixelsPerUnit: this.pixelsPerUnit,
      budget: moving ? this.budget.points : this.budget.atRest,
      error_px,
    });
    const plain = moving && this.budget.plain;
    if (plain) this.camera.layers.disable(behindPoints);
    else this.camera.layers.enable(behindPoints);
    this.renderer.clear();
    this.eyeDome.render(this.renderer, this.points, this.camera, plain ? 0 : this.shading);
    this.renderer.render(this.overlay, this.camera);
    this.frames += 1;
  }

  /** Position in pixels of the canvas; null behind the camera. */
  project(place: Vector3): { x: number; y: number; depth: number } | null {
    const eye = place.clone().applyMatrix4(this.camera.matrixWorldInverse);
    if (eye.z > -this.camera.near) return null;
    const clip = eye.clone().applyMatrix4(this.camera.projectionMatrix);
    return {
      x: ((clip.x + 1) / 2) * this.width,
      y: ((1 - clip.y) / 2) * this.height,
      depth: -eye.z,
    };
  }
}
