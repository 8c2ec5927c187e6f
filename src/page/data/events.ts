// Events of the server, and the state of the connection.

export type Handlers = Record<string, (data: unknown) => void>;
const firstDelay_ms = 500;
const lastDelay_ms = 8000;

/** Stays connected: a browser gives a refused event stream up, so each attempt is a new one. */
export class Events {
  connected = false;
  private delay_ms = firstDelay_ms;
  private stream: EventSource | null = null;

  constructor(
    private readonly url: string,
    private readonly handlers: Handlers,
    private readonly changed: (connected: boolean, again: boolean) => void,
    private readonly failed: (text: string) => void,
  ) {}

  start(): void {
    const stream = new EventSource(this.url);
    this.stream = stream;
    stream.onopen = () => this.opened();
    stream.onerror = () => this.lost(stream);
    for (const name of Object.keys(this.handlers))
      stream.addEventListener(name, (event) => this.deliver(name, (event as MessageEvent).data));
  }

  private wasConnected = false;

  private opened(): void {
    const again = this.wasConnected;
    this.connected = this.wasConnected = true;
    this.delay_ms = firstDelay_ms;
    this.changed(true, again);
  }

  private lost(stream: EventSource): void {
    if (stream !== this.stream) return;
    stream.close();
    this.connected = false;
    this.changed(false, false);
    setTimeout(() => this.start(), this.delay_ms);
    this.delay_ms = Math.min(2 * this.delay_ms, lastDelay_ms);
  }

  /** What one event says wrong does not end the others. */
  private deliver(name: string, text: string): void {
    try {
      this.handlers[name]!(JSON.parse(text));
    } catch (error) {
      this.failed(`event ${name}: ${(error as Error).message}`);
    }
  }
}
