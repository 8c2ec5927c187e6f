// Movement of the camera: orbit, walk and top view, by mouse, touch and keys.
import { type Box3, MOUSE, TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Viewer } from "./viewer";

export type Mode = "orbit" | "walk" | "top";
/** Degrees; the narrow angle of the top view is nearly a plan. */
const fovs: Record<Mode, number> = { orbit: 55, walk: 70, top: 8 };
const walkDistance_m = 12;

export class CameraControl {
  mode: Mode = "orbit";
  readonly controls: OrbitControls;
  /** Height of the sensors near a place, which a walker's eyes follow. */
  eyeHeight: (place: Vector3) => number = (place) => place.z;
  private readonly pressed = new Set<string>();
  private yaw = 0;
  private pitch = 0;
  private drags = new Map<number, { x: number; y: number }>();

  constructor(private readonly viewer: Viewer) {
    this.controls = new OrbitControls(viewer.camera, viewer.canvas);
    this.controls.zoomToCursor = true;
    this.controls.screenSpacePanning = false;
    this.controls.maxPolarAngle = 0.495 * Math.PI;
    this.controls.minDistance = 0.5;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.addEventListener("change", () => viewer.move());
    viewer.parts.push((seconds) => this.step(seconds));
    document.addEventListener("keydown", (event) => this.key(event, true));
    window.addEventListener("keyup", (event) => this.key(event, false));
    window.addEventListener("blur", () => this.pressed.clear());
    viewer.canvas.addEventListener("pointerdown", (event) =>
      this.drags.set(event.pointerId, { x: event.clientX, y: event.clientY }),
    );
    viewer.canvas.addEventListener("pointermove", (event) => this.dragged(event));
    for (const end of ["pointerup", "pointercancel"] as const)
      window.addEventListener(end, (event) => this.drags.delete(event.pointerId));
  }

  /** The whole of a box in view, from the south and above. */
  fit(box: Box3): void {
    if (box.isEmpty()) return;
    const centre = box.getCenter(new Vector3());
    const extent = box.getSize(new Vector3());
    const size = Math.max(extent.x, extent.y, 4);
    const mode = this.mode === "walk" ? "orbit" : this.mode;
    this.mode = "orbit";
    this.viewer.camera.fov = fovs.orbit;
    this.controls.target.copy(centre);
    const away = size * Math.max(1, 1.2 / this.viewer.camera.aspect);
    this.viewer.camera.position
      .copy(centre)
      .add(new Vector3(-0.16 * away, -0.68 * away, 0.56 * away));
    this.range(size);
    this.setMode(mode);
  }

  focus(place: Vector3, distance: number): void {
    if (this.mode === "walk") this.setMode("orbit");
    const away = this.viewer.camera.position
      .clone()
      .sub(this.controls.target)
      .setLength((distance * fovs.orbit) / this.viewer.camera.fov);
    this.controls.target.copy(place);
    this.viewer.camera.position.copy(place).add(away);
    this.controls.update();
    this.viewer.move();
  }

  private range(size: number): void {
    this.viewer.camera.near = Math.max(0.05, size / 5000);
    this.viewer.camera.far = 40 * size;
    this.controls.maxDistance = 20 * size;
    this.viewer.camera.updateProjectionMatrix();
  }

  setMode(mode: Mode): void {
    const before = this.mode;
    this.mode = mode;
    const { controls } = this;
    controls.enabled = mode !== "walk";
    controls.enableRotate = mode === "orbit";
    controls.touches = { ONE: mode === "top" ? TOUCH.PAN : TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    controls.mouseButtons.LEFT = mode === "top" ? MOUSE.PAN : MOUSE.ROTATE;
    const distance = this.sameExtent(before, fovs[mode]);
    if (mode === "walk") this.beginWalk(controls.target);
    else this.look(mode, before, distance);
    this.viewer.move();
  }

  /** Distance from which the new angle of view shows as much as the old one did. */
  private sameExtent(before: Mode, fov: number): number {
    const { camera } = this.viewer,
      { target } = this.controls;
    if (before === "walk")
      target.copy(camera.position).add(this.forward().multiplyScalar(walkDistance_m));
    const tangent = (degrees: number) => Math.tan((degrees * Math.PI) / 360);
    const distance =
      ((before === "walk" ? 3 * walkDistance_m : camera.position.distanceTo(target)) *
        tangent(camera.fov)) /
      tangent(fov);
    camera.fov = fov;
    camera.updateProjectionMatrix();
    return distance;
  }

  /** From straight above, or from where the eye was; from above and the south after another view. */
  private look(mode: Mode, before: Mode, distance: number): void {
    const { camera } = this.viewer,
      { target } = this.controls;
    const away = mode === "top" ? new Vector3(0, -0.001, 1) : new Vector3(0, -0.78, 0.62);
    if (mode === "orbit" && before === "orbit") away.copy(camera.position).sub(target);
    camera.position.copy(target).add(away.setLength(distance));
    this.controls.update();
  }

  private beginWalk(target: Vector3): void {
    const { camera } = this.viewer;
    const direction = target.clone().sub(camera.position);
    this.yaw = Math.atan2(direction.y, direction.x);
    this.pitch = 0;
    camera.position.copy(target);
    camera.position.z = this.eyeHeight(target);
    this.turn();
  }

  private forward(): Vector3 {
    return new Vector3(
      Math.cos(this.yaw) * Math.cos(this.pitch),
      Math.sin(this.yaw) * Math.cos(this.pitch),
      Math.sin(this.pitch),
    );
  }

  private turn(): void {
    const { camera } = this.viewer;
    camera.lookAt(camera.position.clone().add(this.forward()));
    this.viewer.move();
  }

  /** One finger or the mouse looks around; two fingers walk. */
  private dragged(event: PointerEvent): void {
    const drag = this.drags.get(event.pointerId);
    if (!drag || this.mode !== "walk") return;
    const dx = event.clientX - drag.x,
      dy = event.clientY - drag.y;
    this.drags.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.drags.size > 1) {
      this.walk(-0.02 * dy, 0.02 * dx);
    } else {
      this.yaw += 0.004 * dx;
      this.pitch = Math.min(1.4, Math.max(-1.4, this.pitch + 0.004 * dy));
    }
    this.turn();
  }

  private walk(ahead: number, right: number): void {
    const { camera } = this.viewer;
    camera.position.x += Math.cos(this.yaw) * ahead + Math.sin(this.yaw) * right;
    camera.position.y += Math.sin(this.yaw) * ahead - Math.cos(this.yaw) * right;
    camera.position.z += 0.2 * (this.eyeHeight(camera.position) - camera.position.z);
  }

  private key(event: KeyboardEvent, down: boolean): void {
    const name = event.key.toLowerCase();
    if (!down) this.pressed.delete(name);
    if (
      !/^(arrow(up|down|left|right)|[wasdqe]|page(up|down)|[+\-=])$/.test(name) ||
      event.ctrlKey ||
      event.metaKey ||
      event.altKey
    )
      return;
    const target = event.target as HTMLElement;
    const elsewhere =
      name.length > 1
        ? target !== document.body && target !== this.viewer.canvas
        : target.matches("input:not([type=checkbox])");
    if (!down || elsewhere) return;
    this.pressed.add(name);
    event.preventDefault();
    this.viewer.invalidate();
  }

  private step(seconds: number): boolean {
    if (!this.pressed.size) return false;
    const held = (...names: string[]) => Number(names.some((name) => this.pressed.has(name)));
    const ahead = held("w", "arrowup") - held("s", "arrowdown");
    const right = held("d", "arrowright") - held("a", "arrowleft");
    const turn = held("q", "pageup") - held("e", "pagedown");
    if (this.mode === "walk") {
      this.walk(4 * seconds * ahead, 4 * seconds * right);
      this.yaw += 1.2 * seconds * turn;
      this.turn();
      return true;
    }
    this.glide(seconds, ahead, right, turn, held("-") - held("+", "="));
    return true;
  }

  private glide(seconds: number, ahead: number, right: number, turn: number, away: number): void {
    const { camera } = this.viewer,
      { target } = this.controls;
    const offset = camera.position.clone().sub(target);
    const speed = (0.6 * seconds * offset.length() * camera.fov) / fovs.orbit;
    const heading = Math.atan2(-offset.y, -offset.x);
    const move = new Vector3(
      Math.cos(heading) * ahead + Math.sin(heading) * right,
      Math.sin(heading) * ahead - Math.cos(heading) * right,
      0,
    );
    target.addScaledVector(move, speed);
    if (this.mode === "orbit") offset.applyAxisAngle(new Vector3(0, 0, 1), turn * seconds);
    offset.multiplyScalar(1 + away * seconds);
    camera.position.copy(target).add(offset);
    this.controls.update();
    this.viewer.move();
  }
}
