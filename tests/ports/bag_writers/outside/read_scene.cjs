// Reading of an exported scene by npm's @mcap/core: read_scene.cjs FILE
//
// FILE is what `unimapper export --mcap` wrote.
'use strict';
const mcap = require('./mcap_file.cjs');

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

async function main(name) {
  const {reader} = await mcap.open(name);
  const counts = {};
  for await (const message of reader.readMessages({validateCrcs: true})) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    require_true(channel.messageEncoding === 'json' && schema.encoding === 'jsonschema',
                 `${channel.topic}: encoding`);
    const value = JSON.parse(new TextDecoder().decode(message.data));
    const description = JSON.parse(new TextDecoder().decode(schema.data));
    require_true(description.title === schema.name, schema.name);
    require_true(conforms(value, description), `${channel.topic} is no ${schema.name}`);
    counts[channel.topic] = (counts[channel.topic] || 0) + 1;
    if (schema.name !== 'foxglove.PointCloud') continue;
    const bytes = Buffer.from(value.data, 'base64');
    require_true(bytes.length % value.point_stride === 0, `${channel.topic}: bytes of points`);
    if (channel.topic === '/static') {
      const points = bytes.length / value.point_stride;
      require_true(points > 100, `${points} static points`);
      for (let i = 0; i < points; ++i) {
        const x = bytes.readFloatLE(i * value.point_stride);
        require_true(Math.abs(x) < 300, `x of point ${i}: ${x}`);
      }
    }
  }
  for (const topic of ['/static', '/removed', '/loops', '/run/trajectory']) {
    require_true(counts[topic] === 1, `${topic}: ${counts[topic]} messages`);
  }
  require_true(counts['/tf'] > 1 && counts['/tf'] === counts['/run/pose'], 'poses over time');
  console.log(JSON.stringify(counts));
}

mcap.run(main);
