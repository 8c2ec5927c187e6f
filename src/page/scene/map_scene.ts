// Scene of the map, kept as the state says.
import { Box3, Vector3, type Matrix4 } from "three";
import type { KeyframeEvent } from "../data/format";
import type { Source } from "../data/source";
import { background } from "../palette";
import type { Placement, State } from "../state";
import { CameraControl } from "./camera_control";
import { colourKinds, colourSessions } from "./colours";
import { ChangeLayer } from "./change_layer";
import {
  heightRange,
  heightRangeOfPaths,
  mapExtent,
  pathExtent,
  sensorHeight,
  wholeExtent,
} from "./extent";
import { KeyframeLayer } from "./keyframe_layer";
import { Labels } from "./labels";
import { LoopLayer } from "./loop_layer";
import { Measure, pickedPoint } from "./measure";
import type { View } from "./octree";
import { boundsOf, sessionFrames } from "./placement";
import { PointUniforms } from "./point_material";
import { RobotLayer } from "./robot_layer";
import { Section } from "./section";
import { TileLayers } from "./tile_layers";
import { TrajectoryLayer } from "./trajectory_layer";
import { Viewer } from "./viewer";

export class MapScene {
  readonly uniforms = new PointUniforms();
  readonly viewer: Viewer;
  readonly tiles: TileLayers;
  readonly keyframes: KeyframeLayer;
  readonly trajectories: TrajectoryLayer;
  readonly loops: LoopLayer;
  readonly changes: ChangeLayer;
  readonly robots: RobotLayer;
  readonly labels: Labels;
  readonly measure: Measure;
  readonly section: Section;
  readonly control: CameraControl;
  heights: [number, number] = [0, 10];
  private heightsOf: object | null = null;
  private fitted = false;
  private applied = "";
  private placement: Placement = "provisional";
  private readonly firstView: (() => void)[] = [];

  constructor(
    canvas: HTMLCanvasElement,
    labelParent: HTMLElement,
    source: Source,
    private readonly state: State,
    renderer: string,
  ) {
    this.viewer = new Viewer(canvas, renderer, (view) => this.select(view));
    const changed = () => this.viewer.invalidate();
    this.labels = new Labels(this.viewer, labelParent);
    this.tiles = new TileLayers(source, state, this.uniforms, changed);
    this.trajectories = new TrajectoryLayer(state);
    this.keyframes = new KeyframeLayer(
      source,
      state,
      this.uniforms,
      this.trajectories,
      () => this.viewer.budget.atRest,
      changed,
    );
    this.loops = new LoopLayer(state, this.trajectories);
    this.changes = new ChangeLayer(state);
    this.robots = new RobotLayer(state, this.labels, this.trajectories);
    this.measure = new Measure(this.labels, this.viewer);
    this.section = new Section(this.uniforms, () => this.bounds());
    this.control = new CameraControl(this.viewer);
    this.control.eyeHeight = (place) => sensorHeight(state, place);
    this.viewer.points.add(this.tiles.group, this.keyframes.group);
    this.viewer.overlay.add(
      this.trajectories.group,
      this.loops.group,
      this.changes.group,
      this.robots.group,
      this.measure.group,
      this.section.group,
    );
    this.viewer.parts.push((seconds) => this.step(seconds));
    canvas.addEventListener("webglcontextlost", () =>
      state.alarm(
        "warning",
        "the browser took the graphics card away; it draws again when it gives it back",
      ),
    );
  }

  whenDrawn(): Promise<void> {
    return new Promise((resolve) => this.firstView.push(resolve));
  }

  bounds(): Box3 {
    return mapExtent(this.state, this.tiles.bounds);
  }

  showMap(): void {
    this.tiles.show(this.state.map!);
    this.trajectories.show();
    this.keyframes.show();
    this.applySettings();
    if (!this.fitted) this.fit();
    this.fitted = this.fitted || !this.bounds().isEmpty();
  }

  /** The whole map, with the sessions beside it, in view. */
  fit(): void {
    this.control.fit(wholeExtent(this.state, this.bounds(), this.trajectories.frames));
  }

  arrived(event: KeyframeEvent): void {
    this.trajectories.arrived(event);
    this.keyframes.arrived(event);
  }

  /** The divider moves with the pointer: nothing is built anew for it. */
  settingsChanged(): void {
    const { divider, hiddenSessions, ...others } = this.state.settings;
    const now = JSON.stringify([divider !== null, [...hiddenSessions], others]);
    if (now === this.applied) this.viewer.invalidate();
    else this.applySettings();
    this.applied = now;
  }

  applySettings(): void {
    const { settings, map } = this.state;
    if (!map) return;
    this.viewer.setBackground(background[settings.theme]);
    this.viewer.shading = settings.shading ? 5 : 0;
    colourSessions(this.uniforms, this.state);
    colourKinds(
      this.tiles.materials,
      [this.keyframes.material, this.keyframes.fadedMaterial],
      settings,
    );
    this.trajectories.frames = this.placeSessions();
    this.keyframes.choose();
    this.redraw();
    this.section.apply();
    if (this.placement === settings.placement) return;
    this.placement = settings.placement;
    if (this.fitted) this.fit();
  }

  private placeSessions(): (Matrix4 | null)[] {
    const { map, settings } = this.state;
    const inMap = pathExtent(this.state).isEmpty() ? new Box3() : this.bounds();
    const frames = sessionFrames(this.state, inMap);
    this.labels.remove("session/");
    map!.sessions.forEach((session, index) => {
      const frame = frames[index];
      const shown = frame && session.poses.length && !settings.hiddenSessions.has(index);
      if (!shown || this.state.inMap(index)) return;
      const box = boundsOf(session);
      const place = box.getCenter(new Vector3()).setZ(box.max.z + 4);
      const text = `${session.name} · ${session.status}`;
      this.labels.set(`session/${index}`, text, place.applyMatrix4(frame), "session");
    });
    return frames;
  }

  /** Lines and boxes follow poses and settings. */
  redraw(): void {
    this.trajectories.rebuild();
    this.loops.rebuild();
    this.changes.rebuild();
    this.redrawRobots();
    this.viewer.invalidate();
  }

  redrawRobots(): void {
    const { camera } = this.viewer;
    const away = (camera.position.distanceTo(this.control.controls.target) * camera.fov) / 55;
    this.robots.rebuild(Math.min(6, Math.max(1, away / 40)));
    this.viewer.invalidate();
  }

  private step(seconds: number): boolean {
    if (!this.trajectories.step(seconds)) return false;
    this.keyframes.follow();
    this.loops.rebuild();
    return true;
  }

  private select(view: View): void {
    const { shared } = this.uniforms;
    const { ratio } = this.viewer;
    shared.pixelsPerUnit.value = view.pixelsPerUnit;
    shared.sizeFactor.value = 1.45 * this.state.settings.pointSize;
    shared.smallest.value = 1.4 * ratio * this.state.settings.pointSize;
    shared.largest.value = 14 * ratio;
    const { divider } = this.state.settings;
    this.tiles.materials.removed.set(
      "divider",
      divider === null ? 1e9 : divider * this.viewer.width * ratio,
    );
    const onlyKeyframes = !this.tiles.bounds || this.state.settings.driveTime_s !== null;
    this.keyframes.thin(view.budget * (onlyKeyframes ? 0.85 : 0.5));
    this.tiles.update({ ...view, budget: view.budget - this.keyframes.pointsDrawn });
    this.measureHeights();
    this.tellFirstView();
    const drawn = this.tiles.pointsDrawn + this.keyframes.pointsDrawn;
    if (drawn === this.state.pointsDrawn) return;
    this.state.pointsDrawn = drawn;
    this.state.emit("counts");
  }

  /** Keyframes beside the map wait until its coarse whole is drawn. */
  private tellFirstView(): void {
    if (!this.state.map || !this.firstView.length || !this.tiles.firstViewDone) return;
    for (const resolve of this.firstView.splice(0)) resolve();
    this.keyframes.release();
  }

  /** Range of the colour by height, once for each map. */
  private measureHeights(): void {
    const root = this.tiles.rootBlock;
    const source = root ?? this.state.map;
    if (!source || this.heightsOf === source) return;
    this.heightsOf = source;
    this.heights = root ? heightRange(root) : heightRangeOfPaths(pathExtent(this.state));
    this.uniforms.shared.heights.value.set(...this.heights);
    this.state.emit("counts");
  }

  focusLoop(index: number): void {
    const ends = this.loops.ends(this.state.map!.loops[index]!);
    if (ends)
      this.control.focus(
        ends[0].clone().add(ends[1]).multiplyScalar(0.5),
        Math.max(35, 1.5 * ends[0].distanceTo(ends[1])),
      );
  }

  pointAt(x: number, y: number): Vector3 | null {
    const blocks = [...this.tiles.visibleNodes, ...this.keyframes.visibleBlocks];
    return pickedPoint(this.viewer, blocks, x, y);
  }
}
