// Matrices of poses, and poses between two.
import { Matrix4, Quaternion, Vector3 } from "three";
import type { Pose } from "../data/format";

const unit = new Vector3(1, 1, 1);

export function matrixOf(pose: Pose): Matrix4 {
  const [x, y, z, qx, qy, qz, qw] = pose as [
    number,
    number,
    number,
    number,
    number,
    number,
    number,
  ];
  return new Matrix4().compose(
    new Vector3(x, y, z),
    new Quaternion(qx, qy, qz, qw).normalize(),
    unit,
  );
}

export function between(from: Pose, to: Pose, part: number): Pose {
  const position = new Vector3(from[0], from[1], from[2]).lerp(
    new Vector3(to[0], to[1], to[2]),
    part,
  );
  const turn = new Quaternion(from[3], from[4], from[5], from[6]).slerp(
    new Quaternion(to[3], to[4], to[5], to[6]),
    part,
  );
  return [...position.toArray(), ...turn.toArray()];
}

export const position = (pose: Pose): Vector3 => new Vector3(pose[0], pose[1], pose[2]);

export const samePose = (a: Pose, b: Pose): boolean =>
  a.every((value, i) => Math.abs(value - b[i]!) < 1e-6);
