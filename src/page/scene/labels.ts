// Words at places of the map, moved with the view.
import type { Vector3 } from "three";
import { element } from "../dom";
import type { Viewer } from "./viewer";

interface Label {
  node: HTMLElement;
  place: Vector3;
}

export class Labels {
  private readonly labels = new Map<string, Label>();

  constructor(
    private readonly viewer: Viewer,
    private readonly parent: HTMLElement,
  ) {
    viewer.parts.push(() => this.move());
  }

  set(key: string, text: string, place: Vector3, kind = ""): void {
    const label = this.labels.get(key) ?? {
      node: element("div", { class: `place ${kind}` }),
      place,
    };
    if (!label.node.parentElement) this.parent.append(label.node);
    if (label.node.textContent !== text) label.node.textContent = text;
    label.place = place;
    this.labels.set(key, label);
    this.viewer.invalidate();
  }

  remove(prefix: string): void {
    for (const [key, label] of this.labels)
      if (key.startsWith(prefix)) {
        label.node.remove();
        this.labels.delete(key);
      }
    this.viewer.invalidate();
  }

  private move(): boolean {
    this.viewer.camera.updateMatrixWorld();
    for (const { node, place } of this.labels.values()) {
      const at = this.viewer.project(place);
      node.hidden =
        !at || at.x < 0 || at.y < 0 || at.x > this.viewer.width || at.y > this.viewer.height;
      if (at)
        node.style.transform = `translate(${Math.round(at.x)}px, ${Math.round(at.y)}px) translate(-50%, -140%)`;
    }
    return false;
  }
}
