/** The ranking as it changes, and announcements: over the watch socket, which is opened again when it breaks. */
import type { Announcement, BoardRow } from './model';

/** What a ticker tells. */
export interface Told {
  ranking(rows: BoardRow[]): void;
  announcement?(announcement: Announcement): void;
  /** Whether the server is there. */
  connected(yes: boolean): void;
}

/** Longest wait before the next attempt, ms. */
const MOST_WAIT_MS = 10_000;

/** Starts it; the returned function ends it. A ticker has no token: rankings are public. */
export function ticker(told: Told): () => void {
  let socket: WebSocket | null = null;
  let wait = 500;
  let timer = 0;
  let over = false;

  function open(): void {
    const address = new URL('/v1/watch', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    socket = new WebSocket(address, 'palmares.v1.json');
    socket.onopen = () => {
      wait = 500;
      socket?.send(JSON.stringify({ op: 'subscribe', id: 1, leaderboard: true }));
    };
    socket.onmessage = (event: MessageEvent) => { if (typeof event.data === 'string') read(event.data); };
    socket.onclose = () => {
      told.connected(false);
      if (over) return;
      timer = window.setTimeout(open, wait * (0.75 + Math.random() / 2));
      wait = Math.min(wait * 2, MOST_WAIT_MS);
    };
  }

  function read(data: string): void {
    const message = JSON.parse(data) as Record<string, unknown>;
    switch (message['op']) {
      case 'subscribed': told.connected(true); break;
      case 'leaderboard': told.ranking(message['rows'] as BoardRow[]); break;
      case 'announcement': told.announcement?.(message as unknown as Announcement); break;
      // A server that has no subscription without a world gives one with it.
      case 'error': if (message['id'] === 1) socket?.send('{"op":"subscribe","id":2,"featured":true}'); break;
      default: break;
    }
  }

  open();
  return () => { over = true; window.clearTimeout(timer); socket?.close(); };
}
