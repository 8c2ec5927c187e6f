// List of loops, filtered by state.
import { checkbox, element, fixed } from "../dom";
import { keyframeName, type Loop, type LoopState } from "../data/format";
import { loopColour } from "../palette";
import type { App } from "./app";

const page = 200;
const states: LoopState[] = ["accepted", "provisional", "refused"];

export function loopsPane(app: App, root: HTMLElement): void {
  const { state } = app;
  const filters = element("div", { class: "filters" });
  const list = element("div", { class: "list", role: "listbox", label: "Loops" });
  root.replaceChildren(filters, list);
  let shown = page;

  const renderFilters = () =>
    filters.replaceChildren(
      ...states.map((name) =>
        checkbox(
          name,
          state.settings.loopStates[name],
          (on) => state.set("loopStates", { ...state.settings.loopStates, [name]: on }),
          loopColour[state.settings.theme][name],
          String(state.map!.loops.filter((loop) => loop.state === name).length),
        ),
      ),
    );

  const renderList = () => {
    const loops = state
      .map!.loops.map((loop, index) => ({ loop, index }))
      .filter(({ loop }) => state.settings.loopStates[loop.state]);
    const rows = loops.slice(0, shown).map(({ loop, index }) => row(app, loop, index));
    const more =
      loops.length > shown
        ? [
            element("button", {
              type: "button",
              class: "more",
              text: `${loops.length - shown} more`,
              click: () => {
                shown += page;
                renderList();
              },
            }),
          ]
        : [];
    list.replaceChildren(...rows, ...more);
    if (!loops.length)
      list.append(
        element("p", {
          class: "note",
          text: state.map!.loops.length ? "No loop of these states." : "This map has no loops.",
        }),
      );
  };
  list.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
    const rows = [...list.querySelectorAll("button")];
    const next = rows[rows.indexOf(document.activeElement as HTMLButtonElement) + step];
    if (!step || !next) return;
    event.preventDefault();
    next.focus();
    next.click();
  });

  state.on("map", () => {
    renderFilters();
    renderList();
  });
  let drawnFor = "";
  state.on("settings", () => {
    const key = JSON.stringify([state.settings.loopStates, state.settings.theme]);
    if (key === drawnFor || !state.map) return;
    drawnFor = key;
    renderList();
  });
  state.on("selection", () => {
    for (const button of list.querySelectorAll("button"))
      button.setAttribute(
        "aria-selected",
        String(button.dataset["loop"] === String(state.selectedLoop)),
      );
  });
}

function row(app: App, loop: Loop, index: number): HTMLElement {
  const button = element(
    "button",
    {
      type: "button",
      role: "option",
      class: `loop-row ${loop.state}`,
      colour: loopColour[app.state.settings.theme][loop.state]!,
      click: () => {
        app.state.select(index);
        app.scene?.focusLoop(index);
      },
    },
    [
      element("span", { class: "mark" }),
      element("span", {
        class: "words",
        text: [loop.query, loop.match].map((end) => keyframeName(app.state.map!, end)).join(" – "),
      }),
      element("span", { class: "extra", text: loop.statement ?? fixed(loop.overlap, 2) }),
      element("span", { class: "sub", text: `${loop.state}, ${loop.reason || "no reason given"}` }),
    ],
  );
  button.dataset["loop"] = String(index);
  button.setAttribute("aria-selected", String(index === app.state.selectedLoop));
  return button;
}
