/** The control socket: one reply to each request, in order. */
import { isToken, NO_TOKEN } from '../net/token';
import type { ControlReply } from '../wire/messages';

/** A refused request, with the server's message. */
export class ControlError extends Error {
  constructor(
    message: string,
    readonly code: string,
  ) {
    super(message);
  }
}

/** The connection is lost, and with it the session's open run. */
export class ConnectionLost extends Error {}

interface Waiting {
  resolve(reply: unknown): void;
  reject(error: Error): void;
}

export class ControlSocket {
  /** Called once, if the connection ends unexpectedly. */
  onLost: (why: string) => void = () => undefined;
  /** Called for messages that are no replies: warnings, and the result of a run that the server ended. */
  onMessage: (message: ControlReply) => void = () => undefined;
  private readonly waiting = new Map<number, Waiting>();
  private id = 0;
  private over = false;
  /** The server's last error before it closed the connection. */
  private last = '';

  private constructor(private readonly socket: WebSocket) {
    socket.onmessage = (event: MessageEvent<string>) => this.take(JSON.parse(event.data) as ControlReply);
    socket.onclose = (event) => this.ended(this.last || event.reason || 'The connection to the server was lost.');
  }

  /** Connects. The token, if any, is sent as a subprotocol, since a page cannot send headers with a socket. */
  static open(token: string | null): Promise<ControlSocket> {
    const address = new URL('/v1/control', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    if (token && !isToken(token)) return Promise.reject(new ConnectionLost(NO_TOKEN));
    const socket = new WebSocket(address, token ? ['palmares.v1.json', `palmares.token.${token}`] : ['palmares.v1.json']);
    return new Promise((resolve, reject) => {
      socket.onopen = () => resolve(new ControlSocket(socket));
      // A browser does not report why a handshake was refused.
      socket.onerror = () =>
        reject(
          new ConnectionLost(
            token ? 'The server does not answer, or refuses this token.' : 'The server does not answer, or accepts no connections now.',
          ),
        );
    });
  }

  /** Sends a request and waits for its reply; throws `ControlError` if it is refused. */
  ask<T>(request: object): Promise<T> {
    return new Promise<T>((resolve, reject) => {
      if (this.over) {
        reject(new ConnectionLost(this.last || 'The connection to the server was lost.'));
        return;
      }
      this.id += 1;
      this.waiting.set(this.id, { resolve: (reply) => resolve(reply as T), reject });
      this.socket.send(JSON.stringify({ ...request, id: this.id }));
    });
  }

  /** Ends the session: the server stops and scores an open run. */
  close(): void {
    if (this.over) return;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ op: 'bye', id: this.id + 1 }));
    this.onLost = () => undefined;
    this.socket.close();
  }

  /** Closes the connection and leaves the session open: a new connection may resume it. */
  leave(): void {
    this.onLost = () => undefined;
    this.socket.close();
  }

  private take(reply: ControlReply): void {
    const id = 'id' in reply ? reply.id : undefined;
    const waiting = id === undefined ? undefined : this.waiting.get(id);
    if (reply.op === 'error') {
      if (reply.fatal || !waiting) this.last = reply.message;
      waiting?.reject(new ControlError(reply.message, reply.code));
    } else if (waiting) {
      waiting.resolve(reply);
    } else {
      this.onMessage(reply);
    }
    if (id !== undefined) this.waiting.delete(id);
  }

  private ended(why: string): void {
    if (this.over) return;
    this.over = true;
    this.last = why;
    for (const waiting of this.waiting.values()) waiting.reject(new ConnectionLost(why));
    this.waiting.clear();
    this.onLost(why);
  }
}
