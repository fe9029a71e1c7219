/** A practice server on a free port with a folder of its own, and a controller that a page runs. */
import { type ChildProcess, spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { test as base } from '@playwright/test';

export interface Server { url: string }

/** Starts the program and waits until it says where it listens. */
async function start(data: string): Promise<{ process: ChildProcess; url: string }> {
  const program = process.env['PALMARES_SERVER_BIN'];
  if (!program) throw new Error('PALMARES_SERVER_BIN names no server');
  const started = spawn(program, ['serve', '--listen', '127.0.0.1:0', '--data-dir', data], { stdio: ['ignore', 'pipe', 'pipe'] });
  const url = await new Promise<string>((resolve, reject) => {
    const look = (line: string): void => {
      const found = /http:\/\/127\.0\.0\.1:\d+/.exec(line);
      if (found) resolve(found[0]);
    };
    createInterface({ input: started.stdout }).on('line', look);
    createInterface({ input: started.stderr }).on('line', look);
    started.on('exit', (code) => { reject(new Error(`the server ended with ${code}`)); });
  });
  return { process: started, url };
}

/** `server`: one for all tests of a file. */
export const test = base.extend<object, { server: Server }>({
  // eslint-disable-next-line no-empty-pattern -- Playwright reads from it which fixtures are wanted
  server: [async ({}, use) => {
    const data = mkdtempSync(join(tmpdir(), 'palmares-viewer-'));
    const { process: started, url } = await start(data);
    await use({ url });
    started.kill('SIGTERM');
    await new Promise((resolve) => started.once('exit', resolve));
    rmSync(data, { recursive: true, force: true });
  }, { scope: 'worker' }],
});

/** Runs in a page: greets, opens `balls`, and steps until it is told to stop. Returns when the run is open. */
export function drive(team: string): Promise<void> {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(`ws://${location.host}/v1/control`, 'palmares.v1.json');
    const state = { tick: 0, id: 10, stop: false, result: null as unknown };
    Object.assign(window, { driven: state });
    const say = (message: object): void => { socket.send(JSON.stringify(message)); };
    const step = (): void => {
      state.id += 1;
      // Down into the box and closing, over and over.
      const z = 0.55 + 0.2 * Math.cos(state.tick / 60);
      say({ op: 'step', id: state.id, tick: state.tick, repeat: 2, action: { base: { position: [0.15 * Math.sin(state.tick / 90), 0, z], quat_xyzw: [0, 1, 0, 0] }, hand: [0.5] } });
    };
    socket.onopen = () => { say({ op: 'hello', id: 1, client: { name: team } }); };
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
