// Tools of the view: ways to look, measuring, section box, divider, keys.
import { byId, element } from "../dom";
import type { Mode } from "../scene/camera_control";
import type { MapScene } from "../scene/map_scene";
import type { App } from "./app";
import { nameChange } from "./changes_pane";
import { divider } from "./divider";
import { switchTheme } from "./header";

const keys: [string, string][] = [
  ["1, 2, 3", "orbit, walk, top view"],
  ["W A S D, arrows", "move"],
  ["Q, E", "turn"],
  ["+, −", "nearer, farther"],
  ["F", "whole map"],
  ["M", "measure"],
  ["B", "section box"],
  ["R", "removed points"],
  ["V", "before and after"],
  ["[, ]", "loop before, next"],
  ["T", "dark or light"],
  ["Esc", "close"],
  ["?", "these keys"],
];

export class Tools {
  private readonly buttons = new Map<string, HTMLElement>();

  constructor(
    private readonly app: App,
    private readonly scene: MapScene,
  ) {
    const tool = (id: string, text: string, title: string, click: () => void) => {
      const button = element("button", { type: "button", text, title, click });
      this.buttons.set(id, button);
      return button;
    };
    const modes = (["orbit", "walk", "top"] as Mode[]).map((mode, i) =>
      tool(mode, mode, `${mode} view (${i + 1})`, () => this.setMode(mode)),
    );
    byId("tools").append(
      element("div", { class: "group" }, modes),
      element("div", { class: "group" }, [
        tool("fit", "whole", "Whole map (F)", () => {
          scene.fit();
          this.mark();
        }),
        tool("measure", "measure", "Measure a distance (M)", () => this.toggleMeasure()),
        tool("section", "section", "Section box (B)", () => this.toggleSection()),
        tool("help", "?", "Keys (?)", () => this.toggleHelp()),
      ]),
    );
    byId("help").replaceChildren(
      element("h2", { text: "Keys" }),
      element(
        "dl",
        { class: "terms" },
        keys.flatMap(([key, text]) => [element("dt", { text: key }), element("dd", { text })]),
      ),
      element("p", {
        class: "note",
        text: "Mouse: left turns, right moves, wheel goes nearer. Touch: one finger turns, two move and go nearer.",
      }),
    );
    this.sectionSliders();
    divider(app, scene);
    this.picking();
    document.addEventListener("keydown", (event) => this.key(event));
    this.mark();
  }

  setMode(mode: Mode): void {
    this.scene.control.setMode(mode);
    this.mark();
  }

  private mark(): void {
    const on: Record<string, boolean> = {
      measure: this.scene.measure.active,
      section: this.scene.section.active,
      help: !byId("help").hidden,
    };
    for (const [id, button] of this.buttons)
      if (id !== "fit")
        button.setAttribute("aria-pressed", String(on[id] ?? id === this.scene.control.mode));
  }

  private hint(text: string): void {
    byId("hint").textContent = text;
    byId("hint").hidden = !text;
  }

  toggleMeasure(): void {
    this.scene.measure.setActive(!this.scene.measure.active);
    this.hint(this.scene.measure.active ? "Pick two points." : "");
    this.scene.viewer.canvas.classList.toggle("picking", this.scene.measure.active);
    this.mark();
  }

  toggleSection(): void {
    this.scene.section.active = !this.scene.section.active;
    byId("section").hidden = !this.scene.section.active;
    this.scene.section.apply();
    this.scene.viewer.invalidate();
    this.mark();
  }

  private toggleHelp(): void {
    byId("help").hidden = !byId("help").hidden;
    this.mark();
  }

  private sectionSliders(): void {
    const { section, viewer } = this.scene;
    const rows = ["x", "y", "z"].map((axis, i) => {
      const slider = (end: 0 | 1) =>
        element("input", {
          type: "range",
          min: "0",
          max: "1",
          step: "0.005",
          value: String(end),
          label: `${axis} ${end ? "to" : "from"}`,
          input: (text) => {
            const value = Number(text);
            section.shares[2 * i + end] = end
              ? Math.max(value, section.shares[2 * i]! + 0.01)
              : Math.min(value, section.shares[2 * i + 1]! - 0.01);
            section.apply();
            viewer.move();
          },
        });
      return element("label", { class: "pair" }, [
        element("span", { text: axis }),
        slider(0),
        slider(1),
      ]);
    });
    byId("section").replaceChildren(element("h2", { text: "Section box" }), ...rows);
  }

  /** A press that does not move is a pick: of a point while measuring, else of a loop. */
  private picking(): void {
    const { canvas } = this.scene.viewer;
    let from: { x: number; y: number } | null = null;
    canvas.addEventListener("pointerdown", (event) => {
      from = event.isPrimary ? { x: event.clientX, y: event.clientY } : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      if (!from || Math.hypot(event.clientX - from.x, event.clientY - from.y) > 5) return;
      const bounds = canvas.getBoundingClientRect();
      this.pick(
        event.clientX - bounds.left,
        event.clientY - bounds.top,
        event.pointerType === "touch" ? 22 : 9,
      );
    });
  }

  pick(x: number, y: number, reach: number): void {
    if (this.scene.measure.active) {
      const point = this.scene.pointAt(x, y);
      if (point) this.scene.measure.pick(point);
      this.hint(point ? this.scene.measure.text || "Pick the second point." : "No point there.");
      return;
    }
    const loop = this.scene.loops.at(this.scene.viewer, x, y, reach);
    if (loop !== null) this.app.state.select(loop);
    else this.pickChange(x, y, reach);
  }

  private pickChange(x: number, y: number, reach: number): void {
    const change = this.scene.changes.at(this.scene.viewer, x, y, reach);
    if (change) nameChange(this.app, change);
    else this.scene.labels.remove("change/");
  }

  private stepLoop(by: number): void {
    const { state } = this.app;
    const count = state.map?.loops.length ?? 0;
    if (!count) return;
    const next = ((state.selectedLoop ?? (by > 0 ? -1 : 0)) + by + count) % count;
    state.select(next);
    this.scene.focusLoop(next);
  }

  private close(): void {
    if (this.scene.measure.active) this.toggleMeasure();
    else if (!byId("help").hidden) this.toggleHelp();
    else this.app.state.select(null);
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (
      event.ctrlKey ||
      event.metaKey ||
      event.altKey ||
      (/^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) &&
        (target as HTMLInputElement).type !== "checkbox")
    )
      return;
    const { state } = this.app;
    const actions: Record<string, () => void> = {
      "1": () => this.setMode("orbit"),
      "2": () => this.setMode("walk"),
      "3": () => this.setMode("top"),
      f: () => {
        this.scene.fit();
        this.mark();
      },
      m: () => this.toggleMeasure(),
      b: () => this.toggleSection(),
      t: () => switchTheme(this.app),
      r: () => state.set("removed", !state.settings.removed),
      v: () => state.set("divider", state.settings.divider === null ? 0.5 : null),
      "[": () => this.stepLoop(-1),
      "]": () => this.stepLoop(1),
      escape: () => this.close(),
      "?": () => this.toggleHelp(),
    };
    actions[event.key.toLowerCase()]?.();
  }
}
