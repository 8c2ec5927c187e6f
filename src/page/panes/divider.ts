// Divider of before and after: removed points on its left only.
import { byId, element } from "../dom";
import type { MapScene } from "../scene/map_scene";
import type { App } from "./app";

export function divider({ state }: App, scene: MapScene): void {
  const handle = byId("divider");
  const place = () => {
    const share = state.settings.divider;
    handle.hidden = share === null;
    handle.style.left = `${100 * (share ?? 0)}%`;
    handle.setAttribute("aria-valuenow", String(Math.round(100 * (share ?? 0))));
    scene.viewer.invalidate();
  };
  const set = (share: number) => state.set("divider", Math.min(1, Math.max(0, share)));
  handle.append(
    element("span", { text: "with removed" }),
    element("span", { text: "static only" }),
  );
  handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
  handle.addEventListener("pointermove", (event) => {
    if (handle.hasPointerCapture(event.pointerId))
      set((event.clientX - byId("view").getBoundingClientRect().left) / scene.viewer.width);
  });
  handle.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowRight" ? 0.02 : event.key === "ArrowLeft" ? -0.02 : 0;
    if (step) set((state.settings.divider ?? 0.5) + step);
  });
  state.on("settings", place);
}
