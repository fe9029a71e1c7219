/** Sends one request at a time. While it waits for a response it keeps only the latest request, and sends that next. */

/** Wait before a refused request is repeated, ms. */
const RETRY_MS = 800;

export class LatestRequest<Request, Response> {
  private waiting: { request: Request } | null = null;
  private busy = false;
  private closed = false;
  /** Number of responses, for tests. */
  count = 0;

  /**
   * `ask` sends a request; `received` gets each response, `failed` each error. `later` says whether a request with this error
   * may be repeated.
   */
  constructor(
    private readonly ask: (request: Request) => Promise<Response>,
    private readonly received: (response: Response, request: Request) => void,
    private readonly failed: (error: unknown, request: Request) => void,
    private readonly later: (error: unknown) => boolean = () => false,
  ) {}

  /** Sends a request now, or after the current one. */
  put(request: Request): void {
    this.waiting = { request };
    if (!this.busy) void this.run();
  }

  /** No callback is called any more. */
  close(): void {
    this.closed = true;
    this.waiting = null;
  }

  private async run(): Promise<void> {
    this.busy = true;
    while (this.waiting && !this.closed) {
      const { request } = this.waiting;
      this.waiting = null;
      try {
        const response = await this.ask(request);
        this.count += 1;
        if (!this.closed) this.received(response, request);
      } catch (error) {
        if (this.later(error)) {
          await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
          this.waiting ??= { request };
        } else if (!this.closed) {
          this.failed(error, request);
        }
      }
    }
    this.busy = false;
  }
}
