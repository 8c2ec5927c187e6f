// Number of points that the measured frame time permits.

const least = 60_000;
const most = 5_000_000;
const leastRatio = 0.75;

export class Budget {
  /** While the view moves. */
  points: number;
  frame_ms = 0;
  /** Device pixels per pixel of the page: while the view moves, and at rest. */
  ratio: number;
  readonly fullRatio: number;
  /** Without a graphics card a moving view has neither shading nor lines behind points. */
  plain: boolean;
  private readonly target_ms: number;
  private readonly still: number;
  private frames = 0;

  constructor(software: boolean) {
    this.plain = software;
    this.points = software ? 300_000 : 2_500_000;
    this.still = software ? 1_000_000 : 3_500_000;
    this.target_ms = software ? 90 : 28;
    this.ratio = this.fullRatio = software ? 1 : Math.min(devicePixelRatio, 2);
  }

  /** A view at rest may take longer than one that moves. */
  get atRest(): number {
    return Math.max(this.points, this.still);
  }

  /** Time between two frames drawn one after the other: fewer points first, then fewer pixels. */
  measured(ms: number): void {
    if (ms <= 0 || ms > 5000) return;
    this.frame_ms = this.frame_ms ? 0.8 * this.frame_ms + 0.2 * ms : ms;
    if (++this.frames < 6) return;
    this.frames = 0;
    const factor = this.target_ms / this.frame_ms;
    if (factor < 0.85 || factor > 1.3)
      this.points = Math.min(
        most,
        Math.max(least, this.points * Math.min(Math.max(factor, 0.6), 1.25)),
      );
    this.plain = this.plain || (this.points === least && factor < 0.7);
    if (this.points === least && factor < 0.5) this.ratio = Math.max(leastRatio, this.ratio * 0.75);
  }
}
