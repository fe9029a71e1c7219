/** Test servers on free ports with temporary folders, and a controller that runs in a page. */
import { type ChildProcess, spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { test as base } from '@playwright/test';
import { APPLE, Control, grasp } from './control';

export interface Server {
  url: string;
}

/** A competition server, with requests of its organizer. */
export interface Official extends Server {
  organizer: string;
  /** A POST with the organizer's or another token; returns the JSON response. */
  post(path: string, body: object, token?: string): Promise<Record<string, unknown>>;
  get(path: string, token?: string): Promise<Record<string, unknown>>;
}

/** Starts the program and waits until it prints its address. */
async function start(more: string[]): Promise<{ process: ChildProcess; url: string }> {
  const program = process.env['PALMARES_SERVER_BIN'];
  if (!program) throw new Error('PALMARES_SERVER_BIN names no server');
  const started = spawn(program, ['serve', ...more], { stdio: ['ignore', 'pipe', 'pipe'] });
  const url = await new Promise<string>((resolve, reject) => {
    const look = (line: string): void => {
      const found = /http:\/\/127\.0\.0\.1:\d+/.exec(line);
      if (found) resolve(found[0]);
    };
    createInterface({ input: started.stdout }).on('line', look);
    createInterface({ input: started.stderr }).on('line', look);
    started.on('exit', (code) => reject(new Error(`the server ended with ${code}`)));
  });
  return { process: started, url };
}

/** Runs a server for `use`; `prepare` writes into its folder and returns the arguments. */
async function serve(prepare: (folder: string) => string[], use: (url: string, folder: string) => Promise<void>): Promise<void> {
  const folder = mkdtempSync(join(tmpdir(), 'palmares-viewer-'));
  const { process: started, url } = await start(prepare(folder));
  await use(url, folder);
  started.kill('SIGTERM');
  await new Promise((resolve) => started.once('exit', resolve));
  rmSync(folder, { recursive: true, force: true });
}

const practice = (folder: string): string[] => ['--listen', '127.0.0.1:0', '--data-dir', folder];

/** Name of the competition, with markup and right-to-left text. */
export const EVENT = '<b onclick=alert(1)>Cup</b> \u0643\u0623\u0633 2027';
const competition = (folder: string): string[] => {
  const file = join(folder, 'competition.toml');
  writeFileSync(
    file,
    [
      'mode = "official"',
      `name = ${JSON.stringify(EVENT)}`,
      'session_s = 1800',
      'sessions_per_team = 2',
      'hands = ["softhand"]',
      'listen = "127.0.0.1:0"',
      'data_dir = "data"',
    ].join('\n'),
  );
  return ['--config', file];
};

async function answered(response: Promise<Response>): Promise<Record<string, unknown>> {
  const answer = await response;
  const body = (await answer.json()) as Record<string, unknown>;
  if (!answer.ok) throw new Error(`${answer.status}: ${String(body['detail'])}`);
  return body;
}

/** Number of teams on the crowded server; their names have the maximum length. */
export const CROWD = 60;

/** Creates teams with a run of one tick each; two of sixty lift an object. */
async function crowd(url: string, count = CROWD): Promise<void> {
  const letters = ['\u0642\u0631\u062f\u0629 ', 'crab ', '\u87f9 ', '<img src=x onerror=alert(1)> '];
  const play = async (k: number): Promise<void> => {
    const control = await Control.open(url);
    // Half of the names have no spaces, so that they cannot wrap.
    const start = `${k % 3 === 0 ? (letters[k % letters.length] ?? '') : ''}${'abcdefghijklmnopqrstuvwxyz'.charAt(k % 26)}${k}`;
    await control.begin((start + (k % 2 === 0 ? ' of many words' : 'W')).padEnd(64, k % 2 === 0 ? ' and legs' : 'W'), 'grasp', {
      seed: APPLE,
    });
    if (k === 20 || k === 41) await grasp(control, 60);
    else await control.step(1);
    await control.ask('stop');
    control.end();
  };
  // Two at a time: a server computes a run on one core.
  const teams = Array.from({ length: count }, (_, k) => k);
  const next = async (): Promise<void> => {
    for (let k = teams.shift(); k !== undefined; k = teams.shift()) await play(k);
  };
  await Promise.all([next(), next()]);
}

/** Each server starts for the first test that uses it, and stays for the others. */
export const test = base.extend<object, { server: Server; crowded: Server; few: Server; official: Official }>({
  server: [
    async ({}, use) => {
      await serve(practice, (url) => use({ url }));
    },
    { scope: 'worker' },
  ],
  /** A practice server with sixty teams on its leaderboard. */
  crowded: [
    async ({}, use) => {
      await serve(practice, async (url) => {
        await crowd(url);
        await use({ url });
      });
    },
    { scope: 'worker' },
  ],
  /** A practice server with five teams. */
  few: [
    async ({}, use) => {
      await serve(practice, async (url) => {
        await crowd(url, 5);
        await use({ url });
      });
    },
    { scope: 'worker' },
  ],
  official: [
    async ({}, use) => {
      await serve(competition, async (url, folder) => {
        const organizer = readFileSync(join(folder, 'data', 'organizer.token'), 'utf8').trim();
        const as = (token: string): Record<string, string> => ({ Authorization: `Bearer ${token}` });
        await use({
          url,
          organizer,
          post: (path, body, token = organizer) =>
            answered(
              fetch(url + path, {
                method: 'POST',
                body: JSON.stringify(body),
                headers: { ...as(token), 'Content-Type': 'application/json' },
              }),
            ),
          get: (path, token = organizer) => answered(fetch(url + path, { headers: as(token) })),
        });
      });
    },
    { scope: 'worker' },
  ],
});

/** Runs in a page: opens a run of `balls`, and steps until `stop` is set. Resolves when the run is open. */
export function drive(team: string): Promise<void> {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(`ws://${location.host}/v1/control`, 'palmares.v1.json');
    const state = { tick: 0, id: 10, stop: false, result: null as unknown };
    Object.assign(window, { driven: state });
    const say = (message: object): void => socket.send(JSON.stringify(message));
    const step = (): void => {
      state.id += 1;
      // Down into the box and up again, repeatedly.
      const z = 0.55 + 0.2 * Math.cos(state.tick / 60);
      say({
        op: 'step',
        id: state.id,
        tick: state.tick,
        repeat: 2,
        action: { base: { position: [0.15 * Math.sin(state.tick / 90), 0, z], quat_xyzw: [0, 1, 0, 0] }, hand: [0.5] },
      });
    };
    socket.onopen = () => say({ op: 'hello', id: 1, client: { name: team } });
    socket.onmessage = (event: MessageEvent<string>) => {
      const message = JSON.parse(event.data) as { op: string; id?: number; tick?: number; message?: string };
      if (message.op === 'welcome') say({ op: 'reset', id: 2, task: 'balls', hand: 'softhand', seed: 1 });
      else if (message.op === 'error') reject(new Error(message.message));
      else if (message.op === 'result') state.result = message;
      else if (message.op === 'obs') {
        state.tick = message.tick ?? 0;
        if (message.id === 2) resolve();
        if (state.stop) say({ op: 'stop', id: 3 });
        else setTimeout(step, 5);
      }
    };
  });
}
