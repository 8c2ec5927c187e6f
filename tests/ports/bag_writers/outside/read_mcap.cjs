// Reading of a simulated MCAP recording by npm's @mcap/core: read_mcap.cjs RECORDING
//
// RECORDING is a folder that `unimapper simulate --distortion --bag mcap` wrote. Ends with 77 where
// the package is missing.
'use strict';
const fs = require('fs');
const path = require('path');

let mcap;
try {
  mcap = require('@mcap/core');
} catch (error) {
  console.log('skipped: npm has no @mcap/core here (npm install @mcap/core; NODE_PATH)');
  process.exit(77);
}

function require_equal(found, expected, what) {
  if (found !== expected) throw new Error(`${what}: ${found} instead of ${expected}`);
}

/// CDR, little endian: numbers aligned from behind the encapsulation header.
class Cdr {
  constructor(data) {
    this.view = new DataView(data.buffer, data.byteOffset + 4, data.byteLength - 4);
    this.at = 0;
  }
  uint8() { return this.view.getUint8(this.at++); }
  align(size) { this.at = Math.ceil(this.at / size) * size; }
  uint32() { this.align(4); this.at += 4; return this.view.getUint32(this.at - 4, true); }
  text() {
    const length = this.uint32();
    let text = '';
    for (let i = 0; i < length - 1; ++i) text += String.fromCharCode(this.uint8());
    this.uint8();
    return text;
  }
}

/// Checks a PointCloud2 against the bytes of the recording's scan; returns its fields' names.
function compare_cloud(data, scan) {
  const cdr = new Cdr(data);
  cdr.uint32(); cdr.uint32();
  require_equal(cdr.text(), 'lidar', 'frame');
  require_equal(cdr.uint32(), 1, 'height');
  const width = cdr.uint32();
  require_equal(width, scan.length / 16, 'points');
  const names = [];
  for (let field = cdr.uint32(); field > 0; --field) {
    names.push(cdr.text());
    cdr.uint32(); cdr.uint8(); cdr.uint32();
  }
  cdr.uint8();
  const step = cdr.uint32();
  cdr.uint32();
  require_equal(cdr.uint32(), step * width, 'bytes');
  for (let i = 0; i < width; ++i) {
    for (let k = 0; k < 4; ++k) {
      require_equal(cdr.view.getUint32(cdr.at + i * step + 4 * k, true),
                    scan.readUInt32LE(16 * i + 4 * k), `number ${k} of point ${i}`);
    }
  }
  return names.join(' ');
}

async function main(recording) {
  const file = fs.readFileSync(path.join(recording, 'drive.mcap'));
  const readable = {
    size: async () => BigInt(file.length),
    read: async (offset, size) =>
        new Uint8Array(file.subarray(Number(offset), Number(offset + size))),
  };
  const reader = await mcap.McapIndexedReader.Initialize({readable});
  const scans = fs.readdirSync(path.join(recording, 'scans')).sort();
  const expected = {
    '/points': ['sensor_msgs/msg/PointCloud2', scans.length],
    '/odom': ['nav_msgs/msg/Odometry', 10 * scans.length + 1],
    '/tf': ['tf2_msgs/msg/TFMessage', 10 * scans.length + 1],
    '/tf_static': ['tf2_msgs/msg/TFMessage', 1],
  };
  require_equal(reader.header.profile, 'ros2', 'profile');
  require_equal(reader.channelsById.size, 4, 'channels');
  for (const channel of reader.channelsById.values()) {
    const [type, messages] = expected[channel.topic];
    require_equal(reader.schemasById.get(channel.schemaId).name, type, channel.topic);
    require_equal(Number(reader.statistics.channelMessageCounts.get(channel.id)), messages,
                  channel.topic);
  }
  let read = 0, last = 0n, clouds = 0;
  for await (const message of reader.readMessages()) {
    if (message.logTime < last) throw new Error('messages out of order');
    last = message.logTime;
    ++read;
    if (reader.channelsById.get(message.channelId).topic !== '/points') continue;
    const names =
        compare_cloud(message.data, fs.readFileSync(path.join(recording, 'scans', scans[clouds++])));
    require_equal(names, 'x y z intensity ring time', 'fields');
  }
  require_equal(read, Number(reader.statistics.messageCount), 'messages read');
  // From front to back too, which needs no index and checks the checksums.
  const stream = new mcap.McapStreamReader({validateCrcs: true});
  stream.append(file);
  let records = 0;
  for (let record; (record = stream.nextRecord());) records += record.type === 'Message' ? 1 : 0;
  require_equal(stream.done(), true, 'end of the file');
  require_equal(records, read, 'messages of the stream');
  console.log(`${read} messages, ${clouds} clouds equal to the scans`);
}

main(process.argv[2]).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
