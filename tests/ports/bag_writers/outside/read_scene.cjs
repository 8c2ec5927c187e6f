// Reading of an exported scene by npm's @mcap/core: read_scene.cjs FILE
//
// FILE is what `unimapper export --mcap` wrote. Clouds are read by npm's @foxglove/rosmsg and
// @foxglove/rosmsg2-serialization.
'use strict';
const mcap = require('./mcap_file.cjs');
const {parse} = mcap.package('@foxglove/rosmsg');
const {MessageReader} = mcap.package('@foxglove/rosmsg2-serialization');

function require_true(holds, what) {
  if (!holds) throw new Error(what);
}

/// True if `value` has the types that a JSON schema names, its members among those of the schema.
function conforms(value, schema) {
  if (schema.oneOf) return schema.oneOf.some((choice) => choice.const === value);
  switch (schema.type) {
    case 'object':
      return typeof value === 'object' && !Array.isArray(value) &&
          Object.keys(schema.properties || {}).every((name) => name in value) &&
          Object.entries(value).every(([name, member]) => schema.properties &&
                                          name in schema.properties &&
                                          conforms(member, schema.properties[name]));
    case 'array':
      return Array.isArray(value) && value.every((item) => conforms(item, schema.items));
    case 'integer':
      return Number.isInteger(value) && value >= (schema.minimum ?? -Infinity) &&
          value <= (schema.maximum ?? Infinity);
    default:
      return typeof value === schema.type;
  }
}

/// Checks the points of a PointCloud2.
function check_cloud(topic, cloud) {
  require_true(cloud.header.frame_id === 'odometry', `${topic}: frame ${cloud.header.frame_id}`);
  require_true(cloud.data.length === cloud.width * cloud.point_step, `${topic}: bytes of points`);
  const names = cloud.fields.map((field) => field.name).join(' ');
  require_true(names === (topic === '/static' ? 'x y z intensity' : 'x y z rgba'), `${topic}: ${names}`);
  if (topic !== '/static') return;
  require_true(cloud.width > 100, `${cloud.width} static points`);
  require_true(cloud.point_step <= 13, `${cloud.point_step} bytes a point`);
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  for (let i = 0; i < cloud.width; ++i) {
    const x = view.getFloat32(i * cloud.point_step, true);
    require_true(Math.abs(x) < 300, `x of point ${i}: ${x}`);
  }
}

async function main(name) {
  const {reader} = await mcap.open(name);
  const counts = {};
  for await (const message of reader.readMessages({validateCrcs: true})) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    const description = new TextDecoder().decode(schema.data);
    counts[channel.topic] = (counts[channel.topic] || 0) + 1;
    const encodings = `${channel.messageEncoding} ${schema.encoding}`;
    if (schema.name === 'sensor_msgs/msg/PointCloud2') {
      require_true(encodings === 'cdr ros2msg', `${channel.topic}: ${encodings}`);
      const cdr = new MessageReader(parse(description, {ros2: true}));
      check_cloud(channel.topic, cdr.readMessage(message.data));
      continue;
    }
    require_true(encodings === 'json jsonschema', `${channel.topic}: ${encodings}`);
    const value = JSON.parse(new TextDecoder().decode(message.data));
    require_true(JSON.parse(description).title === schema.name, schema.name);
    require_true(conforms(value, JSON.parse(description)), `${channel.topic} is no ${schema.name}`);
  }
  for (const topic of ['/static', '/removed', '/loops', '/run/trajectory']) {
    require_true(counts[topic] === 1, `${topic}: ${counts[topic]} messages`);
  }
  require_true(counts['/tf'] > 1 && counts['/tf'] === counts['/run/pose'], 'poses over time');
  console.log(JSON.stringify(counts));
}

mcap.run(main);
