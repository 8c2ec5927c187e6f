// A small recording as an MCAP file, written by npm's @mcap/core with messages serialized by
// @foxglove/rosmsg2-serialization and chunks compressed by the programs lz4 and zstd: none of it
// is this project's code. The test reads the committed file, not this script.
//   npm install @mcap/core @foxglove/rosmsg-msgs-common @foxglove/rosmsg2-serialization
//   node make_mcap.mjs drive.mcap
// Four scans from 100 s on, 0.1 s apart; odometry every 20 ms from 99.94 s to 100.24 s, 10 m/s
// along x: the last scan has no pose. The LiDAR is 0.5 m ahead of the base and 1.2 m above it,
// turned left by 90 degrees.
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { createRequire } from "node:module";
const require = createRequire(process.cwd() + "/");
const { McapWriter } = require("@mcap/core");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");
const compressed = (program, data) => ({ compression: program,
  compressedData: execFileSync(program, ["-c"], { input: Buffer.from(data) }) });

const stampOf = (ns) => ({ sec: Number(ns / 1000000000n), nanosec: Number(ns % 1000000000n) });
const header = (ns, frame_id) => ({ stamp: stampOf(ns), frame_id });

function definitions(type) {
  const found = new Map();
  const add = (name) => {
    if (found.has(name)) return;
    const definition = ros2humble[name] ?? ros2humble[name.replace("/msg/", "/")];
    found.set(name, { ...definition, name });
    for (const field of definition.definitions) if (field.isComplex) add(field.type);
  };
  add(type);
  return [...found.values()];
}

class Memory {
  parts = [];
  size = 0n;
  position() { return this.size; }
  async write(bytes) { this.parts.push(Buffer.from(bytes)); this.size += BigInt(bytes.byteLength); }
}

let chunks = 0;
const memory = new Memory();
const writer = new McapWriter({
  writable: memory,
  chunkSize: 1500,
  compressChunk: (data) => compressed(chunks++ % 2 === 0 ? "lz4" : "zstd", data),
});
await writer.start({ profile: "ros2", library: "" });
const channels = {};
async function channel(topic, type) {
  // The text of the definition is left out to keep the file small: readers go by the name.
  const schemaId = await writer.registerSchema({ name: type, encoding: "ros2msg", data: new Uint8Array() });
  const id = await writer.registerChannel({ schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
  channels[topic] = { id, message: new MessageWriter(definitions(type)), sequence: 0 };
}
await channel("/points", "sensor_msgs/msg/PointCloud2");
await channel("/odom", "nav_msgs/msg/Odometry");
await channel("/tf_static", "tf2_msgs/msg/TFMessage");
await channel("/rosout", "std_msgs/msg/String");

async function write(topic, ns, message) {
  const to = channels[topic];
  await writer.addMessage({ channelId: to.id, sequence: to.sequence++, logTime: ns, publishTime: ns,
    data: to.message.writeMessage(message) });
}

const second = 1000000000n;
const zero36 = new Float64Array(36);
function cloud(ns) {
  const step = 22;
  const data = new DataView(new ArrayBuffer(3 * step));
  const points = [[1, 2, 3, 10, 0, 0], [NaN, NaN, NaN, 0, 50000000, 1], [4, 5, 6, 20, 99000000, 2]];
  points.forEach(([x, y, z, intensity, t, ring], i) => {
    [x, y, z, intensity].forEach((value, k) => data.setFloat32(i * step + 4 * k, value, true));
    data.setUint32(i * step + 16, t, true);
    data.setUint16(i * step + 20, ring, true);
  });
  const field = (name, offset, datatype) => ({ name, offset, datatype, count: 1 });
  return { header: header(ns, "lidar"), height: 1, width: 3,
    fields: [field("x", 0, 7), field("y", 4, 7), field("z", 8, 7), field("intensity", 12, 7),
      field("t", 16, 6), field("ring", 20, 4)],
    is_bigendian: false, point_step: step, row_step: 3 * step, data: new Uint8Array(data.buffer),
    is_dense: false };
}
await write("/tf_static", 99n * second, { transforms: [{ header: header(99n * second, "base_link"),
  child_frame_id: "lidar", transform: { translation: { x: 0.5, y: 0, z: 1.2 },
    rotation: { x: 0, y: 0, z: Math.SQRT1_2, w: Math.SQRT1_2 } } }] });
await write("/rosout", 99n * second, { data: "not read" });
for (let ms = -60n; ms <= 300n; ms += 20n) {
  const ns = 100n * second + ms * 1000000n;
  if (ms <= 240n) {
    await write("/odom", ns, { header: header(ns, "odom"), child_frame_id: "base_link",
      pose: { pose: { position: { x: Number(ms) * 0.01, y: 0, z: 0 },
        orientation: { x: 0, y: 0, z: 0, w: 1 } }, covariance: zero36 },
      twist: { twist: { linear: { x: 10, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } },
        covariance: zero36 } });
  }
  // A scan is recorded when it is complete.
  if (ms % 100n === 0n && ms >= 0n) await write("/points", ns + 100000000n, cloud(ns));
}
await writer.end();
writeFileSync(process.argv[2], Buffer.concat(memory.parts));
console.log(`${memory.size} bytes, ${chunks} chunks`);
