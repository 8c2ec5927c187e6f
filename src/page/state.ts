// State of the page: the map, settings, and who is told of changes.
import {
  loopName,
  type ChangeKind,
  type LoopState,
  type MapData,
  type RobotAlarm,
  type RobotEvent,
  type RobotHealth,
} from "./data/format";
import type { Theme } from "./palette";

export type ColourMode = "session" | "height" | "visits" | "epoch" | "intensity";
export type Placement = "beside" | "provisional" | "hidden";

export interface Settings {
  theme: Theme;
  colour: ColourMode;
  pointSize: number;
  shading: boolean;
  hiddenSessions: Set<number>;
  /** Removed points: all at once, and by category of the point (docs/api.md). */
  removed: boolean;
  removedKinds: boolean[];
  faded: boolean;
  /** Before and after: share of the width, from the left, that shows removed points; null is off. */
  divider: number | null;
  staticShown: boolean;
  changePoints: boolean;
  falseStatic: boolean;
  falseDynamic: boolean;
  trajectories: boolean;
  uncertainty: boolean;
  pathError: boolean;
  loops: boolean;
  loopStates: Record<LoopState, boolean>;
  boxes: boolean;
  changeKinds: Record<ChangeKind, boolean>;
  robots: boolean;
  placement: Placement;
  /** Seconds since the start of each session; null is the whole drive. */
  driveTime_s: number | null;
}

export type Topic =
  | "map"
  | "settings"
  | "selection"
  | "robots"
  | "health"
  | "connection"
  | "alarms"
  | "counts";
export interface Alarm {
  level: string;
  text: string;
  time: Date;
  count: number;
  /** Of a robot's, by which the server ends it. */
  key?: string;
}

const defaults = (theme: Theme): Settings => ({
  theme,
  colour: "session",
  pointSize: 1,
  shading: true,
  hiddenSessions: new Set(),
  removed: false,
  removedKinds: [true, true, true, true],
  faded: false,
  divider: null,
  staticShown: true,
  changePoints: false,
  falseStatic: false,
  falseDynamic: false,
  trajectories: true,
  uncertainty: false,
  pathError: false,
  loops: true,
  loopStates: { accepted: true, provisional: true, refused: true },
  boxes: true,
  changeKinds: { appeared: true, gone: true, moved: true },
  robots: true,
  placement: "provisional",
  driveTime_s: null,
});

const keyOf = (event: RobotAlarm): string => `${event.name}: ${event.kind}`;

const alarmOf = (event: RobotAlarm): Alarm => ({
  level: "warning",
  text: `${event.name}: ${event.text}`,
  time: new Date(1000 * Number(event.since_s)),
  count: 1,
  key: keyOf(event),
});

export class State {
  map: MapData | null = null;
  settings: Settings;
  selectedLoop: number | null = null;
  robots = new Map<number, RobotEvent>();
  health = new Map<number, RobotHealth>();
  connected: boolean | null = null;
  alarms: Alarm[] = [];
  pointsDrawn = 0;
  private readonly told = new Map<Topic, (() => void)[]>();

  constructor(theme: Theme) {
    this.settings = defaults(theme);
  }

  on(topic: Topic, call: () => void): void {
    this.told.set(topic, [...(this.told.get(topic) ?? []), call]);
  }

  emit(topic: Topic): void {
    for (const call of this.told.get(topic) ?? []) call();
  }

  set<K extends keyof Settings>(name: K, value: Settings[K]): void {
    this.settings[name] = value;
    this.emit("settings");
  }

  /** Another map: the loop that is looked at may have another index there, or be gone. */
  show(map: MapData): void {
    const looked = this.map?.loops[this.selectedLoop ?? -1];
    if (looked) {
      const name = loopName(this.map!, looked);
      const index = map.loops.findIndex((loop) => loopName(map, loop) === name);
      this.selectedLoop = index < 0 ? null : index;
    }
    this.map = map;
  }

  select(loop: number | null): void {
    this.selectedLoop = loop;
    this.emit("selection");
  }

  alarm(level: string, text: string): void {
    const same = this.alarms.find((alarm) => alarm.text === text);
    if (same) {
      same.count += 1;
      same.time = new Date();
    } else {
      this.alarms = [{ level, text, time: new Date(), count: 1 }, ...this.alarms].slice(0, 50);
    }
    this.emit("alarms");
  }

  /** An alarm of the server, which says when it is over. */
  robotAlarm(event: RobotAlarm): void {
    const key = keyOf(event);
    const others = this.alarms.filter((alarm) => alarm.key !== key);
    this.alarms = event.state === "over" ? others : [alarmOf(event), ...others].slice(0, 50);
    this.emit("alarms");
  }

  /** All that the server has now. */
  robotAlarms(events: RobotAlarm[]): void {
    const own = this.alarms.filter((alarm) => alarm.key === undefined);
    this.alarms = [...events.map(alarmOf), ...own].slice(0, 50);
    this.emit("alarms");
  }

  /** Whether the map itself, not only words about it, holds this session. */
  inMap(session: number): boolean {
    const status = this.map?.sessions[session]?.status;
    return status === "central" || status === "merged";
  }

  /** Whether a keyframe lies before the time that the time bar shows. */
  driven(session: number, keyframe: number): boolean {
    const limit = this.settings.driveTime_s;
    if (limit === null) return true;
    const stamps = this.map?.sessions[session]?.stamps_s ?? [];
    return (stamps[keyframe] ?? 0) - (stamps[0] ?? 0) <= limit;
  }
}
