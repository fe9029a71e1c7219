/** The form that opens a run: task, hand, seed and name. */
import { getJson, ApiError } from '../net/api';
import { el, setText } from '../ui/elements';
import type { HandDescription, HandInfo, TaskInfo } from '../wire/messages';

/** The input of the form. */
export interface Choice {
  task: string;
  hand: HandDescription;
  seed: number | null;
  team: string;
  token: string | null;
}

export class StartForm {
  readonly element: HTMLElement;
  private readonly tasks = el('select', { id: 'task', required: true });
  private readonly hands = el('select', { id: 'hand', required: true });
  private readonly seed = el('input', {
    id: 'seed',
    type: 'number',
    min: 0,
    max: Number.MAX_SAFE_INTEGER,
    step: 1,
    placeholder: 'drawn by the server',
  });
  private readonly team = el('input', {
    id: 'team',
    value: 'driver',
    required: true,
    maxlength: 64,
    autocomplete: 'off',
    spellcheck: 'false',
  });
  private readonly token = el('input', { id: 'token', type: 'password', autocomplete: 'off', spellcheck: 'false' });
  private readonly taskSays = el('p', { class: 'hint' });
  private readonly handSays = el('p', { class: 'hint' });
  private readonly error = el('p', { class: 'error', role: 'alert' });
  private readonly go = el('button', { type: 'submit', class: 'primary' }, 'Start');
  private known: { tasks: TaskInfo[]; hands: HandInfo[] } = { tasks: [], hands: [] };

  constructor(start: (choice: Choice) => Promise<void>) {
    const submit = async (): Promise<void> => {
      this.fail('');
      try {
        await start(await this.choice());
      } catch (error) {
        this.fail(error instanceof ApiError ? error.message : String(error));
      }
    };
    this.tasks.addEventListener('change', () => this.describe());
    this.hands.addEventListener('change', () => this.describe());
    this.team.addEventListener('change', () => void this.offer());
    this.element = el(
      'form',
      {
        on: {
          submit: (event) => {
            event.preventDefault();
            void submit();
          },
        },
      },
      el('div', { class: 'field' }, el('label', { for: 'task' }, 'Task'), this.tasks, this.taskSays),
      el('div', { class: 'field' }, el('label', { for: 'hand' }, 'Hand'), this.hands, this.handSays),
      el('div', { class: 'field' }, el('label', { for: 'seed' }, 'Seed'), this.seed),
      el('div', { class: 'field' }, el('label', { for: 'team' }, 'Name on the leaderboard'), this.team),
      el(
        'details',
        {},
        el('summary', {}, 'I have a token'),
        el(
          'div',
          { class: 'field' },
          el('label', { for: 'token' }, 'Token of a team'),
          this.token,
          el('p', { class: 'hint' }, 'This page keeps it only in memory.'),
        ),
      ),
      this.error,
      this.go,
    );
    void this.offer();
  }

  /** Shows an error; an empty text removes it. */
  fail(message: string): void {
    setText(this.error, message);
  }

  /** Enables or disables the start button. */
  enable(on: boolean): void {
    this.go.disabled = !on;
  }

  /** The input, with the hand's description. */
  async choice(): Promise<Choice> {
    const hand = await getJson<HandDescription>(`/v1/hands/${encodeURIComponent(this.hands.value)}${this.whose()}`, this.secret());
    return {
      task: this.tasks.value,
      hand,
      seed: this.seed.value === '' ? null : this.seed.valueAsNumber,
      team: this.team.value.trim(),
      token: this.secret(),
    };
  }

  /** Shows the seed of the opened run, so that it can be used again. */
  showSeed(seed: number | null): void {
    this.seed.value = seed === null ? '' : String(seed);
  }

  private secret(): string | null {
    return this.token.value.trim() || null;
  }

  private whose(): string {
    const team = this.team.value.trim();
    return team && this.secret() === null ? `?team=${encodeURIComponent(team)}` : '';
  }

  private async offer(): Promise<void> {
    try {
      const [{ tasks }, { hands }] = await Promise.all([
        getJson<{ tasks: TaskInfo[] }>('/v1/tasks'),
        getJson<{ hands: HandInfo[] }>(`/v1/hands${this.whose()}`, this.secret()),
      ]);
      this.known = { tasks, hands };
      fill(this.tasks, tasks);
      fill(this.hands, hands);
      this.describe();
      this.fail('');
    } catch (error) {
      this.fail(error instanceof Error ? error.message : String(error));
    }
  }

  private describe(): void {
    setText(this.taskSays, this.known.tasks.find((task) => task.name === this.tasks.value)?.description ?? '');
    setText(this.handSays, this.known.hands.find((hand) => hand.name === this.hands.value)?.description ?? '');
  }
}

function fill(select: HTMLSelectElement, all: readonly { name: string }[]): void {
  const chosen = select.value;
  select.replaceChildren(...all.map(({ name }) => el('option', { value: name }, name)));
  if (all.some(({ name }) => name === chosen)) select.value = chosen;
}
