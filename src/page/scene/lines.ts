// Thick lines that stay visible behind points, fainter.
import { Group } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";

export interface Style {
  colour?: string;
  width: number;
  dash?: [number, number];
  opacity?: number;
  hidden?: number;
}

/** Segments as x, y, z of both ends, one after the other; colours as r, g, b of each end in 0..1. */
/** Layer of the scene that a moving view on a slow machine leaves out. */
export const behindPoints = 1;
const dashesPerLine = 40;

/** Dashes as segments of their own: those of the material stretch where a line passes the camera. */
function dashed(segments: number[], [dash, gap]: [number, number]): number[] {
  const pieces: number[] = [];
  for (let i = 0; i < segments.length; i += 6) {
    const [x, y, z, toX, toY, toZ] = segments.slice(i, i + 6) as [
      number,
      number,
      number,
      number,
      number,
      number,
    ];
    const length = Math.hypot(toX - x, toY - y, toZ - z);
    const period = Math.max(dash + gap, length / dashesPerLine) / (length || 1);
    for (let at = 0; at < 1; at += period) {
      const end = Math.min(1, at + (period * dash) / (dash + gap));
      for (const part of [at, end])
        pieces.push(x + (toX - x) * part, y + (toY - y) * part, z + (toZ - z) * part);
    }
  }
  return pieces;
}

export class Lines extends Group {
  private readonly geometry = new LineSegmentsGeometry();

  constructor(segments: number[], style: Style, colours?: number[]) {
    super();
    if (!segments.length) return;
    this.geometry.setPositions(style.dash ? dashed(segments, style.dash) : segments);
    if (colours) this.geometry.setColors(colours);
    this.add(this.layer(style, Boolean(colours), true), this.layer(style, Boolean(colours), false));
  }

  private layer(style: Style, vertexColors: boolean, depthTest: boolean): LineSegments2 {
    const material = new LineMaterial({
      color: style.colour ?? "#ffffff",
      linewidth: style.width,
      vertexColors,
      transparent: true,
      depthTest,
      depthWrite: false,
      opacity: (style.opacity ?? 1) * (depthTest ? 1 : (style.hidden ?? 0.35)),
    });
    const lines = new LineSegments2(this.geometry, material);
    lines.frustumCulled = false;
    if (!depthTest) lines.layers.set(behindPoints);
    lines.renderOrder = depthTest ? 2 : 1;
    return lines;
  }

  release(): void {
    this.removeFromParent();
    this.geometry.dispose();
    for (const child of this.children) (child as LineSegments2).material.dispose();
  }
}
