/** Where replays come from: this server, or a file of one's own. */
import { type Recording, InvalidReplay, readRecording } from './recording';

/** Why the server gave no file, in words; `status` 0 where it did not answer. */
export class ReplayUnavailable extends Error {
  constructor(message: string, readonly status: number) {
    super(message);
  }

  /** Whether a token, or another one, could help. */
  get wantsToken(): boolean { return this.status === 401 || this.status === 403; }
}

/** A recording and where it is from: `run` names a run of this server, a file has a name only; `bytes` is what came, to be kept. */
export interface Loaded { recording: Recording; run: string | null; file: string; bytes: Uint8Array<ArrayBuffer> | null }

async function refused(response: Response): Promise<ReplayUnavailable> {
  const problem: unknown = await response.json().catch(() => null);
  const detail = typeof problem === 'object' && problem !== null && 'detail' in problem && typeof problem.detail === 'string' ? problem.detail : '';
  return new ReplayUnavailable(detail || `The server answered ${response.status}.`, response.status);
}

/** Reads a body to its end and says how much of it has come. */
async function whole(response: Response, said: (words: string) => void): Promise<Uint8Array<ArrayBuffer>> {
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
    said(length > 0 ? `Fetching … ${Math.min(100, Math.round((100 * size) / length))} %` : `Fetching … ${(size / 1e6).toFixed(1)} MB`);
  }
  const all = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

async function read(bytes: Uint8Array, said: (words: string) => void): Promise<Recording> {
  return readRecording(bytes, (done) => { said(`Reading … ${Math.round(100 * done)} %`); });
}

/** A run's replay from this server. */
export async function fromServer(run: string, token: string | null, said: (words: string) => void): Promise<Loaded> {
  let bytes: Uint8Array<ArrayBuffer>;
  try {
    const response = await fetch(`/v1/runs/${encodeURIComponent(run)}/replay`, { headers: token ? { Authorization: `Bearer ${token}` } : {}, credentials: 'omit' });
    if (!response.ok) throw await refused(response);
    bytes = await whole(response, said);
  } catch (error) {
    if (error instanceof ReplayUnavailable) throw error;
    throw new ReplayUnavailable('The server does not answer. Is it still running?', 0);
  }
  return { recording: await read(bytes, said), run, file: `${run}.mcap`, bytes };
}

/** A file from this computer. It goes nowhere. */
export async function fromFile(file: File, said: (words: string) => void): Promise<Loaded> {
  said('Reading …');
  return { recording: await read(new Uint8Array(await file.arrayBuffer()), said), run: null, file: file.name, bytes: null };
}

/** What went wrong, in words. */
export function errorText(error: unknown): string {
  if (error instanceof InvalidReplay || error instanceof ReplayUnavailable) return error.message;
  console.error(error);
  return `This file could not be read: ${error instanceof Error ? error.message : String(error)}`;
}
