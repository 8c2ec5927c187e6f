// Start of the page: source, scene, panes, events.
import { Commands } from "./data/commands";
import { Events } from "./data/events";
import {
  isPose,
  type KeyframeEvent,
  type MapData,
  type RobotAlarm,
  type RobotEvent,
  type RobotHealth,
} from "./data/format";
import { joined } from "./data/health_history";
import { chosenSource } from "./data/source";
import { byId, element } from "./dom";
import type { App } from "./panes/app";
import { changesPane } from "./panes/changes_pane";
import { evaluationPane } from "./panes/evaluation_pane";
import { applyTheme, firstTheme, header } from "./panes/header";
import { layersPane } from "./panes/layers_pane";
import { legend } from "./panes/legend";
import { LoopDetails } from "./panes/loop_details";
import { loopsPane } from "./panes/loops_pane";
import { mapPane } from "./panes/map_pane";
import { reportPane } from "./panes/report_pane";
import { robotsPane } from "./panes/robots_pane";
import { Tabs } from "./panes/tabs";
import { timeBar } from "./panes/time_bar";
import { Tools } from "./panes/tools";
import { samePose } from "./scene/poses";
import { MapScene } from "./scene/map_scene";
import { rendererName } from "./scene/viewer";
import { State } from "./state";
import { testInterface } from "./test_interface";

/** The server keeps one entry a minute, the latest of which changes. */
const healthPeriod_ms = 5000;

function sceneOf(state: State, source: App["source"]): MapScene | null {
  const name = rendererName();
  if (name !== null)
    return new MapScene(byId("canvas") as HTMLCanvasElement, byId("labels"), source, state, name);
  byId("tools").hidden = byId("legend").hidden = true;
  showFlat();
  return null;
}

/** Without WebGL: a sentence, and a picture where the page holds one. */
function showFlat(): void {
  const message = byId("message");
  message.replaceChildren(
    element("p", {
      text: "This browser has no WebGL 2, so the map cannot be drawn in 3D. Facts, loops and changes are at the side.",
    }),
  );
  const picture = document.getElementById("flat-picture")?.textContent?.trim();
  if (picture?.startsWith("data:image/")) {
    const image = element("img", {});
    image.alt = "Map seen from above";
    image.src = picture;
    message.append(image);
  }
  message.hidden = false;
}

/** Where the server does not say which epoch moved a session: this page saw it move. */
function markEpochs(before: MapData | null, now: MapData): void {
  now.sessions.forEach((session, index) => {
    if (session.epoch !== undefined) return;
    const old = before?.sessions[index];
    const moved =
      old &&
      (old.poses.length !== session.poses.length ||
        old.poses.some((pose, k) => !samePose(pose, session.poses[k]!)));
    session.epoch = old && !moved ? (old.epoch ?? 0) : before ? now.epoch : 0;
  });
}

/** One request at a time; what happens during it asks for one more. */
function reloader(app: App): () => Promise<void> {
  let running: Promise<void> | null = null,
    next: Promise<void> | null = null;
  const run = () => {
    running = load(app).finally(() => {
      running = null;
    });
    return running;
  };
  return () => {
    if (!running) return run();
    next ??= running.then(() => {
      next = null;
      return run();
    });
    return next;
  };
}

/** Of a map with nothing to see; without WebGL the message says that. */
function showNotice({ scene }: App, notice: string | null): void {
  if (!scene) return;
  const message = byId("message");
  message.hidden = notice === null;
  if (notice !== null) message.replaceChildren(element("p", { text: notice }));
}

async function load(app: App): Promise<void> {
  try {
    const map = await app.source.map();
    markEpochs(app.state.map, map);
    app.state.show(map);
    showNotice(app, map.notice);
    app.scene?.showMap();
    app.state.emit("map");
  } catch (error) {
    app.state.alarm("error", (error as Error).message);
    if (app.state.map || !app.scene) return;
    byId("message").replaceChildren(
      element("p", { text: `The map cannot be shown: ${(error as Error).message}` }),
    );
    byId("message").hidden = false;
  }
}

function listen(app: App): void {
  const { state, scene, source } = app;
  const robot = (event: RobotEvent) => {
    if (event.pose && !isPose(event.pose)) throw new Error("its pose is none");
    state.robots.set(event.session, event);
    scene?.redrawRobots();
    state.emit("robots");
  };
  const health = (robot: RobotHealth) => {
    state.health.set(robot.session, joined(state.health.get(robot.session), robot));
    state.emit("health");
  };
  const refreshHealth = () =>
    source
      .health()
      .then(({ robots, alarms }) => {
        robots.forEach(health);
        state.robotAlarms(alarms);
      })
      .catch((error: Error) => state.alarm("warning", error.message));
  const keyframe = (event: KeyframeEvent) => {
    if (!isPose(event.pose)) throw new Error("its pose is none");
    if (event.session >= (state.map?.sessions.length ?? 0)) void app.reload();
    scene?.arrived(event);
  };
  new Events(
    "api/events",
    {
      map: () => void app.reload(),
      keyframe: (event) => keyframe(event as KeyframeEvent),
      robot: (event) => robot(event as RobotEvent),
      alarm: (event) => state.robotAlarm(event as RobotAlarm),
    },
    (connected, again) => {
      state.connected = connected;
      state.emit("connection");
      if (connected) void refreshHealth();
      if (again || (connected && !state.map)) void app.reload();
    },
    (text) => state.alarm("error", text),
  ).start();
  setInterval(() => {
    if (state.connected) void refreshHealth();
  }, healthPeriod_ms);
}

function start(): void {
  const state = new State(firstTheme());
  applyTheme(state.settings.theme);
  const source = chosenSource();
  const commands = new Commands();
  const scene = sceneOf(state, source);
  const app: App = { state, source, commands, scene, reload: () => Promise.resolve() };
  app.reload = reloader(app);
  header(app);
  reportPane();
  const tabs = new Tabs([
    { id: "map", text: "Map", fill: (root) => mapPane(app, root) },
    { id: "layers", text: "View", fill: (root) => layersPane(app, root) },
    { id: "loops", text: "Loops", fill: (root) => loopsPane(app, root) },
    { id: "changes", text: "Changes", fill: (root) => changesPane(app, root) },
    { id: "robots", text: "Robots", fill: (root) => robotsPane(app, root) },
    { id: "evaluation", text: "Evaluation", fill: (root) => evaluationPane(app, root) },
  ]);
  state.on("map", () => tabs.setShown("evaluation", state.map!.evaluation !== null));
  state.on("alarms", () =>
    tabs.setCount("robots", state.alarms.length ? String(state.alarms.length) : ""),
  );
  new LoopDetails(app);
  timeBar(app);
  if (scene) {
    legend(app);
    new Tools(app, scene);
    state.on("settings", () => scene.settingsChanged());
    state.on("selection", () => {
      if (state.map) scene.loops.rebuild();
      scene.viewer.invalidate();
    });
  }
  const drawn = scene ? scene.whenDrawn() : Promise.resolve();
  testInterface(
    app,
    Promise.all([app.reload(), drawn]).then(() => undefined),
  );
  if (source.live) listen(app);
}

start();
