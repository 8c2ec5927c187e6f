// Distances on the screen, for what is picked by a press.
import type { Vector3 } from "three";
import type { Viewer } from "./viewer";

/** Pixels from a position of the canvas to a segment of the scene. */
export function pixelsToSegment(
  viewer: Viewer,
  x: number,
  y: number,
  from: Vector3,
  to: Vector3,
): number {
  const a = viewer.project(from);
  const b = viewer.project(to);
  if (!a || !b) return Infinity;
  const dx = b.x - a.x;
  const dy = b.y - a.y;
  const length = dx * dx + dy * dy;
  const part = length ? Math.min(1, Math.max(0, ((x - a.x) * dx + (y - a.y) * dy) / length)) : 0;
  return Math.hypot(x - a.x - part * dx, y - a.y - part * dy);
}
