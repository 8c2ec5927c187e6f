// Colours that stay apart for colour-blind eyes, on dark and on light.

export type Theme = "dark" | "light";

/** Any two of eight are far apart for every kind of colour blindness (tests/palette.test.mjs). */
export const sessions: Record<Theme, string[]> = {
  dark: ["#e9a23b", "#4f9fe6", "#f1e297", "#a66a97", "#10f1f1", "#b55b1f", "#6a795b", "#a6c4a6"],
  light: ["#d98200", "#2f7fd6", "#6a4c6a", "#a62e10", "#79975b", "#b58897", "#792e2e", "#2e3d88"],
};
export const sessionColour = (index: number, theme: Theme): string =>
  sessions[theme][index % sessions[theme].length]!;

export const loopColour: Record<Theme, Record<string, string>> = {
  dark: { accepted: "#3ddc84", provisional: "#ffc233", refused: "#ff5a52" },
  light: { accepted: "#00803f", provisional: "#b57a00", refused: "#c8281e" },
};
export const changeColour: Record<string, string> = {
  appeared: "#1fb58f",
  gone: "#e0652a",
  moved: "#3f9be0",
};
/** By category of a point (docs/api.md): kept, by the robot, none, by refinement. */
export const removalColour = ["#9aa0a8", "#e8602c", "#9aa0a8", "#c77dd6"];
export const removalKinds = [
  { category: 1, name: "online, on the robot", short: "online" },
  { category: 3, name: "by refinement at the base", short: "refinement" },
];
export const errorColour: Record<string, string> = {
  false_static: "#f0453a",
  false_dynamic: "#ff9a2e",
};
export const scanColour = { match: "#56b4e9", query: "#e9a23b" };
export const background: Record<Theme, string> = { dark: "#0e1116", light: "#f3f4f6" };

/** Viridis without its darkest part, which a dark background would hide: even in lightness. */
const ramp = [
  "#4b3b8f",
  "#414c8c",
  "#355f8d",
  "#2a788e",
  "#21918c",
  "#22a884",
  "#44bf70",
  "#7ad151",
  "#bddf26",
  "#fde725",
].map(bytes);

export function bytes(colour: string): [number, number, number] {
  const value = parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

/** Colour of the ramp at 0..1, as three bytes. */
export function rampAt(fraction: number): [number, number, number] {
  const position = Math.min(Math.max(fraction, 0), 1) * (ramp.length - 1);
  const low = Math.min(Math.floor(position), ramp.length - 2);
  const part = position - low;
  return [0, 1, 2].map((i) =>
    Math.round(ramp[low]![i]! * (1 - part) + ramp[low + 1]![i]! * part),
  ) as [number, number, number];
}

export const css = (colour: [number, number, number]): string => `rgb(${colour.join(" ")})`;
