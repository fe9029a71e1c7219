/** Loads replays from this server or from a local file. */
import { isToken, NO_TOKEN, refusal } from '../net/token';
import { type Recording, InvalidReplay, readRecording } from './recording';

/** The server sent no file; `status` is 0 if it did not answer. */
export class ReplayUnavailable extends Error {
  constructor(
    message: string,
    readonly status: number,
  ) {
    super(message);
  }

  /** Whether another token could help. */
  get wantsToken(): boolean {
    return this.status === 401 || this.status === 403;
  }
}

/** A recording and its source: `run` is null for a local file; `bytes` has the downloaded file. */
export interface Loaded {
  recording: Recording;
  run: string | null;
  file: string;
  bytes: Uint8Array<ArrayBuffer> | null;
}

async function refused(response: Response, token: string | null): Promise<ReplayUnavailable> {
  const words = refusal(response.status, token);
  if (words !== null) return new ReplayUnavailable(words, response.status);
  const problem: unknown = await response.json().catch(() => null);
  const detail =
    typeof problem === 'object' && problem !== null && 'detail' in problem && typeof problem.detail === 'string' ? problem.detail : '';
  return new ReplayUnavailable(detail || `The server answered ${response.status}.`, response.status);
}

/** Reads a response to its end and reports progress. */
async function readBody(response: Response, report: (words: string) => void): Promise<Uint8Array<ArrayBuffer>> {
  const length = Number(response.headers.get('Content-Length') ?? 0);
  const reader = response.body?.getReader();
  if (!reader) return new Uint8Array(await response.arrayBuffer());
  const parts: Uint8Array[] = [];
  let size = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    size += value.length;
    report(
      length > 0 ? `Downloading … ${Math.min(100, Math.round((100 * size) / length))} %` : `Downloading … ${(size / 1e6).toFixed(1)} MB`,
    );
  }
  const all = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

async function read(bytes: Uint8Array, report: (words: string) => void): Promise<Recording> {
  return readRecording(bytes, (done) => report(`Reading … ${Math.round(100 * done)} %`));
}

/** Loads a run's replay from this server. */
export async function fromServer(run: string, token: string | null, report: (words: string) => void): Promise<Loaded> {
  let bytes: Uint8Array<ArrayBuffer>;
  if (token && !isToken(token)) throw new ReplayUnavailable(NO_TOKEN, 401);
  try {
    const response = await fetch(`/v1/runs/${encodeURIComponent(run)}/replay`, {
      headers: token ? { Authorization: `Bearer ${token}` } : {},
      credentials: 'omit',
    });
    if (!response.ok) throw await refused(response, token);
    bytes = await readBody(response, report);
  } catch (error) {
    if (error instanceof ReplayUnavailable) throw error;
    throw new ReplayUnavailable('The server does not answer. Is it still running?', 0);
  }
  return { recording: await read(bytes, report), run, file: `${run}.mcap`, bytes };
}

/** Loads a local file, which is not uploaded. */
export async function fromFile(file: File, report: (words: string) => void): Promise<Loaded> {
  report('Reading …');
  return { recording: await read(new Uint8Array(await file.arrayBuffer()), report), run: null, file: file.name, bytes: null };
}

/** An error as text. */
export function errorText(error: unknown): string {
  if (error instanceof InvalidReplay || error instanceof ReplayUnavailable) return error.message;
  console.error(error);
  return `This file cannot be read: ${error instanceof Error ? error.message : String(error)}`;
}
