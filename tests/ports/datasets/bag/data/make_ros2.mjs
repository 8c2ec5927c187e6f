// A small recording as an MCAP file, and as bags of ROS 2 in SQLite whose messages or whose whole
// file is compressed. npm's @foxglove/rosmsg2-serialization writes the messages, @mcap/core the MCAP
// file, the program sqlite3 the databases; lz4 and zstd compress. None of it is this project's code.
// The tests read the committed files, not this script.
//   npm install @mcap/core @foxglove/rosmsg-msgs-common @foxglove/rosmsg2-serialization
//   node make_ros2.mjs        writes drive.mcap, drive_zstd.db3 and drive_0.db3.zstd
// Four scans from 100 s on, 0.1 s apart; odometry every 20 ms from 99.94 s to 100.24 s, 10 m/s
// along x: the last scan has no pose. The LiDAR is 0.5 m ahead of the base and 1.2 m above it,
// turned left by 90 degrees.
import { execFileSync } from "node:child_process";
import { rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
const require = createRequire(process.cwd() + "/");
const { McapWriter } = require("@mcap/core");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");
const packed = (program, data) => execFileSync(program, ["-c"], { input: Buffer.from(data) });

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

const parts = [];
let size = 0n;
let chunks = 0;
const writer = new McapWriter({
  writable: {
    position: () => size,
    write: async (bytes) => { parts.push(Buffer.from(bytes)); size += BigInt(bytes.byteLength); },
  },
  chunkSize: 1500,
  compressChunk: (data) => {
    const compression = chunks++ % 2 === 0 ? "lz4" : "zstd";
    return { compression, compressedData: packed(compression, data) };
  },
});
await writer.start({ profile: "ros2", library: "" });
const channels = {};
async function channel(topic, type) {
  // The text of the definition is left out to keep the file small: readers go by the name.
  const schemaId = await writer.registerSchema({ name: type, encoding: "ros2msg", data: new Uint8Array() });
  const id = await writer.registerChannel({ schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
  channels[topic] = { id, type, message: new MessageWriter(definitions(type)), sequence: 0 };
}
await channel("/points", "sensor_msgs/msg/PointCloud2");
await channel("/odom", "nav_msgs/msg/Odometry");
await channel("/tf_static", "tf2_msgs/msg/TFMessage");
await channel("/rosout", "std_msgs/msg/String");

const messages = [];
async function write(topic, ns, message) {
  const to = channels[topic];
  const data = to.message.writeMessage(message);
  messages.push({ id: to.id, ns, data });
  await writer.addMessage({ channelId: to.id, sequence: to.sequence++, logTime: ns, publishTime: ns,
    data });
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
writeFileSync("drive.mcap", Buffer.concat(parts));

// Tables and columns are rosbag2's.
function writeDatabase(file, pack) {
  rmSync(file, { force: true });
  const topics = Object.entries(channels).map(([topic, { id, type }]) =>
    `INSERT INTO topics VALUES(${id + 1}, '${topic}', '${type}', 'cdr', '');`);
  const rows = messages.map(({ id, ns, data }) =>
    `INSERT INTO messages VALUES(NULL, ${id + 1}, ${ns}, X'${Buffer.from(pack(data)).toString("hex")}');`);
  execFileSync("sqlite3", [file], { input: `
PRAGMA page_size = 512;
BEGIN;
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
INSERT INTO schema VALUES(3, 'humble');
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,
  metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
  timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
${topics.concat(rows).join("\n")}
COMMIT;
` });
}
writeDatabase("drive_zstd.db3", (data) => packed("zstd", data));
writeDatabase("drive_0.db3", (data) => data);
execFileSync("zstd", ["--rm", "-f", "drive_0.db3", "-o", "drive_0.db3.zstd"]);
