// MCAP files as npm's @mcap/core reads them; the program ends with 77 where a package is missing.
'use strict';
const fs = require('fs');

/// A package of npm.
exports.package = (name) => {
  try {
    return require(name);
  } catch (error) {
    console.log(`skipped: npm has no ${name} here (npm install ${name}; NODE_PATH)`);
    process.exit(77);
  }
};
exports.core = exports.package('@mcap/core');

/// The bytes of a file, and a reader that goes by its index.
exports.open = async (name) => {
  const file = fs.readFileSync(name);
  const readable = {
    size: async () => BigInt(file.length),
    read: async (offset, size) =>
        new Uint8Array(file.subarray(Number(offset), Number(offset + size))),
  };
  return {file, reader: await exports.core.McapIndexedReader.Initialize({readable})};
};

/// Calls `main` with the argument; the program fails where that throws.
exports.run = (main) => main(process.argv[2]).catch((error) => {
  console.error(error.message);
  process.exit(1);
});
