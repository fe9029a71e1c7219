/** Rankings, announcements and the featured run over the watch socket, which reconnects by itself. */
import type { Announcement, LeaderboardRow, WatchReply } from '../wire/messages';

/** Callbacks of the feed. */
export interface FeedListener {
  ranking(rows: LeaderboardRow[]): void;
  announcement?(announcement: Announcement): void;
  /** Whether the socket is connected. */
  connected(yes: boolean): void;
  /** Messages of the featured run; with this callback the feed subscribes to it. */
  world?(message: WatchReply): void;
  /** The token was revoked: the socket does not reconnect. */
  revoked?(): void;
}

/** Maximum wait before the next attempt, ms. */
const MAX_WAIT_MS = 10_000;

/** Opens the feed; the returned function closes it. Rankings are public; official runs need a token. */
export function openFeed(listener: FeedListener, token: string | null = null): () => void {
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
    const say = (message: Record<string, unknown>): void => opened.send(JSON.stringify(message));
    opened.onopen = () => {
      wait = 500;
      say(listener.world === undefined ? { op: 'subscribe', id: 1, leaderboard: true } : { op: 'subscribe', id: 2, featured: true });
    };
    opened.onmessage = (event: MessageEvent) => {
      if (typeof event.data === 'string') read(event.data, say);
    };
    opened.onclose = (event) => {
      listener.connected(false);
      if (over) return;
      if (event.code === 4401) {
        over = true;
        listener.revoked?.();
        return;
      }
      timer = window.setTimeout(open, wait * (0.75 + Math.random() / 2));
      wait = Math.min(wait * 2, MAX_WAIT_MS);
    };
  }

  function read(data: string, say: (message: Record<string, unknown>) => void): void {
    const message = JSON.parse(data) as WatchReply;
    switch (message.op) {
      case 'subscribed':
        listener.connected(true);
        break;
      case 'leaderboard':
        listener.ranking(message.rows);
        break;
      case 'announcement':
        listener.announcement?.(message);
        break;
      // Older servers have the ranking only with the subscription of a run.
      case 'error':
        if (message.id === 1) say({ op: 'subscribe', id: 2, featured: true });
        break;
      default:
        listener.world?.(message);
        break;
    }
  }

  open();
  return () => {
    over = true;
    window.clearTimeout(timer);
    socket?.close();
  };
}
