// Robots at their places, with the latency of their links.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Vector3,
} from "three";
import { fixed } from "../dom";
import { sessionColour } from "../palette";
import type { State } from "../state";
import type { Labels } from "./labels";
import { matrixOf } from "./poses";
import type { TrajectoryLayer } from "./trajectory_layer";

/** Arrow along x, 1.7 m long. */
const arrow = new Float32Array([
  1.1, 0, 0, -0.6, 0.6, 0, -0.25, 0, 0, 1.1, 0, 0, -0.25, 0, 0, -0.6, -0.6, 0,
]);

function arrowMesh(place: Matrix4, size: number, colour: string, order: number): Mesh {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(arrow, 3));
  const mesh = new Mesh(
    geometry,
    new MeshBasicMaterial({
      color: new Color(colour),
      side: DoubleSide,
      depthTest: false,
      transparent: true,
    }),
  );
  mesh.renderOrder = order;
  mesh.applyMatrix4(place);
  mesh.scale.setScalar(size);
  return mesh;
}

export class RobotLayer {
  readonly group = new Group();

  constructor(
    private readonly state: State,
    private readonly labels: Labels,
    private readonly trajectories: TrajectoryLayer,
  ) {}

  rebuild(size: number): void {
    for (const child of this.group.children) (child as Mesh).geometry.dispose();
    this.group.clear();
    this.labels.remove("robot/");
    if (!this.state.settings.robots) return;
    for (const [session, robot] of this.state.robots) {
      if (!robot.pose || this.state.settings.hiddenSessions.has(session)) continue;
      // One whose session is no part of the map is drawn with its keyframes; null: both are hidden.
      const frame = this.trajectories.frames[session];
      if (frame === null) continue;
      const place = (frame ?? new Matrix4()).clone().multiply(matrixOf(robot.pose));
      const known = robot.state === "localised";
      const { theme } = this.state.settings;
      this.group.add(
        arrowMesh(place, 1.5 * size, theme === "dark" ? "#ffffff" : "#000000", 5),
        arrowMesh(place, size, sessionColour(session, theme), 6),
      );
      const above = new Vector3().setFromMatrixPosition(place);
      above.z += size;
      this.labels.set(
        `robot/${session}`,
        [robot.name, fixed(robot.latency_ms, 0, " ms"), ...(known ? [] : [robot.state])].join(
          " · ",
        ),
        above,
        "robot",
      );
    }
  }
}
