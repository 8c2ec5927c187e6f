// History of a robot's health: what the server keeps, and what this page saw in between.
import type { Figures, RobotHealth } from "./format";

/** Six hours of one row every five seconds. */
const mostRows = 4320;

const singles = [
  "deadline_misses",
  "spool_bytes",
  "acknowledged",
  "missing",
  "clock_offset_ms",
  "latency_ms",
] as const;
const groups = ["stage_ms", "fill", "dropped"] as const;

/** Rows of both in the order of time. The server keeps one a minute and replaces the latest. */
export function joined(before: RobotHealth | undefined, now: RobotHealth): RobotHealth {
  if (!before) return now;
  const known = new Set(now.time_s);
  const rows = [before, now]
    .flatMap((of) => of.time_s.map((time, index) => ({ time, index, of })))
    .filter(({ time, of }) => of === now || !known.has(time))
    .sort((a, b) => a.time - b.time)
    .slice(-mostRows);
  const column = (figures: (of: RobotHealth) => Figures | undefined): Figures =>
    rows.map(({ index, of }) => figures(of)?.[index] ?? null);
  const result: RobotHealth = { ...now, time_s: rows.map(({ time }) => time) };
  for (const name of singles) result[name] = column((of) => of[name]);
  for (const group of groups) {
    const names = Object.keys({ ...before[group], ...now[group] });
    result[group] = Object.fromEntries(
      names.map((name) => [name, column((of) => of[group]?.[name])]),
    );
  }
  return result;
}
