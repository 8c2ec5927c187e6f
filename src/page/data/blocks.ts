// Decoding of a block of points.

/** Points in the frame of their block: position = origin + step * value. */
export interface Block {
  count: number;
  origin: [number, number, number];
  step: number;
  /** x, y, z, session + 256 * kind for each point, as the graphics card reads them. */
  packed: Uint16Array;
  /** Of each point, 0 is unknown; null where all are. */
  intensity: Uint8Array | null;
}

const headerBytes = 28;
const bytesPerPoint = 8;
const magic = 0x54504d55; // "UMPT"

export function decodeBlock(buffer: ArrayBuffer): Block {
  if (buffer.byteLength < headerBytes)
    throw new Error(`block of points is cut off at ${buffer.byteLength} bytes`);
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== magic) throw new Error("not a block of points");
  const version = view.getUint32(4, true);
  if (version !== 1 && version !== 2)
    throw new Error(`block of points has version ${version}; this page reads versions 1 and 2`);
  const count = view.getUint32(8, true);
  const known = headerBytes + bytesPerPoint * count;
  const bytes = version === 2 ? known + count : known;
  if (buffer.byteLength !== bytes)
    throw new Error(
      `block of ${count} points has ${buffer.byteLength} bytes instead of ${bytes}`,
    );
  const origin: [number, number, number] = [
    view.getFloat32(12, true),
    view.getFloat32(16, true),
    view.getFloat32(20, true),
  ];
  const step = view.getFloat32(24, true);
  if (![...origin, step].every(Number.isFinite))
    throw new Error("block of points has no finite origin");
  const intensity = version === 2 ? new Uint8Array(buffer, known, count) : null;
  return { count, origin, step, packed: packed(buffer, count), intensity };
}

/** Columns to rows: one attribute of 8 bytes is aligned for every graphics card. */
function packed(buffer: ArrayBuffer, count: number): Uint16Array {
  const column = (index: number) => new Uint16Array(buffer, headerBytes + 2 * count * index, count);
  const [x, y, z] = [column(0), column(1), column(2)];
  const session = new Uint8Array(buffer, headerBytes + 6 * count, count);
  const kind = new Uint8Array(buffer, headerBytes + 7 * count, count);
  const rows = new Uint16Array(4 * count);
  for (let i = 0, j = 0; i < count; ++i, j += 4) {
    rows[j] = x[i]!;
    rows[j + 1] = y[i]!;
    rows[j + 2] = z[i]!;
    rows[j + 3] = session[i]! + 256 * kind[i]!;
  }
  return rows;
}
