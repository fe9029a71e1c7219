/** Controllers of the Python client, where there is one: `PALMARES_CLIENT_PYTHON` names the interpreter. */
import { type ChildProcess, spawn } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { test } from '@playwright/test';

const EXAMPLES = fileURLToPath(new URL('../../client-py/src/palmares/examples/', import.meta.url));

/** What an example prints of its run with `--json`. */
export interface Played { run_id: string; score: number }

/** An example that plays one run. */
export class Example {
  private constructor(private readonly process: ChildProcess, readonly played: Promise<Played>) {}

  /** Starts one; without an interpreter the test is skipped, and says so. */
  static start(name: string, url: string, ...options: string[]): Example {
    const python = process.env['PALMARES_CLIENT_PYTHON'];
    test.skip(!python, 'PALMARES_CLIENT_PYTHON names no Python with the client');
    const started = spawn(python ?? '', [EXAMPLES + name, '--url', url, '--json', '--quiet', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
    let said = '';
    started.stdout.on('data', (data: Buffer) => { said += data.toString(); });
    const played = new Promise<Played>((resolve, reject) => {
      started.on('exit', (code) => {
        const last = said.trim().split('\n').at(-1) ?? '';
        if (code === 0) resolve(JSON.parse(last) as Played);
        else reject(new Error(`${name} ended with ${code}: ${last}`));
      });
    });
    // Whoever waits for it is told; nobody else has to be.
    played.catch(() => undefined);
    return new Example(started, played);
  }

  /** It works a tenth of the time, until what is given has been seen: a run of a minute may else be over before a page has loaded. */
  async slowedUntil(seen: Promise<void>): Promise<void> {
    const turns = setInterval(() => {
      this.process.kill('SIGCONT');
      setTimeout(() => this.process.kill('SIGSTOP'), 5);
    }, 50);
    try {
      await seen;
    } finally {
      clearInterval(turns);
      // The last turn may have its stop still to come.
      setTimeout(() => this.process.kill('SIGCONT'), 50);
    }
  }

  /** Its world stands still until it is stopped. */
  hold(): void {
    this.process.kill('SIGSTOP');
  }

  stop(): void {
    this.process.kill('SIGCONT');
    this.process.kill('SIGINT');
  }
}
