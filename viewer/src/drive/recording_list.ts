/**
 * The runs driven since the page was opened. Each can be downloaded as a Python program, even after a lost session, and a finished
 * one as its replay, of which `palmares dataset` makes a demonstration.
 */
import { points } from '../ui/format';
import { button, el, name } from '../ui/elements';
import { pythonOf } from './python';
import type { ActionRecording } from './action_recording';

export class RecordingList {
  private readonly list = el('ul', { class: 'takes' });
  private readonly empty = el('p', { class: 'hint' }, 'Your runs are listed here until you close the page.');
  readonly element = el('section', { class: 'panel' }, el('h2', {}, 'Recordings'), this.empty, this.list);
  private readonly rows = new WeakMap<ActionRecording, HTMLElement>();

  /** Adds a recording, or updates its text. */
  show(recording: ActionRecording): void {
    let row = this.rows.get(recording);
    if (!row) {
      const says = el('p', {});
      this.rows.set(recording, says);
      this.list.prepend(
        el(
          'li',
          {},
          says,
          button('Download as Python', () => save(recording), { class: 'small' }),
        ),
      );
      this.empty.hidden = true;
      row = says;
    }
    const { run, result } = recording;
    const end = result ? `, ${points(result.score)} points (${result.reason.replaceAll('_', ' ')})` : ', not finished';
    if (result?.replay && !row.parentElement?.querySelector('a')) {
      const file = `/v1/runs/${encodeURIComponent(result.run_id)}/replay`;
      row.parentElement?.append(el('a', { class: 'button small', href: file, download: `${result.run_id}.mcap` }, 'Download the replay'));
    }
    row.replaceChildren(
      `${run.task}, `,
      name(run.hand),
      `, seed ${run.seed}: ${(recording.ticks * run.tick_s).toFixed(1)} s${end}${recording.whole ? '' : ', with gaps'}`,
    );
  }
}

/** Downloads the file. */
function save(recording: ActionRecording): void {
  const address = URL.createObjectURL(new Blob([pythonOf(recording)], { type: 'text/x-python' }));
  const link = el('a', { href: address, download: 'driven.py' });
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
