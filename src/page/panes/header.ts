// Head of the page: title, epoch, connection, colours.
import { byId, short } from "../dom";
import type { Theme } from "../palette";
import type { App } from "./app";

const storedTheme = "unimapper.theme";

/** What the person chose before, else what the system prefers. */
export function firstTheme(): Theme {
  let stored: string | null = null;
  try {
    stored = localStorage.getItem(storedTheme);
  } catch {
    /* storage may be switched off */
  }
  if (stored === "dark" || stored === "light") return stored;
  return matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
}

export function applyTheme(theme: Theme): void {
  document.documentElement.dataset["theme"] = theme;
}

export function switchTheme({ state }: App): void {
  const theme = state.settings.theme === "dark" ? "light" : "dark";
  try {
    localStorage.setItem(storedTheme, theme);
  } catch {
    /* then it holds until the page closes */
  }
  state.set("theme", theme);
}

export function header(app: App): void {
  const { state } = app;
  const button = byId("theme");
  button.addEventListener("click", () => switchTheme(app));
  const theme = () => {
    applyTheme(state.settings.theme);
    const other = state.settings.theme === "dark" ? "light" : "dark";
    button.textContent = other;
    button.setAttribute("aria-label", `Switch to ${other} colours`);
  };
  state.on("settings", theme);
  theme();
  state.on("map", () => {
    const map = state.map!;
    byId("title").textContent = map.title;
    document.title = `${map.title} – epoch ${map.epoch}`;
    const points = (map.layers["static"]?.nodes ?? []).reduce((sum, node) => sum + node[1], 0);
    const merged = map.sessions.filter((_, index) => state.inMap(index)).length;
    byId("facts").textContent = [
      `epoch ${map.epoch}`,
      `${merged} of ${map.sessions.length} sessions`,
      points ? `${short(points)} points` : null,
      `${map.loops.filter((loop) => loop.state === "accepted").length} loops`,
    ]
      .filter(Boolean)
      .join(" · ");
  });
  state.on("connection", () => connection(app));
  connection(app);
}

function connection({ state, source }: App): void {
  const shown = byId("connection");
  const [text, kind] = !source.live
    ? ["from a file", "file"]
    : state.connected === null
      ? ["connecting", "waiting"]
      : state.connected
        ? ["connected", "connected"]
        : ["disconnected, trying again", "lost"];
  shown.textContent = text!;
  shown.className = kind!;
}
