// Generated town with the paths of sessions through it.

/** Repeatable random numbers in 0..1 (mulberry32). */
export function random(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let value = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    value = (value + Math.imul(value ^ (value >>> 7), 61 | value)) ^ value;
    return ((value ^ (value >>> 14)) >>> 0) / 4294967296;
  };
}

const block_m = 62,
  street_m = 14,
  pitch = block_m + street_m,
  blocks = 3;
export const ground = (x, y) => 1.6 * Math.sin(x / 55) + 1.2 * Math.cos(y / 70);

const rectangle = (x, y, z, ux, uy, uz, vx, vy, vz) => ({
  x,
  y,
  z,
  ux,
  uy,
  uz,
  vx,
  vy,
  vz,
  area: Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx),
});

function house(surfaces, x, y, w, d, h, windows) {
  const z = ground(x + w / 2, y + d / 2) - 0.5;
  for (const [ox, oy, ux, uy] of [
    [x, y, w, 0],
    [x, y + d, w, 0],
    [x, y, 0, d],
    [x + w, y, 0, d],
  ])
    surfaces.push({ ...rectangle(ox, oy, z, ux, uy, 0, 0, 0, h), windows });
  const ridge = h + 0.35 * d;
  surfaces.push(rectangle(x - 0.4, y - 0.4, z + h, w + 0.8, 0, 0, 0, d / 2 + 0.4, ridge - h));
  surfaces.push(rectangle(x - 0.4, y + d + 0.4, z + h, w + 0.8, 0, 0, 0, -d / 2 - 0.4, ridge - h));
}

function tree(surfaces, x, y, size) {
  const z = ground(x, y);
  surfaces.push({ sphere: [x, y, z + 2 + size, size], area: 5 * size * size });
  surfaces.push({ sphere: [x, y, z + 1.2, 0.35, 3.4], area: 3 });
}

export function car(surfaces, x, y, heading) {
  const z = ground(x, y) + 0.25,
    cos = Math.cos(heading),
    sin = Math.sin(heading);
  const side = (dx, dy, lx, ly, h, z0) =>
    surfaces.push(
      rectangle(
        x + cos * dx - sin * dy,
        y + sin * dx + cos * dy,
        z + z0,
        cos * lx - sin * ly,
        sin * lx + cos * ly,
        0,
        0,
        0,
        h,
      ),
    );
  side(-2.2, -0.9, 4.4, 0, 0.8, 0);
  side(-2.2, 0.9, 4.4, 0, 0.8, 0);
  side(-2.2, -0.9, 0, 1.8, 0.8, 0);
  side(2.2, -0.9, 0, 1.8, 0.8, 0);
  side(-1.4, -0.8, 2.6, 0, 0.6, 0.8);
  side(-1.4, 0.8, 2.6, 0, 0.6, 0.8);
  surfaces.push(
    rectangle(
      x - cos * 1.4 + sin * 0.8,
      y - sin * 1.4 - cos * 0.8,
      z + 1.4,
      cos * 2.6,
      sin * 2.6,
      0,
      -sin * 1.6,
      cos * 1.6,
      0,
    ),
  );
}

function town() {
  const next = random(7),
    surfaces = [];
  const extent = blocks * pitch + street_m;
  surfaces.push({ ...rectangle(-20, -20, 0, extent + 40, 0, 0, 0, extent + 40, 0), ground: true });
  for (let bx = 0; bx < blocks; ++bx)
    for (let by = 0; by < blocks; ++by) {
      const x0 = street_m + bx * pitch,
        y0 = street_m + by * pitch;
      for (let side = 0; side < 2; ++side)
        for (let at = 2; at < block_m - 14; ) {
          const w = 11 + 9 * next(),
            d = 9 + 3 * next(),
            h = 5 + 9 * next();
          if (next() < 0.82)
            house(surfaces, x0 + at, side ? y0 + block_m - d - 3 : y0 + 3, w, d, h, true);
          at += w + 1 + 5 * next();
        }
      for (let i = 0; i < 9; ++i)
        tree(
          surfaces,
          x0 + 4 + (block_m - 8) * next(),
          y0 + 18 + (block_m - 36) * next(),
          1.6 + 1.8 * next(),
        );
      for (let i = 0; i < 5; ++i) tree(surfaces, x0 - 2, y0 + 6 + 12 * i, 1.2 + 0.5 * next());
      for (let i = 0; i < 6; ++i) if (next() < 0.6) car(surfaces, x0 + 6 + 9 * i, y0 - 2.4, 0);
    }
  return surfaces;
}

const corner = (bx, by) => [bx * pitch + street_m / 2, by * pitch + street_m / 2];
/** Corners of the streets that each session drives. */
export const routes = [
  [corner(0, 0), corner(2, 0), corner(2, 2), corner(0, 2), corner(0, 0), corner(1, 0)],
  [corner(1, 0), corner(1, 2), corner(3, 2), corner(3, 1), corner(1, 1), corner(1, 0.4)],
  [corner(0, 1), corner(3, 1), corner(3, 3), corner(1, 3), corner(1, 1), corner(0.4, 1)],
  [corner(2, 2), corner(2, 3), corner(3, 3)],
  [corner(0, 3), corner(1, 3)],
];
const spacing_m = 2;

/** Poses along a route, every 2 m, as x, y, z, quaternion. */
export function path(route) {
  const poses = [];
  for (let leg = 1; leg < route.length; ++leg) {
    const [ax, ay] = route[leg - 1],
      [bx, by] = route[leg];
    const length = Math.hypot(bx - ax, by - ay),
      heading = Math.atan2(by - ay, bx - ax);
    for (let at = 0; at < length; at += spacing_m) {
      const x = ax + ((bx - ax) * at) / length + 1.5 * Math.sin(heading),
        y = ay + ((by - ay) * at) / length - 1.5 * Math.cos(heading);
      poses.push([x, y, ground(x, y) + 1.8, 0, 0, Math.sin(heading / 2), Math.cos(heading / 2)]);
    }
  }
  return poses;
}

/** Points on surfaces near the paths: xyz, session, kind (by default the number of sessions near). */
export function sample(surfaces, wanted, paths, seed, kindOf) {
  const next = random(seed),
    total = surfaces.reduce((sum, surface) => sum + surface.area, 0);
  const xyz = new Float32Array(3 * wanted),
    session = new Uint8Array(wanted),
    kind = new Uint8Array(wanted);
  const near = nearness(paths);
  let count = 0;
  while (count < wanted)
    for (const surface of surfaces) {
      const tries = (surface.area / total) * wanted;
      for (let i = Math.floor(tries + next()); i > 0 && count < wanted; --i) {
        const point = on(surface, next);
        const seen = point && near(point[0], point[1], next);
        if (!seen) continue;
        xyz.set(point, 3 * count);
        session[count] = seen.session;
        kind[count] = kindOf ? kindOf(next) : seen.visits;
        count += 1;
      }
    }
  return { xyz, session, kind };
}

function on(surface, next) {
  if (surface.sphere) {
    const [x, y, z, radius, tall = 2] = surface.sphere;
    const height = 2 * next() - 1,
      turn = 2 * Math.PI * next(),
      wide = Math.sqrt(1 - height * height) * radius * (0.8 + 0.25 * next());
    return [
      x + wide * Math.cos(turn),
      y + wide * Math.sin(turn),
      z + (tall === 2 ? height * radius : (height * tall) / 2),
    ];
  }
  const u = next(),
    v = next();
  const point = [
    surface.x + u * surface.ux + v * surface.vx,
    surface.y + u * surface.uy + v * surface.vy,
    surface.z + u * surface.uz + v * surface.vz,
  ];
  if (
    surface.windows &&
    (u * Math.hypot(surface.ux, surface.uy)) % 3 > 1.8 &&
    (v * surface.vz) % 3 > 1.5
  )
    return null;
  if (surface.ground) point[2] = ground(point[0], point[1]) + (next() - 0.5) * 0.03;
  return point;
}

/** Which session sees a place: by distance to its path, on a grid of 2 m. */
function nearness(paths) {
  const size = 160,
    cell = 2,
    origin = -40;
  const distances = paths.map((poses) => {
    const grid = new Float32Array(size * size).fill(1e9);
    for (let i = 0; i < size * size; ++i) {
      const x = origin + cell * (i % size),
        y = origin + cell * Math.floor(i / size);
      for (let k = 0; k < poses.length; k += 2)
        grid[i] = Math.min(grid[i], Math.hypot(poses[k][0] - x, poses[k][1] - y));
    }
    return grid;
  });
  return (x, y, next) => {
    const at = Math.round((x - origin) / cell) + size * Math.round((y - origin) / cell);
    let visits = 0,
      first = -1;
    distances.forEach((grid, index) => {
      const chance = Math.min(1, Math.max(0.02, 2.6 - grid[at] / 12));
      if (!(grid[at] < 60) || next() > chance) return;
      visits += 1;
      if (first < 0) first = index;
    });
    return visits ? { session: first, visits } : null;
  };
}

export const surfaces = town();
