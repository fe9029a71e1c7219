/** What the server tells as it happens, over the watch socket, which is opened again when it breaks. */
import type { Announcement, BoardRow } from './model';

/** What is told. */
export interface FeedListener {
  ranking(rows: BoardRow[]): void;
  announcement?(announcement: Announcement): void;
  /** Whether the server is there. */
  connected(yes: boolean): void;
  /** Messages of the featured world; where this is given, it is subscribed to. */
  world?(message: Record<string, unknown>): void;
  /** The token was revoked: the socket is not opened again. */
  revoked?(): void;
}

/** Longest wait before the next attempt, ms. */
const MOST_WAIT_MS = 10_000;

/** Starts it; the returned function ends it. Rankings are public; official worlds need a token. */
export function openFeed(told: FeedListener, token: string | null = null): () => void {
  let socket: WebSocket | null = null;
  let wait = 500;
  let timer = 0;
  let over = false;

  function open(): void {
    const address = new URL('/v1/watch', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    const protocols = ['palmares.v1.json'];
    // A page cannot send a header with a socket.
    if (token !== null) protocols.push(`palmares.token.${token}`);
    const opened = new WebSocket(address, protocols);
    socket = opened;
    const say = (message: Record<string, unknown>): void => { opened.send(JSON.stringify(message)); };
    opened.onopen = () => {
      wait = 500;
      say(told.world === undefined ? { op: 'subscribe', id: 1, leaderboard: true } : { op: 'subscribe', id: 2, featured: true });
    };
    opened.onmessage = (event: MessageEvent) => { if (typeof event.data === 'string') read(event.data, say); };
    opened.onclose = (event) => {
      told.connected(false);
      if (over) return;
      if (event.code === 4401) {
        over = true;
        told.revoked?.();
        return;
      }
      timer = window.setTimeout(open, wait * (0.75 + Math.random() / 2));
      wait = Math.min(wait * 2, MOST_WAIT_MS);
    };
  }

  function read(data: string, say: (message: Record<string, unknown>) => void): void {
    const message = JSON.parse(data) as Record<string, unknown>;
    switch (message['op']) {
      case 'subscribed': told.connected(true); break;
      case 'leaderboard': told.ranking(message['rows'] as BoardRow[]); break;
      case 'announcement': told.announcement?.(message as unknown as Announcement); break;
      // A server that has no subscription without a world gives one with it.
      case 'error': if (message['id'] === 1) say({ op: 'subscribe', id: 2, featured: true }); break;
      default: told.world?.(message); break;
    }
  }

  open();
  return () => { over = true; window.clearTimeout(timer); socket?.close(); };
}
