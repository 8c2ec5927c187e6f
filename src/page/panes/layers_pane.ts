// Settings of the view: colours, sessions, layers.
import { choice, checkbox, element } from "../dom";
import type { MapData } from "../data/format";
import { changeColour, errorColour, removalColour, removalKinds, sessionColour } from "../palette";
import type { ColourMode, Placement, Settings, State } from "../state";
import type { App } from "./app";

export function layersPane({ state, scene }: App, root: HTMLElement): void {
  const controls = () => [...root.querySelectorAll<HTMLElement>("input, button")];
  // Keys change settings too. Focus stays where it was; a slider is not taken from under a finger.
  const render = () => {
    const focused = controls().indexOf(document.activeElement as HTMLElement);
    if (!state.map || document.activeElement?.matches("#pane-layers input[type=range]")) return;
    root.replaceChildren(
      colours(state, state.map),
      sessions(state, state.map),
      removed(state, state.map),
      changes(state, state.map),
      paths(state, state.map),
      errors(state, state.map),
      drawing(state, scene !== null),
    );
    controls()[focused]?.focus({ preventScroll: true });
  };
  for (const topic of ["map", "settings"] as const) state.on(topic, render);
}

type Flag = { [K in keyof Settings]: Settings[K] extends boolean ? K : never }[keyof Settings];
const flag = (state: State, name: Flag, text: string, colour?: string): HTMLElement =>
  checkbox(text, state.settings[name], (on) => state.set(name, on), colour);

const part = (title: string, children: (Node | null)[]): HTMLElement =>
  element("section", {}, [element("h2", { text: title }), ...children]);

function colours(state: State, map: MapData): HTMLElement {
  const modes: [ColourMode, string][] = [
    ["session", "session"],
    ["height", "height"],
    ["visits", "visits"],
    ["epoch", "epoch"],
  ];
  if (map.layers["static"]?.intensity) modes.push(["intensity", "intensity"]);
  return part("Colour by", [
    choice("Colour by", modes, state.settings.colour, (mode) => state.set("colour", mode)),
  ]);
}

export function toggleSession(state: State, index: number, on: boolean): void {
  const hidden = new Set(state.settings.hiddenSessions);
  if (on) hidden.delete(index);
  else hidden.add(index);
  state.set("hiddenSessions", hidden);
}

function sessions(state: State, map: MapData): HTMLElement {
  const apart = map.sessions.some((_, index) => !state.inMap(index));
  const placements: [Placement, string][] = [
    ["provisional", "in place"],
    ["beside", "beside"],
    ["hidden", "hidden"],
  ];
  return part("Sessions", [
    ...map.sessions.map((session, index) =>
      checkbox(
        session.name,
        !state.settings.hiddenSessions.has(index),
        (on) => toggleSession(state, index, on),
        sessionColour(index, state.settings.theme),
        session.status === "merged" ? session.sensor : session.status,
      ),
    ),
    apart ? element("h3", { text: "Sessions outside the map" }) : null,
    apart
      ? choice("Sessions outside the map", placements, state.settings.placement, (value) =>
          state.set("placement", value),
        )
      : null,
  ]);
}

function removed(state: State, map: MapData): HTMLElement {
  const { settings } = state;
  const kinds = removalKinds.map(({ category, name }) =>
    checkbox(
      name,
      settings.removedKinds[category]!,
      (on) => {
        const changed = [...settings.removedKinds];
        changed[category] = on;
        state.set("removedKinds", changed);
      },
      removalColour[category],
    ),
  );
  const none = map.layers["static"] && !map.layers["removed"];
  return part("Removed points", [
    none ? element("p", { class: "note", text: "This map has no layer of removed points." }) : null,
    flag(state, "removed", "show removed points"),
    element("div", { class: "nested" }, kinds),
    element("p", {
      class: "note",
      text: "Robots send the labels that they decide online. Their final labels stay on the robot.",
    }),
    flag(state, "faded", "faded"),
    checkbox("before and after, with a divider", settings.divider !== null, (on) =>
      state.set("divider", on ? 0.5 : null),
    ),
  ]);
}

function changes(state: State, map: MapData): HTMLElement {
  const kinds = Object.entries(changeColour).map(([kind, colour]) =>
    checkbox(
      kind,
      state.settings.changeKinds[kind as keyof Settings["changeKinds"]],
      (on) => state.set("changeKinds", { ...state.settings.changeKinds, [kind]: on }),
      colour,
    ),
  );
  return part("Changed objects", [
    flag(state, "boxes", "boxes"),
    map.layers["changes"] ? flag(state, "changePoints", "points") : null,
    element("div", { class: "nested" }, kinds),
  ]);
}

function errors(state: State, map: MapData): HTMLElement | string {
  const rows = [
    map.evaluation?.ate_m ? flag(state, "pathError", "position error along the path") : null,
    map.layers["false_static"]
      ? flag(state, "falseStatic", "false static points", errorColour["false_static"])
      : null,
    map.layers["false_dynamic"]
      ? flag(state, "falseDynamic", "false dynamic points", errorColour["false_dynamic"])
      : null,
  ];
  return rows.some((row) => row !== null) ? part("Evaluation", rows) : "";
}

function paths(state: State, map: MapData): HTMLElement {
  return part("Paths and loops", [
    flag(state, "trajectories", "trajectories"),
    map.sessions.some((session) => session.sigma_m)
      ? flag(state, "uncertainty", "uncertainty (two standard deviations)")
      : null,
    flag(state, "loops", "loops"),
    flag(state, "robots", "robots"),
  ]);
}

function drawing(state: State, scene: boolean): HTMLElement | string {
  if (!scene) return "";
  return part("Drawing", [
    flag(state, "staticShown", "static map"),
    flag(state, "shading", "shading by depth"),
    element("label", { class: "range" }, [
      element("span", { text: "point size" }),
      element("input", {
        type: "range",
        min: "0.5",
        max: "2.5",
        step: "0.1",
        value: String(state.settings.pointSize),
        input: (value) => state.set("pointSize", Number(value)),
      }),
    ]),
  ]);
}
