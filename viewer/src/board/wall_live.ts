/** The wall's live pane: the featured run with team, score and clocks in large type. */
import { eventWords } from '../model/events';
import { clock, points } from '../ui/format';
import { el, name, setText } from '../ui/elements';
import type { Stage } from '../render/stage';
import { stageFor, type StageLike } from './wall_stage';
import type { Poses, WatchReply, WatchRun, WatchScene } from '../wire/messages';

/** Events that show the live pane early. */
const HIGHLIGHTS = new Set(['in_goal', 'lifted', 'held', 'shaken']);

/** Display time of the text next to the score, ms. */
const NEWS_MS = 6000;

/** Shows the watch socket's messages. */
export class LivePane {
  private readonly place = el('div', { class: 'stage' });
  private readonly who = el('div', { class: 'who' });
  private readonly what = el('div', { class: 'what' });
  private readonly score = el('span');
  private readonly time = el('div', { class: 'time' });
  private readonly news = el('div', { class: 'news', role: 'status' });
  readonly element = el('section', { class: 'pane live', 'aria-label': 'Live' }, this.place,
    el('div', { class: 'caption' }, el('div', { class: 'grow' }, this.who, this.what), this.news, this.time, el('div', { class: 'score' }, el('span', { class: 'visually-hidden' }, 'Score '), this.score)));
  private stage: StageLike | null = null;
  /** The stage, for tests. */
  drawing: Stage | null = null;
  private run: WatchRun | null = null;
  private goals: string[] = [];
  private points: number | null = null;
  private silence = 0;
  private newest: Poses | null = null;
  private taken: Promise<void> = Promise.resolve();
  private last: { team: string; left: number | null } | null = null;
  /** Time of the last highlight, as of performance.now(), or null. */
  lastHighlight: number | null = null;

  /** Whether there is a run to show. */
  get ready(): boolean {
    return this.run !== null && this.stage !== null;
  }

  /** The watched session's clock, if the server sends it. */
  get clock(): { team: string; left: number | null } | null {
    return this.last;
  }

  /** Handles a message of the watch socket; messages wait until the stage is loaded. */
  take(message: WatchReply): void {
    this.taken = this.taken.then(() => this.read(message)).catch((error: unknown) => { console.error(error); });
  }

  /** The pane becomes visible: it shows the newest poses, since a paused run sends no more. */
  seen(): void {
    if (this.newest !== null) this.stage?.poses(this.newest, performance.now());
  }

  private async read(message: WatchReply): Promise<void> {
    switch (message.op) {
      case 'scene': await this.begin(message); break;
      case 'poses': this.drawn(message); setText(this.time, clock(Math.floor(message.sim_time_s))); break;
      case 'score': this.scored(message.score); break;
      case 'events': this.noted(message.events.map((event) => event.kind)); break;
      case 'clock': this.last = this.run === null ? null : { team: this.run.team, left: message.session_left_s }; break;
      case 'ended': setText(this.news, 'run over'); this.run = null; this.points = null; break;
      default: break;
    }
  }

  private async begin(message: WatchScene): Promise<void> {
    this.stage ??= await stageFor(this.place, (stage) => { this.drawing = stage; });
    this.stage?.scene(message);
    this.run = message.run;
    this.goals = message.goals ?? [];
    this.newest = null;
    this.points = null;
    this.lastHighlight = null;
    this.who.replaceChildren(name(this.run.team));
    setText(this.what, `${this.run.task}, ${this.run.hand}`);
    setText(this.score, '');
    setText(this.news, '');
  }

  /** Draws only while the pane is visible. */
  private drawn(message: Poses): void {
    this.newest = message;
    if (this.element.classList.contains('shown')) this.stage?.poses(message, performance.now());
  }

  private scored(score: number): void {
    if (this.points !== null && score > this.points) {
      this.lastHighlight = performance.now();
      this.say(`+${points(score - this.points)}`);
    }
    this.points = score;
    setText(this.score, points(score));
  }

  /** Shows a text for NEWS_MS. */
  private say(text: string): void {
    setText(this.news, text);
    window.clearTimeout(this.silence);
    this.silence = window.setTimeout(() => { setText(this.news, ''); }, NEWS_MS);
  }

  private noted(kinds: readonly string[]): void {
    const highlight = kinds.findLast((kind) => HIGHLIGHTS.has(kind) || this.goals.includes(kind));
    if (highlight === undefined) return;
    this.lastHighlight = performance.now();
    if (highlight !== 'in_goal') this.say(eventWords(highlight, this.goals));
  }
}
