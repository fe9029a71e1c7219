/** The control socket: one request, one reply, in order. The page greets, opens runs and steps by nothing else. */

/** What the server refuses, in its own words. */
export class ControlError extends Error {
  constructor(message: string, readonly code: string) {
    super(message);
  }
}

/** The connection is gone, and with it the session's open run. */
export class ConnectionLost extends Error {}

interface Reply { op: string; id?: number; code?: string; message?: string; fatal?: boolean }
interface Waiting { resolve(reply: unknown): void; reject(error: Error): void }

export class ControlSocket {
  /** Told when the connection ends without being asked to; called once. */
  onLost: (why: string) => void = () => undefined;
  /** Told of messages that answer nothing: warnings, and the result of a run that the server closed. */
  onTold: (message: Reply) => void = () => undefined;
  private readonly waiting = new Map<number, Waiting>();
  private id = 0;
  private over = false;
  /** What the server said before it hung up. */
  private last = '';

  private constructor(private readonly socket: WebSocket) {
    socket.onmessage = (event: MessageEvent<string>) => { this.take(JSON.parse(event.data) as Reply); };
    socket.onclose = (event) => { this.ended(this.last || event.reason || 'The connection to the server broke.'); };
  }

  /** Connects. The token, if any, goes along as a subprotocol: a page cannot send headers with a socket. */
  static open(token: string | null): Promise<ControlSocket> {
    const address = new URL('/v1/control', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    const socket = new WebSocket(address, token ? ['palmares.v1.json', `palmares.token.${token}`] : ['palmares.v1.json']);
    return new Promise((resolve, reject) => {
      socket.onopen = () => { resolve(new ControlSocket(socket)); };
      // A browser does not tell why a handshake was refused.
      socket.onerror = () => { reject(new ConnectionLost(token ? 'The server does not answer, or does not take this token.' : 'The server does not answer, or lets nobody in now.')); };
    });
  }

  /** Sends a request; its reply, or the refusal. */
  ask<T>(request: object): Promise<T> {
    return new Promise<T>((resolve, reject) => {
      if (this.over) { reject(new ConnectionLost(this.last || 'The connection to the server broke.')); return; }
      this.id += 1;
      this.waiting.set(this.id, { resolve: (reply) => { resolve(reply as T); }, reject });
      this.socket.send(JSON.stringify({ ...request, id: this.id }));
    });
  }

  /** Says goodbye: an open run is stopped and scored by the server. */
  close(): void {
    if (this.over) return;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ op: 'bye', id: this.id + 1 }));
    this.onLost = () => undefined;
    this.socket.close();
  }

  private take(reply: Reply): void {
    const waiting = reply.id === undefined ? undefined : this.waiting.get(reply.id);
    if (reply.op === 'error') {
      const message = reply.message ?? reply.code ?? 'refused';
      if (reply.fatal || !waiting) this.last = message;
      waiting?.reject(new ControlError(message, reply.code ?? ''));
    } else if (waiting) {
      waiting.resolve(reply);
    } else {
      this.onTold(reply);
    }
    if (reply.id !== undefined) this.waiting.delete(reply.id);
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
