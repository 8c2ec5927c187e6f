// List of changed objects, by session.
import { Vector3 } from "three";
import { element, fixed } from "../dom";
import type { Change } from "../data/format";
import { changeColour } from "../palette";
import type { App } from "./app";

const most = 300;

export function changesPane(app: App, root: HTMLElement): void {
  app.state.on("map", () => root.replaceChildren(...lists(app)));
}

/** Kind, session and confidence at the box itself. */
export function nameChange(app: App, change: Change): void {
  const [x, y, z] = change.box.centre as [number, number, number];
  const session = app.state.map!.sessions[change.session]?.name ?? String(change.session);
  const text = `${change.kind} · ${session} · confidence ${fixed(change.confidence, 2)}`;
  app.scene?.labels.set("change/chosen", text, new Vector3(x, y, z + change.box.size[2]! / 2));
}

function show(app: App, change: Change): void {
  app.scene?.control.focus(new Vector3(...(change.box.centre as [number, number, number])), 25);
  nameChange(app, change);
}

function lists(app: App): HTMLElement[] {
  const map = app.state.map!;
  if (!map.changes.length) return [element("p", { class: "note", text: "No changed objects." })];
  return map.sessions
    .map((session, index) => {
      const changes = map.changes.filter((change) => change.session === index);
      const rows = changes.slice(0, most).map((change) =>
        element(
          "button",
          {
            type: "button",
            class: "change-row",
            colour: changeColour[change.kind] ?? "#888888",
            click: () => show(app, change),
          },
          [
            element("span", { class: "swatch", colour: changeColour[change.kind] ?? "#888888" }),
            element("span", {
              class: "words",
              text: `${change.kind} · ${change.box.size.map((value) => value.toFixed(1)).join(" × ")} m`,
            }),
            element("span", { class: "extra", text: fixed(change.confidence, 2) }),
            element("span", {
              class: "sub",
              text: `free in ${map.sessions[change.free_in]?.name ?? change.free_in}`,
            }),
          ],
        ),
      );
      return changes.length
        ? element("section", {}, [
            element("h2", { text: `${session.name}: ${changes.length}` }),
            element("div", { class: "list" }, rows),
          ])
        : null;
    })
    .filter((part) => part !== null);
}
