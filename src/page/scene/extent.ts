// Extents of the map: its paths with their surroundings, its heights.
import { Box3, type Matrix4, Vector3 } from "three";
import type { Block } from "../data/blocks";
import type { State } from "../state";
import { boundsOf } from "./placement";

/** Points around a path that belong to its surroundings. */
const surroundings_m = 20;
const belowPath_m = 3;
/** Heights without a tile to measure them in: from below the sensors to above. */
const pathHeights_m = [-2, 8] as const;
/** Part of the points at either end whose heights do not count. */
const ignoredPart = 0.02;

/** Paths of the sessions that the map holds. */
export function pathExtent(state: State): Box3 {
  const box = new Box3();
  state.map?.sessions.forEach((session, index) => {
    if (state.inMap(index)) box.union(boundsOf(session));
  });
  return box;
}

/** Paths with their surroundings, within the tiles: single far points do not count. */
export function mapExtent(state: State, tiles: Box3 | null): Box3 {
  const box = pathExtent(state);
  if (box.isEmpty()) state.map?.sessions.forEach((session) => box.union(boundsOf(session)));
  if (box.isEmpty()) return tiles ?? box;
  box.expandByVector(new Vector3(surroundings_m, surroundings_m, 0));
  box.min.z -= belowPath_m;
  box.max.z += surroundings_m;
  return tiles ? box.intersect(tiles) : box;
}

/** The map and the sessions that are shown beside it. */
export function wholeExtent(state: State, map: Box3, frames: (Matrix4 | null)[]): Box3 {
  if (state.settings.placement !== "beside") return map;
  const box = map.clone();
  state.map!.sessions.forEach((session, index) => {
    const frame = frames[index];
    if (!frame || state.inMap(index) || !session.poses.length) return;
    box.union(boundsOf(session).applyMatrix4(frame).expandByScalar(surroundings_m));
  });
  return box;
}

/** Heights of all but the lowest and highest points of a block. */
export function heightRange(block: Block): [number, number] {
  const heights: number[] = [];
  for (let i = 2; i < block.packed.length; i += 4)
    heights.push(block.origin[2] + block.step * block.packed[i]!);
  heights.sort((a, b) => a - b);
  const at = (part: number) => heights[Math.floor(part * (heights.length - 1))] ?? 0;
  return [at(ignoredPart), at(1 - ignoredPart)];
}

export function heightRangeOfPaths(extent: Box3): [number, number] {
  if (extent.isEmpty()) return [0, 10];
  return [extent.min.z + pathHeights_m[0], extent.max.z + pathHeights_m[1]];
}

/** Height of the sensor at the nearest keyframe. */
export function sensorHeight(state: State, place: Vector3): number {
  let best = place.z;
  let least = Infinity;
  state.map?.sessions.forEach((session, index) => {
    if (!state.inMap(index)) return;
    for (const pose of session.poses) {
      const distance = (pose[0]! - place.x) ** 2 + (pose[1]! - place.y) ** 2;
      if (distance < least) [best, least] = [pose[2]!, distance];
    }
  });
  return best;
}
