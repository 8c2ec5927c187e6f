// Sliders over the epochs and over the drive.
import { byId, element, fixed } from "../dom";
import type { App } from "./app";

const steps = 1000;
const playSeconds = 20;

export function timeBar(app: App): void {
  const { state } = app;
  const root = byId("times");
  let timer = 0;
  const stop = () => {
    clearInterval(timer);
    timer = 0;
  };

  const render = () => {
    stop();
    const rows = [
      drive(
        app,
        () => timer,
        (value) => {
          timer = value;
        },
        stop,
      ),
      epochs(app),
    ].filter((row) => row !== null);
    root.replaceChildren(...rows);
    root.hidden = !rows.length;
  };
  let shape = "";
  state.on("map", () => {
    const map = state.map!;
    const now = JSON.stringify([map.epoch, map.epochs.length, duration(app)]);
    if (now !== shape) render();
    shape = now;
  });
}

const duration = ({ state }: App): number =>
  Math.max(
    0,
    ...state.map!.sessions.map(
      (session) =>
        (session.stamps_s[session.stamps_s.length - 1] ?? 0) - (session.stamps_s[0] ?? 0),
    ),
  );

function drive(
  app: App,
  running: () => number,
  setTimer: (timer: number) => void,
  stop: () => void,
): HTMLElement | null {
  const { state } = app;
  const length = duration(app);
  if (!length) return null;
  const value = element("output", { text: "whole drive" });
  const start = state.settings.driveTime_s;
  const slider = element("input", {
    type: "range",
    min: "0",
    max: String(steps),
    label: "Time of the drive",
    value: String(start === null ? steps : Math.round((steps * start) / length)),
    input: (text) => {
      stop();
      show(Number(text));
    },
  });
  const show = (step: number) => {
    state.set("driveTime_s", step >= steps ? null : (step / steps) * length);
    value.textContent = step >= steps ? "whole drive" : fixed((step / steps) * length, 1, " s");
    play.textContent = running() ? "❚❚" : "▶";
  };
  const play = element("button", {
    type: "button",
    text: "▶",
    label: "Play the drive",
    click: () => {
      if (running()) {
        stop();
        play.textContent = "▶";
        return;
      }
      if (Number(slider.value) >= steps) slider.value = "0";
      setTimer(
        window.setInterval(() => {
          const next = Math.min(steps, Number(slider.value) + steps / (playSeconds * 5));
          slider.value = String(next);
          if (next >= steps) stop();
          show(next);
        }, 200),
      );
      play.textContent = "❚❚";
    },
  });
  return element("div", { class: "time" }, [
    element("span", { text: "drive" }),
    play,
    slider,
    value,
  ]);
}

function epochs(app: App): HTMLElement | null {
  const { state, source } = app;
  const map = state.map!;
  if (map.epochs.length < 2) return null;
  const numbers = map.epochs.map((epoch) => epoch.number);
  const at = Math.max(0, numbers.indexOf(map.epoch));
  const value = element("output", { text: `epoch ${map.epoch}` });
  const slider = element("input", {
    type: "range",
    min: "0",
    max: String(numbers.length - 1),
    value: String(at),
    label: "Epoch",
    disabled: !source.live,
    title: source.live ? "" : "A file holds one epoch",
    input: (text) => {
      value.textContent = `epoch ${numbers[Number(text)]}`;
    },
  });
  slider.addEventListener(
    "change",
    () =>
      void (async () => {
        try {
          const chosen = Number(slider.value);
          source.shownEpoch = chosen === numbers.length - 1 ? null : numbers[chosen]!;
          await app.reload();
        } catch (error) {
          slider.value = String(at);
          value.textContent = `epoch ${map.epoch}`;
          state.alarm("error", (error as Error).message);
        }
      })(),
  );
  return element("div", { class: "time" }, [
    element("span", { text: "epoch" }),
    element("i"),
    slider,
    value,
  ]);
}
