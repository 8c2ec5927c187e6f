// Types of the map's JSON, and the check of what arrives.

/** x, y, z, qx, qy, qz, qw: keyframe frame to map frame. */
export type Pose = number[];

export interface Epoch {
  number: number;
  parent: number;
  made_s: number;
  command: string;
  outcome: string;
}
export interface Session {
  name: string;
  robot: number;
  sensor: string;
  status: "central" | "merged" | "provisional" | "unconnected";
  reason: string;
  provisional_pose: Pose | null;
  sequences: number[];
  stamps_s: number[];
  poses: Pose[];
  /** Keyframes of which only the summary has arrived: without points. */
  summaries: number[];
  sigma_m?: number[];
  /** Epoch that changed the session's poses last. */
  epoch?: number;
}
export type LoopState = "accepted" | "provisional" | "refused";
export type LoopStatement = "right" | "wrong" | "not yet";
export interface Loop {
  query: [number, number];
  match: [number, number];
  state: LoopState;
  reason: string;
  overlap: number | null;
  confidence: number | null;
  T_match_query: Pose | null;
  residual_m: number | null;
  residual_deg: number | null;
  weak_axes: number;
  by_person: boolean;
  statement: "right" | "wrong" | null;
}
export interface Pair {
  match: number;
  query: number;
  state: string;
  reason: string;
  loops: number;
  consistent: number;
}
export interface Box {
  centre: number[];
  size: number[];
  heading: number;
}
export type ChangeKind = "appeared" | "gone" | "moved";
export interface Change {
  kind: ChangeKind;
  session: number;
  free_in: number;
  box: Box;
  before: Box | null;
  confidence: number;
}
export type NodeRow = [string, number, number, number[]];
export interface Layer {
  origin: number[];
  size_m: number;
  nodes: NodeRow[];
  /** Points of it have intensities. */
  intensity?: boolean;
}
export interface Timing {
  load: string;
  stages: { stage: string; seconds: number }[];
}
export interface OnlineTime {
  session: number;
  p50_ms: number;
  p99_ms: number;
  max_ms: number;
  load: string;
}
export interface EvaluatedSession {
  session: number;
  ATE_rmse_m?: number | null;
  ATE_max_m?: number | null;
  SA_percent?: number | null;
  DA_percent?: number | null;
  AA_percent?: number | null;
  false_static_points?: number;
  false_dynamic_points?: number;
}
export interface Evaluation {
  ate_m?: (number | null)[][];
  summary?: Record<string, unknown>;
  sessions?: EvaluatedSession[];
  precision_recall?: number[][];
  notes?: string[];
  points_left_out?: number;
}
export interface MapData {
  format: 1;
  title: string;
  source: string;
  epoch: number;
  epochs: Epoch[];
  can_change: boolean;
  /** What is said where there is nothing to see. */
  notice: string | null;
  georeference: { origin: number[]; horizontal: boolean } | null;
  sessions: Session[];
  loops: Loop[];
  pairs: Pair[];
  changes: Change[];
  layers: Record<string, Layer>;
  timing: Timing | null;
  online: OnlineTime[] | null;
  evaluation: Evaluation | null;
}

/** As long as the time is, null where a message lacked the figure; or empty. */
export type Figures = (number | null)[];
export interface RobotHealth {
  session: number;
  name: string;
  /** Unix time. */
  time_s: number[];
  stage_ms?: Record<string, Figures>;
  deadline_misses?: Figures;
  fill?: Record<string, Figures>;
  dropped?: Record<string, Figures>;
  spool_bytes?: Figures;
  acknowledged?: Figures;
  missing?: Figures;
  clock_offset_ms?: Figures;
  latency_ms?: Figures;
}
export interface KeyframeEvent {
  session: number;
  name: string;
  keyframe: number;
  sequence: number;
  stamp_s: number;
  pose: Pose;
}
export interface RobotAlarm {
  /** Null while the map does not show it. */
  session: number | null;
  name: string;
  kind: string;
  text: string;
  since_s: number;
  state?: "raised" | "over";
}
export interface RobotEvent {
  session: number;
  name: string;
  pose: Pose | null;
  state: string;
  latency_ms: number | null;
}

/** "SESSION:NUMBER" of a keyframe: what it is called however the map grows. */
export function keyframeName(map: MapData, [session, keyframe]: [number, number]): string {
  const of = map.sessions[session];
  return `${of?.name ?? session}:${of?.sequences[keyframe] ?? keyframe}`;
}

/** Its two keyframes name a loop: its index, and which of them is the query, differ between merges. */
export const loopName = (map: MapData, loop: Loop): string =>
  [loop.query, loop.match].map((end) => keyframeName(map, end)).sort().join(" ");

export const isPose = (value: unknown): value is Pose =>
  Array.isArray(value) && value.length === 7 && value.every(Number.isFinite);

const list = <T>(value: unknown): T[] => (Array.isArray(value) ? value : []);

/** Loops name keyframes by their index: none may be left out. */
function checkedSession(raw: Partial<Session>, index: number): Session {
  const poses = list<Pose>(raw.poses);
  const wrong = poses.findIndex((pose) => !isPose(pose));
  if (wrong >= 0) throw new Error(`keyframe ${wrong} of session ${index} has no pose`);
  return {
    name: String(raw.name ?? `session ${index}`),
    robot: Number(raw.robot ?? 0),
    sensor: String(raw.sensor ?? ""),
    status: raw.status ?? "unconnected",
    reason: String(raw.reason ?? ""),
    provisional_pose: raw.provisional_pose ?? null,
    sequences: list(raw.sequences),
    stamps_s: list(raw.stamps_s),
    poses,
    summaries: list(raw.summaries),
    ...(raw.sigma_m ? { sigma_m: list<number>(raw.sigma_m) } : {}),
    ...(typeof raw.epoch === "number" ? { epoch: raw.epoch } : {}),
  };
}

const isEnd = (value: unknown): boolean =>
  Array.isArray(value) && value.length === 2 && value.every(Number.isInteger);
const isBox = (box: Box | null | undefined): boolean =>
  Array.isArray(box?.centre) &&
  box.centre.length === 3 &&
  Array.isArray(box.size) &&
  box.size.length === 3;

/** Loops are counted by the server: none may be left out. */
function checkedLoops(loops: Loop[]): Loop[] {
  const wrong = loops.findIndex((loop) => !isEnd(loop?.query) || !isEnd(loop?.match));
  if (wrong >= 0) throw new Error(`loop ${wrong} does not name its two keyframes`);
  return loops;
}

/** The map with absent parts empty; throws in words where it is none. */
export function checkedMap(value: unknown): MapData {
  const raw = value as Partial<MapData> | null;
  if (!raw || typeof raw !== "object") throw new Error("the map's description is no JSON object");
  if (raw.format !== 1)
    throw new Error(`the map has format ${String(raw.format)}; this page reads format 1`);
  const layers: Record<string, Layer> = {};
  for (const [name, layer] of Object.entries(raw.layers ?? {}))
    if (layer && list(layer.nodes).length) layers[name] = layer;
  return {
    format: 1,
    title: String(raw.title ?? "map"),
    source: String(raw.source ?? ""),
    epoch: Number(raw.epoch ?? 0),
    epochs: list(raw.epochs),
    can_change: raw.can_change === true,
    notice: typeof raw.notice === "string" ? raw.notice : null,
    georeference: raw.georeference ?? null,
    sessions: list<Partial<Session>>(raw.sessions).map(checkedSession),
    loops: checkedLoops(list(raw.loops)),
    pairs: list(raw.pairs),
    changes: list<Change>(raw.changes).filter((change) => isBox(change?.box)),
    layers,
    timing: raw.timing ?? null,
    online: raw.online ?? null,
    evaluation: raw.evaluation ?? null,
  };
}
