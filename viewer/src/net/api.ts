/** The server's HTTP API. Errors carry the server's own message, except about tokens. */
import { isToken, NO_TOKEN, refusal } from './token';

/** A request that the server refused, or did not answer (status 0). */
export class ApiError extends Error {
  constructor(
    message: string,
    readonly status: number,
    readonly code: string,
  ) {
    super(message);
  }
}

function text(value: unknown, fallback: string): string {
  return typeof value === 'string' && value !== '' ? value : fallback;
}

/** The error of a response: from application/problem+json, else from the HTTP status. */
async function errorOf(response: Response): Promise<ApiError> {
  const status = response.status;
  try {
    const body: unknown = await response.json();
    if (typeof body === 'object' && body !== null) {
      const problem = body as Record<string, unknown>;
      return new ApiError(text(problem['detail'], text(problem['title'], `HTTP ${status}`)), status, text(problem['code'], ''));
    }
  } catch {
    /* Not JSON: the status is used. */
  }
  return new ApiError(`the server answered ${status} ${response.statusText}`.trim(), status, '');
}

/** Messages have no stop: pages put them into their sentences. */
function sentence(words: string): string {
  return words.replace(/\.$/, '');
}

async function request(path: string, token: string | null, init: RequestInit): Promise<Response> {
  const headers = new Headers(init.headers);
  if (token !== null && !isToken(token)) throw new ApiError(sentence(NO_TOKEN), 401, 'not_authorized');
  if (token !== null) headers.set('Authorization', `Bearer ${token}`);
  let response: Response;
  try {
    response = await fetch(path, { ...init, headers, cache: 'no-store', credentials: 'omit' });
  } catch {
    throw new ApiError('the server does not answer', 0, 'unreachable');
  }
  if (!response.ok) {
    const error = await errorOf(response);
    const words = refusal(response.status, token);
    throw words === null ? error : new ApiError(sentence(words), error.status, error.code);
  }
  return response;
}

/** A GET with a JSON response; the types are in docs/schema/openapi.json. */
export async function getJson<T>(path: string, token: string | null = null): Promise<T> {
  return (await (await request(path, token, {})).json()) as T;
}

/** A POST with a JSON body and a JSON response. */
export async function postJson<T>(path: string, body: unknown, token: string | null = null): Promise<T> {
  const init = { method: 'POST', body: JSON.stringify(body), headers: { 'Content-Type': 'application/json' } };
  return (await (await request(path, token, init)).json()) as T;
}

/** Downloads a file; a plain link could not send the token. */
export async function saveFile(path: string, fileName: string, token: string | null): Promise<void> {
  const file = await (await request(path, token, {})).blob();
  const address = URL.createObjectURL(file);
  const link = document.createElement('a');
  link.href = address;
  link.download = fileName;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
