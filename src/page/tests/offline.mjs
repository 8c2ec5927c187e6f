// Page with its data inside, as one file.
import { readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { fileURLToPath } from "node:url";
import { keyframeBlock } from "./keyframes.mjs";

const pagePath = fileURLToPath(new URL("../built/page.html", import.meta.url));
const points = (id, compressed) =>
  `<script type="application/octet-stream" data-encoding="gzip+base64" id="points/${id}">${Buffer.from(compressed).toString("base64")}</script>`;

/** `keyframes`: pairs of session and keyframe whose scans the file holds. */
export function offlinePage(data, keyframes = [], flatPicture = null) {
  const parts = [
    `<script type="application/json" id="map-json">${JSON.stringify(data.map).replaceAll("</", "<\\/")}</script>`,
  ];
  for (const [layer, tiles] of Object.entries(data.tiles))
    for (const [key, compressed] of tiles) parts.push(points(`${layer}/${key}`, compressed));
  for (const [session, keyframe] of keyframes)
    parts.push(
      points(
        `keyframe/${session}/${keyframe}`,
        gzipSync(keyframeBlock(data, data.map.sessions[session].poses[keyframe])),
      ),
    );
  if (flatPicture)
    parts.push(`<script id="flat-picture" type="text/plain">${flatPicture}</script>`);
  return readFileSync(pagePath, "utf8").replace("<!-- data -->", () => parts.join("\n"));
}
