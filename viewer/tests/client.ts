/** Controllers of the Python client; `PALMARES_CLIENT_PYTHON` is the interpreter. */
import { type ChildProcess, spawn } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { test } from '@playwright/test';

const EXAMPLES = fileURLToPath(new URL('../../client-py/src/palmares/examples/', import.meta.url));

/** Output of an example with `--json`. */
export interface Played {
  run_id: string;
  score: number;
}

/** A running example that plays one run. */
export class Example {
  private constructor(
    private readonly process: ChildProcess,
    readonly played: Promise<Played>,
  ) {}

  /** Starts an example; without an interpreter the test is skipped with a message. */
  static start(name: string, url: string, ...options: string[]): Example {
    const python = process.env['PALMARES_CLIENT_PYTHON'];
    test.skip(!python, 'PALMARES_CLIENT_PYTHON names no Python with the client');
    const started = spawn(python ?? '', [EXAMPLES + name, '--url', url, '--json', '--quiet', ...options], {
      stdio: ['ignore', 'pipe', 'inherit'],
    });
    let said = '';
    started.stdout.on('data', (data: Buffer) => {
      said += data.toString();
    });
    const played = new Promise<Played>((resolve, reject) =>
      started.on('exit', (code) => {
        const last = said.trim().split('\n').at(-1) ?? '';
        if (code === 0) resolve(JSON.parse(last) as Played);
        else reject(new Error(`${name} ended with ${code}: ${last}`));
      }),
    );
    // Only a test that awaits it must fail.
    played.catch(() => undefined);
    return new Example(started, played);
  }

  /** Slows the example to a tenth until `seen` resolves: otherwise its run could be over before a page has loaded. */
  async slowedUntil(seen: Promise<void>): Promise<void> {
    const turns = setInterval(() => {
      this.process.kill('SIGCONT');
      setTimeout(() => this.process.kill('SIGSTOP'), 5);
    }, 50);
    try {
      await seen;
    } finally {
      clearInterval(turns);
      // The last SIGSTOP may still be pending.
      setTimeout(() => this.process.kill('SIGCONT'), 50);
    }
  }

  /** Suspends the example; its world waits. */
  hold(): void {
    this.process.kill('SIGSTOP');
  }

  stop(): void {
    this.process.kill('SIGCONT');
    this.process.kill('SIGINT');
  }
}
