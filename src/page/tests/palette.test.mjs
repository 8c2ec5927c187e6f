// Tests of the colours of sessions as people with each kind of colour blindness see them.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { transformSync } from "esbuild";

const source = readFileSync(new URL("../palette.ts", import.meta.url), "utf8");
const { code } = transformSync(source, { loader: "ts" });
const palette = await import(`data:text/javascript,${encodeURIComponent(code)}`);

const times = (matrix, vector) =>
  matrix.map((row) => row.reduce((sum, value, i) => sum + value * vector[i], 0));
/** What is seen of linear sRGB (Machado, Oliveira and Fernandes 2009, whole severity). */
const eyes = {
  normal: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  protan: [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
  deutan: [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
  tritan: [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
};
const toXyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]];
const white = [0.95047, 1, 1.08883];

const linear = (colour) =>
  palette.bytes(colour).map((byte) => (byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4));
const luminance = (colour) => times(toXyz, linear(colour))[1];

/** CIE L*a*b* of a colour for an eye. */
function lab(colour, eye) {
  const seen = times(eyes[eye], linear(colour)).map((value) => Math.min(1, Math.max(0, value)));
  const [x, y, z] = times(toXyz, seen).map((value, i) => {
    const part = value / white[i];
    return part > 216 / 24389 ? Math.cbrt(part) : ((24389 / 27) * part + 16) / 116;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

for (const theme of ["dark", "light"])
  test(`sessions stay apart for every eye, ${theme}`, () => {
    const colours = palette.sessions[theme];
    for (const eye of Object.keys(eyes))
      colours.forEach((colour, i) =>
        colours.slice(i + 1).forEach((other) => {
          const [a, b] = [lab(colour, eye), lab(other, eye)];
          const distance = Math.hypot(...a.map((value, axis) => value - b[axis]));
          assert.ok(distance > 24, `${colour} and ${other} to a ${eye} eye: ${distance.toFixed(1)}`);
        }),
      );
    const ground = luminance(palette.background[theme]);
    for (const colour of colours) {
      const [low, high] = [luminance(colour), ground].sort((a, b) => a - b);
      assert.ok((high + 0.05) / (low + 0.05) > 2.6, `${colour} on ${palette.background[theme]}`);
    }
  });
