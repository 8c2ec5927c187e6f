// Evaluation against ground truth: errors and the precision-recall curve.
import { element, fixed, short, table, terms } from "../dom";
import type { Evaluation, MapData } from "../data/format";
import type { App } from "./app";
import { chart } from "./charts";

export function evaluationPane({ state }: App, root: HTMLElement): void {
  state.on("map", () => {
    const evaluation = state.map!.evaluation;
    root.replaceChildren(
      ...(evaluation
        ? content(state.map!, evaluation)
        : [element("p", { class: "note", text: "This map has no evaluation." })]),
    );
  });
}

function content(map: MapData, evaluation: Evaluation): HTMLElement[] {
  return [
    summary(evaluation),
    errors(map, evaluation),
    labels(map, evaluation),
    curve(evaluation),
    notes(evaluation),
  ].filter((part) => part !== null);
}

const text = (value: unknown): string => {
  if (value === null) return "not known";
  return typeof value === "number" ? String(Number(value.toPrecision(4))) : String(value);
};

function summary(evaluation: Evaluation): HTMLElement | null {
  const rows = Object.entries(evaluation.summary ?? {}).map(([name, value]): [string, string] => [
    name.replaceAll("_", " "),
    text(value),
  ]);
  return rows.length ? element("section", {}, [terms(rows)]) : null;
}

const nameOf = (map: MapData, session: number): string =>
  map.sessions[session]?.name ?? String(session);

function errors(map: MapData, evaluation: Evaluation): HTMLElement | null {
  const rows = (evaluation.sessions ?? [])
    .filter((one) => typeof one.ATE_rmse_m === "number")
    .map((one) => [
      nameOf(map, one.session),
      fixed(one.ATE_rmse_m, 3),
      fixed(one.ATE_max_m, 3),
      String((evaluation.ate_m?.[one.session] ?? []).filter((value) => value !== null).length),
    ]);
  const series = (evaluation.ate_m ?? [])
    .map((list, index) => ({
      name: nameOf(map, index),
      x: list.flatMap((value, k) => (typeof value === "number" ? [k] : [])),
      y: list.filter((value): value is number => typeof value === "number"),
    }))
    .filter((line) => line.y.length);
  if (!series.length) return null;
  return element("section", {}, [
    element("h2", { text: "Absolute trajectory error, m" }),
    rows.length ? table(["session", "RMSE", "max", "keyframes"], rows) : null,
    chart("Error along the path", series, "m", { xUnit: "keyframe", latest: false }),
  ]);
}

/** Labels of points against the truth. The layers of the view have the wrong ones at their places. */
function labels(map: MapData, evaluation: Evaluation): HTMLElement | null {
  const rows = (evaluation.sessions ?? [])
    .filter((one) => one.false_static_points !== undefined)
    .map((one) => [
      nameOf(map, one.session),
      fixed(one.SA_percent, 2),
      fixed(one.DA_percent, 2),
      short(one.false_static_points ?? 0),
      short(one.false_dynamic_points ?? 0),
    ]);
  if (!rows.length) return null;
  const left = evaluation.points_left_out ?? 0;
  return element("section", {}, [
    element("h2", { text: "Labels" }),
    table(["session", "SA, %", "DA, %", "false static", "false dynamic"], rows),
    element("p", {
      class: "note",
      text: "The numbers count all points; View shows one of each voxel where it is.",
    }),
    left ? element("p", { class: "note", text: `Not in this file: ${short(left)} of them.` }) : null,
  ]);
}

function notes(evaluation: Evaluation): HTMLElement | null {
  const items = (evaluation.notes ?? []).map((note) => element("p", { class: "note", text: note }));
  return items.length ? element("section", {}, items) : null;
}

function curve(evaluation: Evaluation): HTMLElement | null {
  const points = evaluation.precision_recall ?? [];
  if (!points.length) return null;
  const unit = { low: 0, high: 1 };
  return element("section", {}, [
    element("h2", { text: "Precision over recall of loops" }),
    chart(
      "Precision",
      [
        {
          name: `${points.length} thresholds`,
          x: points.map((point) => point[1]!),
          y: points.map((point) => point[0]!),
        },
      ],
      "",
      { xUnit: "recall", limits: unit, xLimits: unit, latest: false },
    ),
  ]);
}
