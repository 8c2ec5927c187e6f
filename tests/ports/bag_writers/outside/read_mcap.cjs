// Reading of a simulated MCAP recording by npm's @mcap/core: read_mcap.cjs RECORDING
//
// RECORDING is a folder that `unimapper simulate --distortion --bag mcap` wrote.
'use strict';
const fs = require('fs');
const path = require('path');
const mcap = require('./mcap_file.cjs');

function require_equal(found, expected, what) {
  if (found !== expected) throw new Error(`${what}: ${found} instead of ${expected}`);
}

/// Checks the points of a PointCloud2 in CDR, which its last flag follows, against the recording's
/// scan: x, y, z and intensity of each.
function compare_points(data, scan) {
  const pointBytes = 22;
  const points = scan.length / 16;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const begin = data.byteLength - 1 - points * pointBytes;
  require_equal(view.getUint32(begin - 4, true), points * pointBytes, 'bytes of points');
  for (let i = 0; i < points; ++i) {
    for (let k = 0; k < 4; ++k) {
      require_equal(view.getUint32(begin + i * pointBytes + 4 * k, true),
                    scan.readUInt32LE(16 * i + 4 * k), `number ${k} of point ${i}`);
    }
  }
}

async function main(recording) {
  const {file, reader} = await mcap.open(path.join(recording, 'drive.mcap'));
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
    compare_points(message.data, fs.readFileSync(path.join(recording, 'scans', scans[clouds++])));
  }
  require_equal(read, Number(reader.statistics.messageCount), 'messages read');
  // From front to back too, which needs no index and checks the checksums.
  const stream = new mcap.core.McapStreamReader({validateCrcs: true});
  stream.append(file);
  let records = 0;
  for (let record; (record = stream.nextRecord());) records += record.type === 'Message' ? 1 : 0;
  require_equal(stream.done(), true, 'end of the file');
  require_equal(records, read, 'messages of the stream');
  console.log(`${read} messages, ${clouds} clouds equal to the scans`);
}

mcap.run(main);
