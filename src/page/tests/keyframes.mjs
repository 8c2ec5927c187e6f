// Keyframes of the generated town: poses between them, points of each.
import { block } from "./octree_builder.mjs";

/** Pose algebra on [x, y, z, qx, qy, qz, qw] with rotation about z only, which suffices for the town. */
const yawOf = (pose) => 2 * Math.atan2(pose[5], pose[6]);
export function relative(from, to) {
  const yaw = yawOf(from),
    dx = to[0] - from[0],
    dy = to[1] - from[1],
    turn = yawOf(to) - yaw;
  return [
    Math.cos(yaw) * dx + Math.sin(yaw) * dy,
    -Math.sin(yaw) * dx + Math.cos(yaw) * dy,
    to[2] - from[2],
    0,
    0,
    Math.sin(turn / 2),
    Math.cos(turn / 2),
  ];
}

const reach_m = 28,
  ofKeyframe = 16_000;

/** Points of a keyframe in its own frame: what of the town is near. */
export function keyframeBlock({ cloud, removed }, pose) {
  const near = [];
  const collect = (points, kindOf) => {
    for (let i = 0; i < points.session.length; ++i) {
      const x = points.xyz[3 * i] - pose[0],
        y = points.xyz[3 * i + 1] - pose[1];
      if (x * x + y * y < reach_m * reach_m)
        near.push([points.xyz[3 * i], points.xyz[3 * i + 1], points.xyz[3 * i + 2], kindOf(i)]);
    }
  };
  collect(cloud, () => 0);
  collect(removed, (i) => removed.kind[i]);
  const every = Math.max(1, near.length / ofKeyframe),
    count = Math.floor(near.length / every);
  const own = {
    xyz: new Float32Array(3 * count),
    session: new Uint8Array(count),
    kind: new Uint8Array(count),
  };
  const yaw = yawOf(pose);
  for (let row = 0; row < count; ++row) {
    const [px, py, pz, kind] = near[Math.floor(row * every)];
    const x = px - pose[0],
      y = py - pose[1];
    own.xyz.set(
      [Math.cos(yaw) * x + Math.sin(yaw) * y, -Math.sin(yaw) * x + Math.cos(yaw) * y, pz - pose[2]],
      3 * row,
    );
    own.kind[row] = kind;
  }
  return block(
    own,
    Uint32Array.from({ length: count }, (_, i) => i),
  ).buffer;
}
