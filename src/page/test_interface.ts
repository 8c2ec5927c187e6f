// Interface for tests in a browser: window.unimapper.
import { Vector3 } from "three";
import type { App } from "./panes/app";
import { toggleSession } from "./panes/layers_pane";

export function testInterface(app: App, ready: Promise<void>): void {
  const { state, scene, source } = app;
  const counts = () => ({
    points: state.pointsDrawn,
    tiles: scene?.tiles.visibleNodes.length ?? 0,
    keyframes: scene?.keyframes.drawn ?? 0,
    loops: scene?.loops.drawn ?? 0,
    bytes: source.bytes,
    loading: scene?.tiles.loading ?? 0,
    budget: Math.round(scene?.viewer.budget.points ?? 0),
    script_ms: scene?.viewer.script_ms ?? 0,
  });
  const loopOnScreen = (index: number) => {
    const ends = scene?.loops
      .ends(state.map!.loops[index]!)
      ?.map((end) => scene.viewer.project(end));
    return ends?.[0] && ends[1]
      ? { x: (ends[0].x + ends[1].x) / 2, y: (ends[0].y + ends[1].y) / 2 }
      : null;
  };
  (window as unknown as { unimapper: unknown }).unimapper = {
    onScreen: (...place: [number, number, number]) => scene?.viewer.project(new Vector3(...place)),
    ready,
    counts,
    loopOnScreen,
    renderer: scene?.viewer.name ?? null,
    epoch: () => state.map?.epoch ?? null,
    map: () => state.map,
    keyframeDrawn: (session: number, keyframe: number) =>
      scene?.keyframes.isDrawn(session, keyframe) ?? false,
    pose: (session: number, keyframe: number) => scene?.trajectories.pose(session, keyframe),
    health: (session: number) => state.health.get(session),
    settings: () => state.settings,
    set: (name: keyof typeof state.settings, value: never) => state.set(name, value),
    selectLoop: (index: number | null) => {
      state.select(index);
      if (index !== null) scene?.focusLoop(index);
    },
    toggleSession: (index: number) =>
      toggleSession(state, index, state.settings.hiddenSessions.has(index)),
    camera: () => {
      const { camera } = scene!.viewer;
      return {
        position: camera.position.toArray(),
        direction: camera.getWorldDirection(new Vector3()).toArray(),
      };
    },
    setMode: (mode: "orbit" | "walk" | "top") => scene?.control.setMode(mode),
    frameTime_ms: (turns: number) => frameTime(app, turns),
  };
}

/** Mean time of a frame while the view turns once around, in steps. */
function frameTime({ scene }: App, turns: number): Promise<number> {
  if (!scene) return Promise.resolve(0);
  const { camera } = scene.viewer,
    { controls } = scene.control;
  const start = performance.now();
  return new Promise((resolve) => {
    let left = turns;
    const turn = () => {
      if (left-- === 0) return resolve((performance.now() - start) / turns);
      const offset = camera.position
        .clone()
        .sub(controls.target)
        .applyAxisAngle(camera.up, (2 * Math.PI) / turns);
      camera.position.copy(controls.target).add(offset);
      controls.update();
      requestAnimationFrame(turn);
    };
    turn();
  });
}
