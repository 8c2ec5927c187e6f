// Map in words: counts, epochs, timing.
import { element, fixed, short, table, terms } from "../dom";
import type { MapData } from "../data/format";
import type { App } from "./app";

const sources: Record<string, string> = {
  store: "base's store",
  map: "merged map",
  base: "base that receives",
  file: "file",
};

export function mapPane({ state }: App, root: HTMLElement): void {
  const render = () => {
    if (state.map) root.replaceChildren(...content(state.map, state.pointsDrawn));
  };
  state.on("map", render);
  state.on("counts", () => {
    const drawn = root.querySelector("[data-drawn]");
    if (drawn) drawn.textContent = short(state.pointsDrawn);
  });
}

function content(map: MapData, drawn: number): Node[] {
  const computing = !map.layers["static"] && map.sessions.length > 0;
  return [
    facts(map, drawn),
    computing
      ? element("p", {
          class: "note",
          text: "There is no map of this epoch yet: keyframes are shown by themselves.",
        })
      : null,
    sessions(map),
    map.pairs.length ? pairs(map) : null,
    map.online?.length ? online(map) : null,
    map.timing ? timing(map) : null,
    epochs(map),
  ].filter((part) => part !== null);
}

const count = <T>(list: T[], test: (value: T) => boolean): number => list.filter(test).length;

function facts(map: MapData, drawn: number): HTMLElement {
  const points = (map.layers["static"]?.nodes ?? []).reduce((sum, node) => sum + node[1], 0);
  const rows: [string, string][] = [
    ["source", sources[map.source] ?? map.source],
    ["epoch", String(map.epoch)],
  ];
  if (points) rows.push(["points", short(points)]);
  rows.push(
    ["points drawn", short(drawn)],
    [
      "loops",
      ["accepted", "provisional", "refused"]
        .map((name) => `${count(map.loops, (loop) => loop.state === name)} ${name}`)
        .join(", "),
    ],
  );
  rows.push(["changed objects", String(map.changes.length)]);
  if (map.georeference)
    rows.push([
      "origin",
      map.georeference.origin.map((value) => value.toFixed(0)).join(", ") + " m",
    ]);
  const list = terms(rows);
  const values = list.querySelectorAll("dd");
  values[rows.findIndex(([name]) => name === "points drawn")]?.setAttribute("data-drawn", "");
  return element("section", {}, [list]);
}

function sessions(map: MapData): HTMLElement {
  const rows = map.sessions.map((session) => [
    session.name,
    session.sensor,
    session.status,
    String(session.poses.length),
  ]);
  const reasons = map.sessions
    .filter((session) => session.reason)
    .map((session) => element("p", { class: "note", text: `${session.name}: ${session.reason}` }));
  return element("section", {}, [
    element("h2", { text: "Sessions" }),
    table(["name", "sensor", "state", "keyframes"], rows),
    ...reasons,
  ]);
}

function pairs(map: MapData): HTMLElement {
  const name = (index: number) => map.sessions[index]?.name ?? String(index);
  const rows = map.pairs.map((pair) => [
    `${name(pair.query)} – ${name(pair.match)}`,
    pair.state,
    `${pair.consistent} / ${pair.loops}`,
  ]);
  return element("section", {}, [
    element("h2", { text: "Pairs of sessions" }),
    table(["pair", "state", "consistent loops"], rows),
  ]);
}

const nameOf = (map: MapData, session: number): string =>
  map.sessions[session]?.name ?? String(session);

function online(map: MapData): HTMLElement {
  const rows = map.online!.map((time) => [
    nameOf(map, time.session),
    fixed(time.p50_ms, 1),
    fixed(time.p99_ms, 1),
    fixed(time.max_ms, 1),
  ]);
  const loads = map.online!.map((time) =>
    element("p", { class: "note", text: `${nameOf(map, time.session)}: ${time.load}` }),
  );
  return element("section", {}, [
    element("h2", { text: "Time per keyframe on the robot, ms" }),
    table(["session", "p50", "p99", "max"], rows),
    ...loads,
  ]);
}

function timing(map: MapData): HTMLElement {
  const { load, stages } = map.timing!;
  return element("section", {}, [
    element("h2", { text: "Time at the base, s" }),
    table(
      ["stage", "seconds"],
      stages.map(({ stage, seconds }) => [stage, fixed(seconds, 2)]),
    ),
    element("p", { class: "note", text: load }),
  ]);
}

function epochs(map: MapData): HTMLElement | null {
  if (!map.epochs.length) return null;
  const items = [...map.epochs]
    .reverse()
    .slice(0, 30)
    .map((epoch) =>
      element("li", { class: epoch.number === map.epoch ? "now" : "" }, [
        element("b", { text: String(epoch.number) }),
        element("span", { text: `${epoch.command}: ${epoch.outcome}` }),
        element("time", {
          text: new Date(1000 * epoch.made_s).toISOString().slice(0, 16).replace("T", " "),
        }),
      ]),
    );
  return element("section", {}, [
    element("h2", { text: "Epochs" }),
    element("ol", { class: "epochs" }, items),
  ]);
}
