// Layers of tiles in the scene: loading, level of detail, eviction.
import { Box3, Group } from "three";
import type { Block } from "../data/blocks";
import type { MapData } from "../data/format";
import type { Source } from "../data/source";
import type { State } from "../state";
import { BlockPoints } from "./block_points";
import { chosenNodes, treeOf, type Node, type View } from "./octree";
import { PointMaterial, roles, type PointUniforms, type Role } from "./point_material";

const parallelRequests = 6;
/** The first view of an epoch needs no more bytes of tiles; detail comes once it is drawn. */
const firstViewBytes = 2.8e6;

export class TileLayers {
  readonly group = new Group();
  readonly materials = {} as Record<Role, PointMaterial>;
  visibleNodes: BlockPoints[] = [];
  pointsDrawn = 0;
  pointsLoaded = 0;
  loading = 0;
  private trees = new Map<string, Node>();
  private blocks = new Map<Node, BlockPoints>();
  private retired: BlockPoints[] = [];
  private failed = new Set<Node>();
  private requested = new Set<Node>();
  private epoch = 0;
  private shape = "";
  private frame = 0;
  private view: View | null = null;
  /** Bytes of the tiles that were asked for. */
  private bytes = 0;
  private drawn = false;

  constructor(
    private readonly source: Source,
    private readonly state: State,
    uniforms: PointUniforms,
    private readonly changed: () => void,
  ) {
    for (const role of Object.keys(roles) as Role[])
      this.materials[role] = new PointMaterial(uniforms, role);
  }

  /** Tiles of the epoch before stay until the coarse whole of the new one is there. */
  show(map: MapData): void {
    const shape = JSON.stringify([
      map.epoch,
      Object.entries(map.layers).map(([name, layer]) => [name, layer.nodes.length]),
    ]);
    if (shape === this.shape) return;
    this.shape = shape;
    this.epoch = map.epoch;
    this.retired.push(...this.blocks.values());
    this.visibleNodes = [];
    this.bytes = 0;
    this.drawn = false;
    this.blocks.clear();
    this.trees.clear();
    this.failed.clear();
    this.requested.clear();
    for (const [name, layer] of Object.entries(map.layers)) {
      const tree = name in roles ? treeOf(name, layer) : null;
      if (tree) this.trees.set(name, tree);
    }
    if (!this.trees.size) this.dropRetired();
    this.changed();
  }

  has(layer: string): boolean {
    return this.trees.has(layer);
  }

  get bounds(): Box3 | null {
    const root = this.trees.get("static");
    return root ? root.cube.clone() : null;
  }

  /** Coarsest points of the whole map. */
  get rootBlock(): Block | null {
    const root = this.trees.get("static");
    return (root && this.blocks.get(root)?.block) ?? null;
  }

  /** Whether a layer is switched on. */
  private shown(layer: string): boolean {
    const { settings } = this.state;
    if (layer === "static") return settings.staticShown;
    if (layer === "removed") return settings.removed || settings.divider !== null;
    if (layer === "changes") return settings.changePoints;
    return layer === "false_static" ? settings.falseStatic : settings.falseDynamic;
  }

  private choose(view: View): { shown: Node[]; wanted: Node[] } {
    const roots = [...this.trees].filter(([name]) => this.shown(name)).map(([, root]) => root);
    return chosenNodes(roots, view, (node) => this.blocks.has(node));
  }

  update(view: View): void {
    this.frame += 1;
    this.view = view;
    const { shown, wanted } = this.choose(view);
    for (const block of this.visibleNodes) block.visible = false;
    this.visibleNodes = shown.map((node) => this.reveal(node));
    this.pointsDrawn = shown.reduce((sum, node) => sum + node.count, 0);
    this.sizePoints(shown);
    this.request(wanted);
    this.loading = this.requested.size;
    if (!this.drawn && this.firstViewDone) {
      this.drawn = true;
      this.changed();
    }
    if (this.retired.length && this.drawn) this.dropRetired();
    this.evict(view.budget);
  }

  private reveal(node: Node): BlockPoints {
    const block = this.blocks.get(node)!;
    node.used = this.frame;
    block.visible = true;
    return block;
  }

  /** Points are as large as the detail that covers their node, on average over its children. */
  private sizePoints(shown: Node[]): void {
    const visible = new Set(shown);
    const depth = new Map<Node, number>();
    for (const node of [...shown].reverse()) {
      let points = 0,
        deeper = 0;
      for (const child of node.children) {
        points += child.count;
        if (visible.has(child)) deeper += child.count * (1 + (depth.get(child) ?? 0));
      }
      depth.set(node, points ? deeper / points : 0);
      this.blocks.get(node)!.spacing = node.spacing / 2 ** depth.get(node)!;
    }
  }

  private request(wanted: Node[]): void {
    for (const node of wanted) {
      if (this.requested.size >= parallelRequests || (!this.drawn && this.bytes >= firstViewBytes))
        return;
      if (!this.requested.has(node) && !this.failed.has(node)) void this.load(node);
    }
  }

  private async load(node: Node): Promise<void> {
    const { epoch, shape } = this;
    this.requested.add(node);
    this.bytes += node.bytes;
    try {
      const block = await this.source.tile(epoch, node.layer, node.key);
      if (shape === this.shape)
        this.insert(node, new BlockPoints(block, this.materials[node.layer as Role]));
    } catch (error) {
      this.failed.add(node);
      if (shape === this.shape) this.state.alarm("error", (error as Error).message);
    }
    this.requested.delete(node);
    // The next requests do not wait for a frame, which may take long.
    if (this.view && shape === this.shape) this.request(this.choose(this.view).wanted);
    this.loading = this.requested.size;
    this.changed();
  }

  private insert(node: Node, points: BlockPoints): void {
    this.blocks.set(node, points);
    points.visible = false;
    this.group.add(points);
    this.pointsLoaded += points.block.count;
  }

  private dropRetired(): void {
    this.retired.forEach((block) => this.release(block));
    this.retired = [];
  }

  private release(block: BlockPoints): void {
    this.pointsLoaded -= block.block.count;
    block.release();
  }

  /** Nodes that no view used for longest go first; parents are used whenever their children are. */
  private evict(budget: number): void {
    const limit = Math.max(2 * budget, 2e6);
    if (this.pointsLoaded <= limit) return;
    const unused = [...this.blocks.keys()]
      .filter((node) => node.used < this.frame)
      .sort((a, b) => a.used - b.used || b.key.length - a.key.length);
    for (const node of unused) {
      if (this.pointsLoaded <= 0.9 * limit) return;
      this.release(this.blocks.get(node)!);
      this.blocks.delete(node);
    }
  }

  /** Whether the coarse whole of the view is drawn. */
  get firstViewDone(): boolean {
    if (!this.trees.size) return true;
    if (!this.visibleNodes.length && !this.failed.size) return false;
    return this.requested.size === 0;
  }
}
