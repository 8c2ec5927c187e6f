// Octree of a layer: nodes, and which of them a view needs.
import { Box3, Frustum, Vector3 } from "three";
import type { Layer } from "../data/format";

/** Points per edge of a node's cube: a node of size s is sampled at s / 64. */
const samplesPerEdge = 64;

export class Node {
  readonly children: Node[] = [];
  readonly cube: Box3;
  /** Screen-space error: pixels between neighbouring points if this node were the last. */
  error = 0;
  used = 0;

  constructor(
    readonly layer: string,
    readonly key: string,
    readonly count: number,
    readonly bytes: number,
    readonly size: number,
    cube: Box3,
  ) {
    this.cube = cube;
  }

  get spacing(): number {
    return this.size / samplesPerEdge;
  }
}

function cubeOf(layer: Layer, key: string): [Box3, number] {
  let size = layer.size_m;
  const low = new Vector3(layer.origin[0], layer.origin[1], layer.origin[2]);
  for (const digit of key.slice(1)) {
    size /= 2;
    const octant = Number(digit);
    low.add(
      new Vector3((octant & 1) * size, ((octant >> 1) & 1) * size, ((octant >> 2) & 1) * size),
    );
  }
  return [new Box3(low, low.clone().addScalar(size)), size];
}

/** Root of the layer's tree; null where it has none. */
export function treeOf(name: string, layer: Layer): Node | null {
  const nodes = new Map<string, Node>();
  const rows = [...layer.nodes].sort((a, b) => a[0].length - b[0].length);
  for (const [key, count, bytes, box] of rows) {
    const [cube, size] = cubeOf(layer, key);
    const tight =
      Array.isArray(box) && box.length === 6
        ? new Box3(new Vector3(box[0], box[1], box[2]), new Vector3(box[3], box[4], box[5]))
        : cube;
    const node = new Node(name, key, count, bytes, size, tight);
    nodes.set(key, node);
    nodes.get(key.slice(0, -1))?.children.push(node);
  }
  return nodes.get("r") ?? null;
}

/** View that nodes are chosen for. */
export interface View {
  frustum: Frustum;
  eye: Vector3;
  pixelsPerUnit: number;
  budget: number;
  error_px: number;
}

/** Nodes by their error until the budget of points is spent; children follow loaded parents only. */
export function chosenNodes(
  roots: Node[],
  view: View,
  loaded: (node: Node) => boolean,
): { shown: Node[]; wanted: Node[] } {
  const shown: Node[] = [],
    wanted: Node[] = [];
  const queue: Node[] = [];
  const add = (node: Node) => {
    if (!view.frustum.intersectsBox(node.cube)) return;
    const distance = Math.max(
      node.cube.distanceToPoint(view.eye),
      (0.3 * node.size) / samplesPerEdge,
      0.1,
    );
    node.error = (node.spacing * view.pixelsPerUnit) / distance;
    queue.push(node);
    raise(queue);
  };
  roots.forEach(add);
  for (let points = 0; queue.length && points < view.budget; ) {
    const node = takeLargest(queue);
    points += node.count;
    if (!loaded(node)) {
      wanted.push(node);
      continue;
    }
    shown.push(node);
    if (node.error > view.error_px) node.children.forEach(add);
  }
  return { shown, wanted };
}

/** Binary heap by error, largest first: puts the last entry into its position. */
function raise(heap: Node[]): void {
  let i = heap.length - 1;
  for (
    let parent = (i - 1) >> 1;
    i > 0 && heap[parent]!.error < heap[i]!.error;
    parent = (i - 1) >> 1
  ) {
    [heap[i], heap[parent]] = [heap[parent]!, heap[i]!];
    i = parent;
  }
}

function takeLargest(heap: Node[]): Node {
  const first = heap[0]!,
    last = heap.pop()!;
  if (!heap.length) return first;
  heap[0] = last;
  for (let i = 0; ; ) {
    const left = 2 * i + 1;
    let largest = i;
    for (const child of [left, left + 1])
      if (child < heap.length && heap[child]!.error > heap[largest]!.error) largest = child;
    if (largest === i) return first;
    [heap[i], heap[largest]] = [heap[largest]!, heap[i]!];
    i = largest;
  }
}
