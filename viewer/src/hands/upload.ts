/** Upload of a team's own hand, and the report of the server's check. */
import { ApiError } from '../net/api';
import { figureTable } from './figure_table';
import { el, facts, name } from '../ui/elements';
import { type Access, uploadHand } from './access';
import { type Finding, findings } from './finding';
import { pathOf, zip } from './zip';
import type { SubmittedHand } from '../wire/messages';

/** The archive to upload: a ZIP unchanged; single files are packed under the paths in the URDF. */
export async function archiveOf(files: readonly File[]): Promise<Uint8Array<ArrayBuffer>> {
  const only = files[0];
  if (files.length === 1 && only && /\.zip$/i.test(only.name)) return new Uint8Array(await only.arrayBuffer());
  const urdf = files.find((file) => /\.(urdf|xml)$/i.test(file.name));
  if (!urdf) throw new Error('Choose one .zip file, or a .urdf file with its hand.toml and meshes.');
  const text = await urdf.text();
  return zip(
    await Promise.all(
      files.map(async (file) => ({
        name: file === urdf ? file.name : pathOf(file.name, text),
        bytes: new Uint8Array(await file.arrayBuffer()),
      })),
    ),
  );
}

/** The findings of a check, each with its file and element. */
export function findingList(all: readonly Finding[]): HTMLElement {
  return el(
    'ul',
    { class: 'findings' },
    ...all.map(({ file, element, text, valid }) =>
      el(
        'li',
        {},
        file !== null || element !== null
          ? el('p', { class: 'where' }, file === null ? null : el('code', {}, file), ' ', element === null ? null : name(element))
          : null,
        el('p', {}, text),
        valid === null ? null : el('p', { class: 'hint' }, valid),
      ),
    ),
  );
}

/** The check's report of an accepted hand. */
export function checkReport(hand: SubmittedHand): HTMLElement {
  const many = hand.warnings.length;
  return el(
    'section',
    { class: 'panel', tabindex: -1, id: 'check', 'aria-label': 'Result of the check' },
    el(
      'h2',
      {},
      'Check: ',
      el(
        'span',
        { class: many > 0 ? 'badge warn' : 'badge ok' },
        many === 0 ? 'usable' : `usable, ${many} ${many === 1 ? 'warning' : 'warnings'}`,
      ),
    ),
    many > 0 ? findingList(hand.warnings.flatMap(findings)) : null,
    facts([
      ['State', hand.status === 'pending' ? 'pending: the organizers decide' : hand.status],
      ['Archive', `${hand.bytes} bytes`],
      ['SHA-256', el('code', {}, hand.sha256)],
    ]),
    hand.note === null ? null : el('p', {}, 'Note from the organizers: ', name(hand.note)),
    hand.figures === undefined
      ? null
      : el(
          'details',
          {},
          el('summary', {}, 'Figures, compared with the other hands and the limits'),
          el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Figures' }, figureTable(hand.figures)),
        ),
  );
}

/** The upload form; `sent` gets the accepted hand. */
export function uploadForm(access: () => Access, official: boolean, sent: (hand: SubmittedHand) => void): HTMLElement {
  const files = el('input', { type: 'file', id: 'hand-files', multiple: true, accept: '.zip,.urdf,.toml,.stl,.xml' });
  const says = el('div', { role: 'status' });
  const send = async (chosen: readonly File[]): Promise<void> => {
    if (chosen.length === 0) return;
    const who = access();
    if (who.token === null && (official || who.team === null)) {
      says.replaceChildren(el('p', { class: 'error' }, official ? 'Enter your team’s token first.' : 'Enter your team’s name first.'));
      return;
    }
    says.replaceChildren(el('p', {}, 'Uploading and checking …'));
    try {
      const hand = await uploadHand(await archiveOf(chosen), who);
      says.replaceChildren();
      sent(hand);
    } catch (error) {
      const checked = error instanceof ApiError && [400, 422].includes(error.status);
      const heading = checked
        ? error.code === 'hand_in_the_way'
          ? 'Not usable: it touches something in its start pose'
          : 'Not usable'
        : 'The upload failed';
      says.replaceChildren(
        el(
          'div',
          { class: 'notice bad' },
          el('p', {}, el('b', {}, heading)),
          findingList(findings(error instanceof Error ? error.message : String(error))),
        ),
      );
    } finally {
      files.value = '';
    }
  };
  files.addEventListener('change', () => void send([...(files.files ?? [])]));
  const drop = el(
    'div',
    { class: 'drop' },
    el('label', { for: 'hand-files' }, 'Drop or choose one .zip file, or a .urdf file with its hand.toml and meshes:'),
    files,
  );
  const over =
    (on: boolean) =>
    (event: Event): void => {
      event.preventDefault();
      drop.classList.toggle('over', on);
    };
  drop.addEventListener('dragover', over(true));
  drop.addEventListener('dragleave', over(false));
  drop.addEventListener('drop', (event) => {
    over(false)(event);
    void send([...(event.dataTransfer?.files ?? [])]);
  });
  return el('div', { class: 'stack' }, drop, says);
}
