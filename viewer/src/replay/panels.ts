/** Side panels: the run's metadata, the referee's events, and comparison with another run. */
import { clock, figure, points } from '../ui/format';
import { button, el, facts, name } from '../ui/elements';
import { eventWords } from '../model/events';
import { countWords } from '../model/outcome';
import type { Body } from '../model/scene';
import type { RecordedEvent, Recording } from './recording';
import type { Loaded } from './source';

/** The object of an event. */
export function objectOf(recording: Recording, event: RecordedEvent): Body | undefined {
  if (event.object === undefined) return undefined;
  return recording.scene.bodies.filter((body) => body.kind === 'object')[event.object];
}

/** Team, task, hand and result of a run. */
export function about({ recording, file, bytes }: Loaded, mark: string): HTMLElement {
  const { info, outcome, signed, duration } = recording;
  const said = (key: string): string => info.get(key) ?? '–';
  return el(
    'section',
    { class: 'panel' },
    el('h2', {}, mark ? `${mark}: ` : null, name(said('team')), ', ', name(said('task'))),
    facts([
      ['Score', outcome ? el('b', {}, points(outcome.score)) : 'none: the file is incomplete'],
      ['Ended', outcome ? `${outcome.reason.replaceAll('_', ' ')}, ${countWords(outcome, recording.scene)}` : '–'],
      ['Hand', name(said('hand'))],
      ['Length', `${clock(duration)} (${figure(Math.round(duration * 100) / 100)} s, tick ${figure(recording.tickS * 1000)} ms)`],
      ['Mode', [said('kind'), said('pacing'), said('sensing')].join(', ')],
      ['Run', name(said('run_id'))],
      ['Signed', signed ? 'yes' : 'no'],
    ]),
    el(
      'details',
      {},
      el('summary', {}, 'Verify this file'),
      el('p', {}, 'This page shows the file’s content without checking it. This command replays the actions and checks the score:'),
      el('pre', { tabindex: 0 }, 'palmares verify ', name(file)),
      el('p', {}, signed ? 'It also checks the signature.' : 'This file is not signed.'),
    ),
    bytes ? button('Download the file', () => save(bytes, file), { class: 'small' }) : null,
  );
}

/** Saves the bytes that are already loaded: a new download would need the token again. */
function save(bytes: Uint8Array<ArrayBuffer>, file: string): void {
  const address = URL.createObjectURL(new Blob([bytes], { type: 'application/octet-stream' }));
  el('a', { href: address, download: file }).click();
  window.setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** A list of the events, each with a button that goes to its time. */
export function eventList(recording: Recording, go: (time: number) => void, mark: string): HTMLElement {
  const line = (event: RecordedEvent): HTMLElement => {
    const body = objectOf(recording, event);
    return el(
      'li',
      {},
      button(`${event.time.toFixed(2)} s`, () => go(event.time), { class: 'small quiet num' }),
      el('span', {}, body ? name(body.name) : null, ' ', eventWords(event.kind, recording.scene.goals)),
    );
  };
  const list =
    recording.events.length > 0 ? el('ol', { class: 'log' }, ...recording.events.map(line)) : el('p', { class: 'soft' }, 'No events.');
  return el('section', { class: 'panel' }, el('h2', {}, mark ? `Events of ${mark}` : 'Events'), list);
}

/** Actions for a second run. */
export interface Comparing {
  addRun(run: string): void;
  addFile(file: File): void;
  remove: (() => void) | null;
}

export function comparePanel({ addRun, addFile, remove }: Comparing): HTMLElement {
  const run = el('input', { type: 'text', id: 'with', autocomplete: 'off', spellcheck: 'false', placeholder: 'run_…' });
  const file = el('input', { type: 'file', id: 'with-file', accept: '.mcap' });
  file.addEventListener('change', () => {
    if (file.files?.[0]) addFile(file.files[0]);
  });
  return el(
    'details',
    { class: 'panel' },
    el('summary', {}, remove ? 'Comparing two runs' : 'Compare with another run'),
    el(
      'form',
      {
        on: {
          submit: (event) => {
            event.preventDefault();
            if (run.value.trim()) addRun(run.value.trim());
          },
        },
      },
      el('div', { class: 'field' }, el('label', { for: 'with' }, 'Run of this server'), run),
      el('button', { type: 'submit' }, 'Compare'),
    ),
    el('div', { class: 'field' }, el('label', { for: 'with-file' }, 'Or a local file (it is not uploaded)'), file),
    remove ? button('Show only the first run', remove) : null,
  );
}
