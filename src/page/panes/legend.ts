// Legend of the colours in the view.
import { byId, element } from "../dom";
import {
  changeColour,
  css,
  errorColour,
  loopColour,
  rampAt,
  removalColour,
  removalKinds,
  sessionColour,
} from "../palette";
import type { App } from "./app";

export function legend(app: App): void {
  const render = () => {
    if (!app.state.map) return;
    const rows = [...points(app), ...lines(app)];
    byId("legend").replaceChildren(...rows);
    byId("legend").hidden = !rows.length;
  };
  for (const topic of ["map", "settings"] as const) app.state.on(topic, render);
  let heights = "";
  app.state.on("counts", () => {
    const now = String(app.scene?.heights);
    if (now !== heights) render();
    heights = now;
  });
}

const swatch = (text: string, colour: string, kind = ""): HTMLElement =>
  element("span", { class: `key ${kind}` }, [element("span", { class: "swatch", colour }), text]);

const named = (name: string, keys: HTMLElement[]): HTMLElement =>
  element("p", {}, [element("span", { class: "name", text: name }), ...keys]);

function ramp(title: string, low: string, high: string): HTMLElement {
  const bar = element("span", { class: "ramp" });
  const stops = [0, 0.25, 0.5, 0.75, 1].map((part) => css(rampAt(part)));
  bar.style.background = `linear-gradient(90deg, ${stops.join(",")})`;
  return element("p", { class: "scale" }, [element("span", { text: title }), low, bar, high]);
}

function points({ state, scene }: App): HTMLElement[] {
  const { settings } = state;
  const map = state.map!;
  const rows: HTMLElement[] = [];
  if (settings.colour === "session")
    rows.push(
      element(
        "p",
        {},
        map.sessions.map((session, index) =>
          swatch(session.name, sessionColour(index, settings.theme)),
        ),
      ),
    );
  const [low, high] = scene?.heights ?? [0, 0];
  if (settings.colour === "height")
    rows.push(ramp("height", `${low.toFixed(1)}`, `${high.toFixed(1)} m`));
  if (settings.colour === "visits")
    rows.push(
      ramp(
        "visits",
        "1",
        String(Math.max(2, map.sessions.filter((_, index) => state.inMap(index)).length)),
      ),
    );
  if (settings.colour === "epoch") rows.push(ramp("epoch of change", "0", String(map.epoch)));
  if (settings.colour === "intensity") rows.push(ramp("intensity", "1", "255"));
  if (settings.pathError && map.evaluation?.ate_m)
    rows.push(
      ramp("position error", "0", `${scene?.trajectories.largestError.toFixed(2) ?? ""} m`),
    );
  if (settings.removed || settings.divider !== null)
    rows.push(
      named(
        "removed",
        removalKinds
          .filter(({ category }) => settings.removedKinds[category])
          .map(({ category, short }) => swatch(short, removalColour[category]!)),
      ),
    );
  const wrong = [
    ...(settings.falseStatic ? ["false_static"] : []),
    ...(settings.falseDynamic ? ["false_dynamic"] : []),
  ];
  if (wrong.length)
    rows.push(
      element(
        "p",
        {},
        wrong.map((name) => swatch(name.replace("_", " "), errorColour[name]!)),
      ),
    );
  return rows;
}

function lines({ state }: App): HTMLElement[] {
  const { settings } = state;
  const rows: HTMLElement[] = [];
  if (settings.loops && state.map!.loops.length)
    rows.push(
      named(
        "loops",
        ["accepted", "provisional", "refused"].map((name) =>
          swatch(name, loopColour[settings.theme][name]!, `stroke ${name}`),
        ),
      ),
    );
  if (settings.boxes && state.map!.changes.length)
    rows.push(
      named(
        "changes",
        Object.entries(changeColour).map(([kind, colour]) => swatch(kind, colour, "box")),
      ),
    );
  return rows;
}
