/** Contacts of the run. Only the watch socket sends them; it is open while they are wanted. */
import type { Contact } from '../model/moment';
import { WatchSocket } from '../net/watch';

export class ContactFeed {
  /** Contacts of the newest frame; undefined while they are not wanted. */
  contacts: Contact[] | undefined;
  private socket: WatchSocket | null = null;
  private run: string | null = null;
  private wanted = false;

  want(on: boolean): void {
    this.wanted = on;
    this.open();
  }

  /** Sets the run; null for none. */
  follow(run: string | null): void {
    this.run = run;
    this.open();
  }

  private open(): void {
    this.socket?.close();
    this.socket = null;
    this.contacts = undefined;
    if (!this.wanted || this.run === null) return;
    const nothing = (): void => undefined;
    this.socket = new WatchSocket(
      { run_id: this.run },
      {
        moment: (moment) => {
          this.contacts = moment.contacts;
        },
        scene: nothing,
        score: nothing,
        events: nothing,
        clock: nothing,
        verdicts: nothing,
        ended: nothing,
        runs: nothing,
        state: nothing,
        refused: nothing,
      },
    );
  }
}
