// Small charts of values over time, and curves.
import type { Figures } from "../data/format";
import { element, svg } from "../dom";

export interface Series {
  name: string;
  x: number[];
  y: Figures;
}
const width = 280,
  height = 72,
  left = 36,
  bottom = 14,
  top = 6;
const colours = ["#56b4e9", "#e9a23b", "#d58bb5", "#3cbf95", "#f0e442", "#e0723a"];
const dashes = ["", "5 2", "2 2", "7 2 2 2", "1 2", "9 3"];

interface Range {
  low: number;
  high: number;
}

const isFigure = (value: number | null | undefined): value is number => Number.isFinite(value);

function range(values: Figures, fromZero: boolean): Range {
  const finite = values.filter(isFigure);
  if (!finite.length) return { low: 0, high: 1 };
  const low = fromZero ? Math.min(0, ...finite) : Math.min(...finite);
  const high = Math.max(...finite);
  return { low, high: high > low ? high : low + 1 };
}

const compact = (value: number): string => {
  const size = Math.abs(value);
  if (size >= 1e9) return `${(value / 1e9).toFixed(1)}G`;
  if (size >= 1e6) return `${(value / 1e6).toFixed(1)}M`;
  if (size >= 1e4) return `${Math.round(value / 1e3)}k`;
  return size >= 100 || Number.isInteger(value)
    ? String(Math.round(value))
    : value.toFixed(size < 1 ? 2 : 1);
};

/** Runs of figures without a gap; a figure between two gaps is a dot. */
function runs(line: Series, place: (x: number, y: number) => string): string[] {
  const found: string[][] = [[]];
  line.y.forEach((value, i) => {
    if (isFigure(value)) found[found.length - 1]!.push(place(line.x[i] ?? 0, value));
    else found.push([]);
  });
  return found
    .filter((run) => run.length)
    .map((run) => (run.length > 1 ? run : [run[0]!, run[0]!]).join(" "));
}

/** Lines with a scale at the left; the latest values stand in the key. */
export function chart(
  title: string,
  series: Series[],
  unit: string,
  options: { xUnit?: string; limits?: Range; xLimits?: Range; latest?: boolean } = {},
): HTMLElement {
  const x =
    options.xLimits ??
    range(
      series.flatMap((line) => line.x),
      false,
    );
  const y =
    options.limits ??
    range(
      series.flatMap((line) => line.y),
      true,
    );
  const drawing = svg("svg", {
    viewBox: `0 0 ${width} ${height}`,
    role: "img",
    "aria-label": title,
  });
  const atX = (value: number) => left + ((value - x.low) / (x.high - x.low)) * (width - left - 4);
  const atY = (value: number) =>
    height - bottom - ((value - y.low) / (y.high - y.low)) * (height - bottom - top);
  for (const value of [y.low, y.high]) {
    drawing.append(
      svg("line", { x1: left, x2: width - 4, y1: atY(value), y2: atY(value), class: "grid" }),
    );
    drawing.append(
      svg("text", { x: left - 4, y: atY(value) + 3, class: "scale end" }, compact(value)),
    );
  }
  drawing.append(svg("text", { x: left, y: height - 2, class: "scale" }, `${compact(x.low)}`));
  drawing.append(
    svg(
      "text",
      { x: width - 4, y: height - 2, class: "scale end" },
      `${compact(x.high)} ${options.xUnit ?? "s"}`,
    ),
  );
  series.forEach((line, index) => {
    for (const points of runs(line, (x, y) => `${atX(x).toFixed(1)},${atY(y).toFixed(1)}`))
      drawing.append(
        svg("polyline", {
          points,
          class: "line",
          stroke: colours[index % colours.length]!,
          "stroke-dasharray": dashes[index % dashes.length]!,
        }),
      );
  });
  const latest = (line: Series) => {
    const value = line.y[line.y.length - 1];
    return options.latest === false || !isFigure(value) ? "" : ` ${compact(value)}`;
  };
  const key = element(
    "p",
    { class: "keys" },
    series.map((line, index) =>
      element("span", { class: "key" }, [
        element("span", { class: "swatch", colour: colours[index % colours.length]! }),
        `${line.name}${latest(line)}`,
      ]),
    ),
  );
  return element("figure", { class: "chart" }, [
    element("figcaption", { text: unit ? `${title}, ${unit}` : title }),
    drawing,
    key,
  ]);
}
