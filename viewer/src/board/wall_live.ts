/** The wall's picture: the featured run with team, score and time in large type. */
import { eventWords } from '../model/events';
import { gainWords, type Worth } from './gain';
import { clock, points } from '../ui/format';
import { el, name, setText } from '../ui/elements';
import type { Stage } from '../render/stage';
import { stageFor, type StageLike } from './wall_stage';
import type { WatchReply, WatchRun, WatchScene } from '../wire/messages';

/** Events that are shown beside the score. */
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
  readonly element = el(
    'section',
    { class: 'live', 'aria-label': 'Live', hidden: true },
    this.place,
    el(
      'div',
      { class: 'caption' },
      el('div', { class: 'grow' }, this.who, this.what),
      this.time,
      el('div', { class: 'score' }, el('span', { class: 'visually-hidden' }, 'Score '), this.score),
    ),
  );
  private stage: StageLike | null = null;
  /** The stage, for tests. */
  drawing: Stage | null = null;
  private run: WatchRun | null = null;
  private goals: string[] = [];
  private points: number | null = null;
  /** Objects that came into the goal since the last score. */
  private arrived = 0;
  private silence = 0;
  private taken: Promise<void> = Promise.resolve();
  private last: { team: string; left: number | null } | null = null;

  /** `worth`: the points of a task's objects. */
  constructor(private readonly worth: (task: string) => Worth | null) {}

  /** Whether there is a run to show. */
  get ready(): boolean {
    return this.run !== null && this.stage !== null;
  }

  /** The watched session's clock, if the server sends it. */
  get clock(): { team: string; left: number | null } | null {
    return this.last;
  }

  /** Forgets the run: it may no longer be shown. */
  leave(): void {
    this.run = null;
    this.last = null;
  }

  /** Handles a message of the watch socket; messages wait until the stage is loaded. */
  take(message: WatchReply): void {
    this.taken = this.taken.then(() => this.read(message)).catch((error: unknown) => console.error(error));
  }

  private async read(message: WatchReply): Promise<void> {
    switch (message.op) {
      case 'scene':
        await this.begin(message);
        break;
      case 'poses':
        this.stage?.poses(message, performance.now());
        setText(this.time, clock(Math.floor(message.sim_time_s)));
        break;
      case 'score':
        this.scored(message.score);
        break;
      case 'events':
        this.noted(message.events.map((event) => event.kind));
        break;
      case 'clock':
        this.last = this.run === null ? null : { team: this.run.team, left: message.session_left_s };
        break;
      case 'ended':
        this.say('run over');
        this.run = null;
        this.points = null;
        break;
      default:
        break;
    }
  }

  private async begin(message: WatchScene): Promise<void> {
    this.stage ??= await stageFor(this.place, (stage) => {
      this.drawing = stage;
    });
    this.place.append(this.news);
    this.stage?.scene(message);
    this.run = message.run;
    this.goals = message.goals ?? [];
    this.points = null;
    this.arrived = 0;
    this.who.replaceChildren(name(this.run.team));
    setText(this.what, `${this.run.task}, ${this.run.hand}`);
    setText(this.score, '');
    setText(this.news, '');
  }

  private scored(score: number): void {
    if (this.points !== null && Math.abs(score - this.points) > 1e-9) {
      this.say(gainWords(score - this.points, this.arrived, this.worth(this.run?.task ?? '')), score < this.points);
    }
    this.arrived = 0;
    this.points = score;
    setText(this.score, points(score));
  }

  /** Shows a text for NEWS_MS. */
  private say(text: string, bad = false): void {
    setText(this.news, text);
    this.news.classList.toggle('bad', bad);
    window.clearTimeout(this.silence);
    this.silence = window.setTimeout(() => setText(this.news, ''), NEWS_MS);
  }

  private noted(kinds: readonly string[]): void {
    this.arrived += kinds.filter((kind) => kind === 'in_goal').length;
    const highlight = kinds.findLast((kind) => HIGHLIGHTS.has(kind) || this.goals.includes(kind));
    if (highlight !== undefined && highlight !== 'in_goal') this.say(eventWords(highlight, this.goals));
  }
}
