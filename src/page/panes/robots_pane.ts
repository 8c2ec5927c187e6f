// Robots: alarms, places, health over time.
import { element, fixed } from "../dom";
import type { Figures, RobotHealth } from "../data/format";
import { sessionColour } from "../palette";
import type { App } from "./app";
import { chart, type Series } from "./charts";

/** Redrawn at most twice a second: events of health come at their own rate. */
const pause_ms = 500;

export function robotsPane(app: App, root: HTMLElement): void {
  const { state } = app;
  let waiting = false;
  const render = () => {
    waiting = false;
    root.replaceChildren(alarms(app), ...robots(app));
  };
  const later = () => {
    if (waiting) return;
    waiting = true;
    setTimeout(render, pause_ms);
  };
  state.on("alarms", render);
  state.on("map", later);
  state.on("health", later);
  state.on("robots", later);
  render();
}

function alarms({ state }: App): HTMLElement {
  const items = state.alarms.map((alarm) =>
    element("li", { class: alarm.level }, [
      element("b", { text: alarm.level }),
      element("span", {
        text: alarm.count > 1 ? `${alarm.text} (${alarm.count} times)` : alarm.text,
      }),
      element("time", { text: alarm.time.toTimeString().slice(0, 8) }),
    ]),
  );
  return element("section", {}, [
    element("h2", { text: "Alarms" }),
    items.length
      ? element("ul", { class: "alarms" }, items)
      : element("p", { class: "note", text: "None." }),
  ]);
}

function robots(app: App): HTMLElement[] {
  const { state, source } = app;
  const known = new Set([...state.robots.keys(), ...state.health.keys()]);
  if (!known.size)
    return [
      element("section", {}, [
        element("p", {
          class: "note",
          text: source.live ? "No robot is connected." : "A file has no robots.",
        }),
      ]),
    ];
  return [...known]
    .sort((a, b) => a - b)
    .map((session) => {
      const robot = state.robots.get(session),
        health = state.health.get(session);
      const facts = [robot?.state, Number.isFinite(robot?.latency_ms) ? `link ${fixed(robot!.latency_ms!, 1, " ms")}` : null]
        .filter(Boolean)
        .join(" · ");
      return element("section", { class: "robot" }, [
        element("h2", {}, [
          element("span", {
            class: "swatch",
            colour: sessionColour(session, state.settings.theme),
          }),
          robot?.name ?? health?.name ?? String(session),
        ]),
        facts ? element("p", { class: "note", text: facts }) : null,
        ...(health ? charts(health) : []),
      ]);
    });
}

function charts(health: RobotHealth): HTMLElement[] {
  const times = health.time_s ?? [];
  const time = times.map((at) => at - times[0]!);
  const single = (name: string, y: Figures | undefined): Series[] =>
    y?.some((value) => value !== null) ? [{ name, x: time, y }] : [];
  const lines = (values: Record<string, Figures> | undefined): Series[] =>
    Object.entries(values ?? {}).flatMap(([name, y]) => single(name, y));
  const all: [string, string, Series[]][] = [
    ["Stages", "ms", lines(health.stage_ms)],
    ["Deadline misses", "", single("misses", health.deadline_misses)],
    ["Fill of containers", "", lines(health.fill)],
    ["Dropped, by cause", "", lines(health.dropped)],
    ["Latency of the link", "ms", single("latency", health.latency_ms)],
    ["Spool", "bytes", single("spool", health.spool_bytes)],
    ["Acknowledged", "keyframes", single("acknowledged", health.acknowledged)],
    ["Missing", "keyframes", single("missing", health.missing)],
    ["Clock offset", "ms", single("offset", health.clock_offset_ms)],
  ];
  return all
    .filter(([, , series]) => series.length)
    .map(([title, unit, series]) =>
      chart(title, series, unit, title.startsWith("Fill") ? { limits: { low: 0, high: 1 } } : {}),
    );
}
