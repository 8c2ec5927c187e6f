// Octree of tiles of generated points, as the contract of the page describes it.
import { gzipSync } from "node:zlib";

const samplesPerEdge = 64;
const leaf = 20_000;

/** Block of points: header, then columns. */
export function block(points, indices) {
  const count = indices.length;
  const low = [Infinity, Infinity, Infinity],
    high = [-Infinity, -Infinity, -Infinity];
  for (const i of indices)
    for (let axis = 0; axis < 3; ++axis) {
      const value = points.xyz[3 * i + axis];
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  const step = Math.max(
    0.001,
    (high[0] - low[0]) / 65535,
    (high[1] - low[1]) / 65535,
    (high[2] - low[2]) / 65535,
  );
  const buffer = Buffer.alloc(28 + 8 * count);
  buffer.write("UMPT", 0, "latin1");
  buffer.writeUInt32LE(1, 4);
  buffer.writeUInt32LE(count, 8);
  for (let axis = 0; axis < 3; ++axis) buffer.writeFloatLE(count ? low[axis] : 0, 12 + 4 * axis);
  buffer.writeFloatLE(step, 24);
  indices.forEach((i, row) => {
    for (let axis = 0; axis < 3; ++axis)
      buffer.writeUInt16LE(
        Math.min(65535, Math.round((points.xyz[3 * i + axis] - low[axis]) / step)),
        28 + 2 * (axis * count + row),
      );
    buffer[28 + 6 * count + row] = points.session[i];
    buffer[28 + 7 * count + row] = points.kind[i];
  });
  return { buffer, box: [...low, ...high] };
}

/** Rows of nodes for api/map, and the compressed tile of each key. */
export function octree(points) {
  const count = points.session.length;
  const low = [Infinity, Infinity, Infinity],
    high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < 3 * count; ++i) {
    low[i % 3] = Math.min(low[i % 3], points.xyz[i]);
    high[i % 3] = Math.max(high[i % 3], points.xyz[i]);
  }
  const size_m =
    2 ** Math.ceil(Math.log2(Math.max(...high.map((value, axis) => value - low[axis])) + 0.01));
  const nodes = [],
    tiles = new Map();
  const cells = new Uint32Array(samplesPerEdge ** 3);
  let stamp = 0;

  const place = (indices, key, origin, size) => {
    const kept = [],
      octants = Array.from({ length: 8 }, () => []);
    const fine = indices.length <= leaf || key.length > 10;
    stamp += 1;
    for (const i of indices) {
      let cell = 0,
        octant = 0;
      for (let axis = 0; axis < 3; ++axis) {
        const share = (points.xyz[3 * i + axis] - origin[axis]) / size;
        cell =
          cell * samplesPerEdge +
          Math.min(samplesPerEdge - 1, Math.max(0, Math.floor(share * samplesPerEdge)));
        if (share >= 0.5) octant |= 1 << axis;
      }
      if (fine || cells[cell] !== stamp) {
        cells[cell] = stamp;
        kept.push(i);
      } else {
        octants[octant].push(i);
      }
    }
    const made = block(points, kept);
    const compressed = gzipSync(made.buffer, { level: 1 });
    tiles.set(key, compressed);
    nodes.push([key, kept.length, compressed.length, made.box]);
    octants.forEach((inside, octant) => {
      if (inside.length)
        place(
          inside,
          key + octant,
          origin.map((value, axis) => value + (((octant >> axis) & 1) * size) / 2),
          size / 2,
        );
    });
  };
  place(
    Uint32Array.from({ length: count }, (_, i) => i),
    "r",
    low,
    size_m,
  );
  return { layer: { origin: low, size_m, nodes }, tiles };
}
