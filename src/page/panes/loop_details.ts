// Details of a loop: both scans, measures, and what a person says of it.
import { Matrix4 } from "three";
import type { Outcome } from "../data/commands";
import { byId, choice, element, fixed, terms } from "../dom";
import { keyframeName, loopName, type Loop, type LoopStatement } from "../data/format";
import { loopColour, scanColour } from "../palette";
import { LoopScene } from "../scene/loop_scene";
import { matrixOf } from "../scene/poses";
import type { App } from "./app";

/** What was said last on this page, and what had been said of that loop before. */
interface Said {
  loop: string;
  epoch: number;
  before: LoopStatement;
}

export class LoopDetails {
  private readonly root = byId("loop");
  private view: LoopScene | null = null;
  private readonly status = element("p", { class: "status", role: "status" });
  private ofMap = false;
  private shownLoop: string | null = null;
  private said: Said | null = null;

  constructor(private readonly app: App) {
    app.state.on("selection", () => this.render());
    app.state.on("map", () => this.render());
    app.state.on("settings", () => this.view?.setTheme(app.state.settings.theme));
  }

  private render(): void {
    const { state } = this.app;
    const index = state.selectedLoop;
    const loop = state.map?.loops[index ?? -1];
    this.root.hidden = !loop;
    if (!loop || index === null) {
      this.shownLoop = null;
      return;
    }
    const name = loopName(state.map!, loop);
    if (name !== this.shownLoop) {
      this.ofMap = loop.T_match_query === null;
      this.status.textContent = "";
    }
    this.shownLoop = name;
    this.root.replaceChildren(
      this.head(loop, index),
      this.scans(loop),
      this.measures(loop),
      this.actions(loop),
      this.status,
    );
    void this.showScans(loop);
  }

  private head(loop: Loop, index: number): HTMLElement {
    const step = (by: number) => () => {
      const count = this.app.state.map!.loops.length;
      const next = (index + by + count) % count;
      this.app.state.select(next);
      this.app.scene?.focusLoop(next);
    };
    return element("div", { class: "head" }, [
      element("div", {}, [
        element("h2", { text: `Loop ${index}` }),
        element("span", {
          class: `state ${loop.state}`,
          colour: loopColour[this.app.state.settings.theme][loop.state]!,
          text: loop.state,
        }),
      ]),
      element("div", { class: "buttons" }, [
        element("button", { type: "button", text: "‹", label: "Loop before", click: step(-1) }),
        element("button", { type: "button", text: "›", label: "Next loop", click: step(1) }),
        element("button", {
          type: "button",
          text: "×",
          label: "Close",
          click: () => this.app.state.select(null),
        }),
      ]),
    ]);
  }

  private scans(loop: Loop): HTMLElement {
    this.view ??= this.app.scene ? new LoopScene() : null;
    this.view?.setTheme(this.app.state.settings.theme);
    const which =
      loop.T_match_query === null
        ? element("p", {
            class: "note",
            text: "The loop has no pose of its own; the scans are shown at their poses in the map.",
          })
        : choice(
            "Pose of the scans",
            [
              ["loop", "pose of the loop"],
              ["map", "poses of the map"],
            ],
            this.ofMap ? "map" : "loop",
            (value) => {
              this.ofMap = value === "map";
              void this.showScans(loop);
            },
          );
    const key = (text: string, colour: string) =>
      element("span", { class: "key" }, [element("span", { class: "swatch", colour }), text]);
    return element("div", { class: "scans" }, [
      this.view?.canvas ?? null,
      element("p", { class: "keys" }, [
        key(keyframeName(this.app.state.map!, loop.match), scanColour.match),
        key(keyframeName(this.app.state.map!, loop.query), scanColour.query),
      ]),
      which,
    ]);
  }

  private async showScans(loop: Loop): Promise<void> {
    const { source, state } = this.app;
    if (!this.view) return;
    this.view.clear();
    if (![loop.match, loop.query].every((end) => source.hasKeyframe(...end))) {
      this.status.textContent = source.live
        ? "The scans of this loop have not arrived whole."
        : "The scans of this loop are not in this file.";
      return;
    }
    try {
      const epoch = state.map!.epoch;
      const [match, query] = await Promise.all([
        source.keyframe(epoch, ...loop.match),
        source.keyframe(epoch, ...loop.query),
      ]);
      if (state.map?.loops[state.selectedLoop ?? -1] === loop)
        this.view.show(match, query, this.pose(loop));
    } catch (error) {
      this.status.textContent = (error as Error).message;
    }
  }

  private pose(loop: Loop): Matrix4 {
    if (loop.T_match_query && !this.ofMap) return matrixOf(loop.T_match_query);
    const sessions = this.app.state.map!.sessions;
    const match = sessions[loop.match[0]]?.poses[loop.match[1]],
      query = sessions[loop.query[0]]?.poses[loop.query[1]];
    return match && query ? matrixOf(match).invert().multiply(matrixOf(query)) : new Matrix4();
  }

  private measures(loop: Loop): HTMLElement {
    return terms([
      ["reason", loop.reason || "–"],
      ["overlap", fixed(loop.overlap, 2)],
      ["confidence", fixed(loop.confidence, 2)],
      ["residual", `${fixed(loop.residual_m, 3, " m")}, ${fixed(loop.residual_deg, 2, "°")}`],
      ["weak axes", String(loop.weak_axes)],
      ["said by a person", loop.statement ?? (loop.by_person ? "yes" : "nothing")],
    ]);
  }

  private actions(loop: Loop): HTMLElement | string {
    const { state, commands } = this.app;
    if (!state.map!.can_change || !this.app.source.live)
      return element("p", { class: "note", text: "This map cannot be changed from here." });
    const allowed = Boolean(commands.token) && state.connected !== false;
    const map = state.map!;
    const say = (statement: LoopStatement) => () =>
      void this.send(loop, () => commands.statement(map, loop, statement));
    const buttons = (["right", "wrong", "not yet"] as LoopStatement[]).map((statement) => {
      const button = element("button", {
        type: "button",
        text: statement,
        class: statement.replace(" ", "-"),
        disabled: !allowed,
        click: say(statement),
      });
      button.setAttribute("aria-pressed", String(loop.statement === statement));
      return button;
    });
    // Going back is quick; but once others have changed the map, that would take back theirs.
    const { said } = this;
    const undo =
      said?.loop === loopName(map, loop)
        ? element("button", {
            type: "button",
            text: "undo",
            class: "undo",
            disabled: !allowed,
            click: () =>
              void this.send(null, () =>
                said.epoch === map.epoch
                  ? commands.undo(map.epoch)
                  : commands.statement(map, loop, said.before),
              ),
          })
        : null;
    return element("div", { class: "actions" }, [
      element("div", { class: "row", role: "group", label: "This loop is" }, [...buttons, undo]),
      allowed
        ? null
        : commands.token
          ? element("p", { class: "note", text: "Disconnected: nothing can be changed." })
          : this.tokenField(),
    ]);
  }

  private tokenField(): HTMLElement {
    const field = element("input", { type: "password", label: "Token", name: "token" });
    field.placeholder = "token";
    field.autocomplete = "off";
    const form = element("form", { class: "token" }, [
      element("p", {
        class: "note",
        text: "To change the map, open the page with its token in the address (#token=…), or enter it:",
      }),
      field,
      element("button", { type: "submit", text: "use" }),
    ]);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.app.commands.token = field.value.trim() || null;
      this.render();
    });
    return form;
  }

  /** `loop`: of which something is said; null: that is taken back. */
  private async send(loop: Loop | null, change: () => Promise<Outcome>): Promise<void> {
    const before: Omit<Said, "epoch"> | null = loop && {
      loop: loopName(this.app.state.map!, loop),
      before: loop.statement ?? "not yet",
    };
    this.root.querySelectorAll<HTMLButtonElement>(".actions button").forEach((button) => {
      button.disabled = true;
    });
    this.status.textContent = "The map is merged again …";
    try {
      const { epoch, outcome } = await change();
      this.said = before && { ...before, epoch };
      await this.app.reload();
      this.status.textContent = `Epoch ${epoch}: ${outcome}`;
    } catch (error) {
      this.status.textContent = (error as Error).message;
      this.render();
    }
  }
}
