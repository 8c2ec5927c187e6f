// Generated map of the town: sessions, loops, changes, layers, evaluation.
import { relative } from "./keyframes.mjs";
import { octree } from "./octree_builder.mjs";
import { car, ground, path, random, routes, sample, surfaces } from "./town.mjs";

const names = ["ouster", "avia", "velodyne", "handheld", "cart"];
const sensors = ["OS2-128", "Avia", "VLP-16", "Mid-360", "OS0-32"];

function removedSurfaces() {
  const next = random(11),
    made = [];
  for (let i = 0; i < 60; ++i) {
    const along = 230 * next(),
      lane = 7 + 76 * Math.floor(3 * next());
    for (let k = 0; k < 3; ++k)
      next() < 0.5
        ? car(made, along + 3 * k, lane + 1.6, 0)
        : car(made, lane - 1.6, along + 3 * k, Math.PI / 2);
  }
  return made;
}

function loopsOf(paths) {
  const next = random(3),
    loops = [];
  for (let query = 0; query < 4; ++query)
    for (let k = 0; k < paths[query].length; k += 5)
      for (let match = 0; match < query; ++match) {
        const near = paths[match].findIndex(
          (pose) => Math.hypot(pose[0] - paths[query][k][0], pose[1] - paths[query][k][1]) < 5,
        );
        if (near < 0 || next() < 0.3) continue;
        const state = query === 3 ? "provisional" : next() < 0.8 ? "accepted" : "refused";
        loops.push(loop([query, k], [match, near], state, paths, next));
      }
  for (let i = 0; i < 9; ++i) {
    const query = [2, Math.floor(paths[2].length * next())],
      match = [0, Math.floor(paths[0].length * next())];
    loops.push(loop(query, match, "refused", paths, next));
  }
  return loops;
}

function loop(query, match, state, paths, next) {
  const T_match_query = relative(paths[match[0]][match[1]], paths[query[0]][query[1]]);
  const error = state === "refused" ? 6 : 0.05;
  T_match_query[0] += error * (next() - 0.5);
  T_match_query[1] += error * (next() - 0.5);
  const reasons = {
    accepted: "consistent with 14 others",
    provisional: "other loops explain this pair as well",
    refused: "contradicts accepted loops",
  };
  return {
    query,
    match,
    state,
    reason: reasons[state],
    overlap: state === "refused" ? 0.2 + 0.3 * next() : 0.6 + 0.35 * next(),
    confidence: state === "refused" ? 0.2 : 0.6 + 0.4 * next(),
    T_match_query,
    residual_m: state === "refused" ? 1.4 * next() : 0.02 + 0.08 * next(),
    residual_deg: 0.1 + 0.5 * next(),
    weak_axes: next() < 0.15 ? 1 : 0,
    by_person: false,
    statement: null,
  };
}

function changesOf() {
  const next = random(5),
    kinds = ["appeared", "gone", "moved"];
  return Array.from({ length: 18 }, (_, i) => {
    const kind = kinds[i % 3],
      x = 20 + 190 * next(),
      y = [11, 87, 163][i % 3] + 1.5;
    const box = {
      centre: [x, y, ground(x, y) + 0.9],
      size: [4.4, 1.8, 1.5],
      heading: 0.1 * next(),
    };
    return {
      kind,
      session: 1 + (i % 2),
      free_in: 0,
      box,
      before: kind === "moved" ? { ...box, centre: [x - 9, y, ground(x - 9, y) + 0.9] } : null,
      confidence: 0.55 + 0.44 * next(),
    };
  });
}

function session(index, poses) {
  const merged = index < 3;
  return {
    name: names[index],
    robot: index + 1,
    sensor: sensors[index],
    status:
      index === 0 ? "central" : merged ? "merged" : index === 3 ? "provisional" : "unconnected",
    reason: merged
      ? ""
      : index === 3
        ? "9 loops, 4 consistent: others explain the pair as well"
        : "no loops with other sessions",
    provisional_pose: index === 3 ? [0, 0, 0, 0, 0, 0, 1] : null,
    sequences: poses.map((_, k) => k),
    stamps_s: poses.map((_, k) => +(0.8 * k).toFixed(2)),
    poses,
    sigma_m: poses.map((_, k) => 0.05 + 0.25 * Math.abs(Math.sin(k / 40))),
  };
}

/** A town of so many static points. */
export function scene(points = 2_000_000) {
  const paths = routes.map(path),
    merged = paths.slice(0, 3);
  const clouds = {
    static: sample(surfaces, points, merged, 1),
    removed: sample(
      removedSurfaces(),
      Math.round(points / 25),
      merged,
      2,
      (next) => (next() < 0.7 ? 1 : 3),
    ),
    changes: sample(removedSurfaces().slice(0, 90), 20_000, merged, 4, (next) =>
      Math.floor(3 * next()),
    ),
    false_static: sample(removedSurfaces().slice(100, 160), 9_000, merged, 6, () => 0),
    false_dynamic: sample(surfaces.slice(1, 40), 9_000, merged, 8, () => 0),
  };
  const layers = {},
    tiles = {};
  for (const [name, cloud] of Object.entries(clouds)) {
    const made = octree(cloud);
    layers[name] = made.layer;
    tiles[name] = made.tiles;
  }
  const map = {
    format: 1,
    title: "town",
    source: "store",
    epoch: 7,
    can_change: true,
    georeference: null,
    epochs: [1, 2, 3, 4, 5, 6, 7].map((number) => ({
      number,
      parent: number - 1,
      made_s: 1764000000 + 4000 * number,
      command: "merge",
      outcome: `merged ${Math.min(3, number)} of 5 sessions`,
    })),
    sessions: paths.map((poses, index) => session(index, poses)),
    loops: loopsOf(paths),
    changes: changesOf(),
    pairs: [
      { match: 0, query: 1, state: "confirmed", reason: "", loops: 31, consistent: 29 },
      { match: 0, query: 2, state: "confirmed", reason: "", loops: 40, consistent: 33 },
      {
        match: 2,
        query: 3,
        state: "provisional",
        reason: "others explain the pair as well",
        loops: 9,
        consistent: 4,
      },
    ],
    layers,
    timing: {
      load: "generated, no measurement",
      stages: [
        { stage: "loops", seconds: 4.21 },
        { stage: "poses", seconds: 0.32 },
        { stage: "refinement", seconds: 2.9 },
        { stage: "changes", seconds: 1.13 },
      ],
    },
    online: [0, 1, 2].map((index) => ({
      session: index,
      p50_ms: 11.2 + index,
      p99_ms: 19.4 + index,
      max_ms: 28.1,
      load: "real-time rate",
    })),
    evaluation: {
      ate_m: merged.map((poses) => poses.map((_, k) => 0.04 + 0.16 * Math.abs(Math.sin(k / 30)))),
      summary: { largest_ATE_rmse_m: 0.12, SA_percent: 99.1, DA_percent: null },
      sessions: merged.map((_, session) => ({
        session,
        ATE_rmse_m: 0.12,
        ATE_max_m: 0.2,
        SA_percent: 99.1,
        DA_percent: null,
        false_static_points: 9000,
        false_dynamic_points: 9000,
      })),
      notes: ["handheld: no truth was named, so it is not evaluated"],
      precision_recall: Array.from({ length: 20 }, (_, i) => [
        1 - 0.35 * (i / 19) ** 3,
        0.2 + 0.8 * (i / 19),
        1 - i / 19,
      ]),
    },
  };
  return { map, tiles, cloud: clouds.static, removed: clouds.removed };
}
