/** Asks one thing at a time: while an answer is awaited only the newest question is kept, and it is asked next. */

/** How long after a refusal for lack of room the newest question is asked again, ms. */
const AGAIN_MS = 800;

export class LatestRequest<Question, Answer> {
  private waiting: { question: Question } | null = null;
  private busy = false;
  private closed = false;
  /** Answers that came, for tests. */
  count = 0;

  /**
   * `ask` sends; `told` hears of each answer, `failed` of each failure. `later` says whether a failed question may simply be
   * asked again.
   */
  constructor(
    private readonly ask: (question: Question) => Promise<Answer>, private readonly told: (answer: Answer, question: Question) => void,
    private readonly failed: (error: unknown, question: Question) => void, private readonly later: (error: unknown) => boolean = () => false,
  ) {}

  /** Asks, now or as soon as the answer that is awaited has come. */
  put(question: Question): void {
    this.waiting = { question };
    if (!this.busy) void this.run();
  }

  /** Nothing more is told. */
  close(): void {
    this.closed = true;
    this.waiting = null;
  }

  private async run(): Promise<void> {
    this.busy = true;
    while (this.waiting && !this.closed) {
      const { question } = this.waiting;
      this.waiting = null;
      try {
        const answer = await this.ask(question);
        this.count += 1;
        if (!this.closed) this.told(answer, question);
      } catch (error) {
        if (this.later(error)) {
          await new Promise((resolve) => { setTimeout(resolve, AGAIN_MS); });
          this.waiting ??= { question };
        } else if (!this.closed) {
          this.failed(error, question);
        }
      }
    }
    this.busy = false;
  }
}
