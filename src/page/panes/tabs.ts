// Tabs of the side, and the sheet that holds them on narrow screens.
import { byId, element } from "../dom";

export interface Tab {
  id: string;
  text: string;
  fill: (root: HTMLElement) => void;
}

export class Tabs {
  private readonly bar = byId("tabs");
  private readonly panes = byId("panes");

  constructor(tabs: Tab[]) {
    for (const tab of tabs) {
      const pane = element("div", { id: `pane-${tab.id}`, class: "pane", role: "tabpanel" });
      pane.setAttribute("aria-labelledby", `tab-${tab.id}`);
      const button = element("button", {
        id: `tab-${tab.id}`,
        type: "button",
        role: "tab",
        text: tab.text,
        click: () => this.open(tab.id),
      });
      button.setAttribute("aria-controls", pane.id);
      this.bar.append(button);
      this.panes.append(pane);
      tab.fill(pane);
    }
    this.bar.addEventListener("keydown", (event) => this.key(event));
    byId("sheet").addEventListener("click", () => document.body.classList.toggle("folded"));
    this.open(tabs[0]!.id, false);
  }

  open(id: string, unfold = true): void {
    if (unfold) document.body.classList.remove("folded");
    for (const pane of this.panes.children) (pane as HTMLElement).hidden = pane.id !== `pane-${id}`;
    for (const button of this.bar.children) {
      const chosen = button.id === `tab-${id}`;
      button.setAttribute("aria-selected", String(chosen));
      button.setAttribute("tabindex", chosen ? "0" : "-1");
    }
  }

  setShown(id: string, shown: boolean): void {
    byId(`tab-${id}`).hidden = !shown;
  }

  setCount(id: string, text: string): void {
    byId(`tab-${id}`).dataset["count"] = text;
  }

  private key(event: KeyboardEvent): void {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    const shown = ([...this.bar.children] as HTMLElement[]).filter((button) => !button.hidden);
    const next =
      shown[
        (shown.indexOf(document.activeElement as HTMLElement) + step + shown.length) % shown.length
      ];
    if (!step || !next) return;
    next.click();
    next.focus();
  }
}
