// Places of sessions that are not part of the map: beside it, or at their provisional pose.
import { Box3, Matrix4, Vector3 } from "three";
import type { Session } from "../data/format";
import type { State } from "../state";
import { matrixOf } from "./poses";

const gap_m = 15;

export function boundsOf(session: Session): Box3 {
  const box = new Box3();
  for (const pose of session.poses) box.expandByPoint(new Vector3(pose[0], pose[1], pose[2]));
  return box;
}

/** Frames of all sessions in the map frame; null where a session is not to be shown. */
export function sessionFrames(state: State, mapBounds: Box3): (Matrix4 | null)[] {
  let east = mapBounds.isEmpty() ? 0 : mapBounds.max.x + gap_m;
  return state.map!.sessions.map((session, index) => {
    if (state.inMap(index) || !session.poses.length) return new Matrix4();
    const { placement } = state.settings;
    if (placement === "hidden") return null;
    if (placement === "provisional" && session.provisional_pose)
      return matrixOf(session.provisional_pose);
    const own = boundsOf(session).expandByScalar(gap_m);
    const base = mapBounds.isEmpty() ? own.min : mapBounds.min;
    const frame = new Matrix4().makeTranslation(east - own.min.x, base.y + gap_m - own.min.y, 0);
    east += own.max.x - own.min.x;
    return frame;
  });
}
