/** `/replay/RUN`: a run as its file tells it; `/replay`: a file of one's own, which never leaves the browser. */
import '../style/base.css';
import '../style/replay.css';
import { button, el, main } from '../board/kit';
import { NotAReplay, readRecording } from '../replay/recording';
import { ReplayView } from '../replay/view';

const app = main();
const run = document.body.dataset['arg'] ?? '';

/** Time in the address, s. */
function startTime(): number {
  const found = /[#&]t=([0-9.]+)/.exec(location.hash);
  return found?.[1] ? Number(found[1]) : 0;
}

async function open(bytes: Uint8Array, status: HTMLElement): Promise<void> {
  const recording = await readRecording(bytes, (done) => { status.textContent = `Reading … ${Math.round(100 * done)} %`; });
  const view = new ReplayView(app, recording, startTime());
  window.palmares = { stage: view.stage, recording, player: view.player };
}

/** Says what went wrong, in words. */
function told(error: unknown): string {
  if (error instanceof NotAReplay) return error.message;
  console.error(error);
  return `This file could not be read: ${error instanceof Error ? error.message : String(error)}`;
}

/** The run's file from this server. */
async function fetchRun(token: string | null): Promise<void> {
  const status = el('p', { role: 'status' }, 'Fetching the replay …');
  app.replaceChildren(el('h1', {}, 'Replay'), status);
  const response = await fetch(`/v1/runs/${encodeURIComponent(run)}/replay`, { headers: token ? { Authorization: `Bearer ${token}` } : {}, credentials: 'omit' });
  if (!response.ok) {
    const problem = await response.json().catch(() => ({})) as { detail?: string };
    status.className = 'notice bad';
    status.textContent = problem.detail ?? `The server answered ${response.status}.`;
    if (response.status === 401 || response.status === 403) app.append(tokenForm());
    app.append(chooser('Or open a file:'));
    return;
  }
  try {
    await open(new Uint8Array(await response.arrayBuffer()), status);
  } catch (error) {
    status.className = 'notice bad';
    status.textContent = told(error);
  }
}

function tokenForm(): HTMLElement {
  const field = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false' });
  return el('section', { class: 'panel' }, el('div', { class: 'field' }, el('label', { for: 'token' }, 'Token'), field,
    el('p', { class: 'hint' }, 'It is kept in this page\u2019s memory alone.')), button('Use it', () => { void fetchRun(field.value.trim() || null); }));
}

/** A file from this computer, chosen or dropped. */
function chooser(words: string): HTMLElement {
  const status = el('p', { role: 'status' });
  const read = async (file: File | undefined): Promise<void> => {
    if (!file) return;
    try {
      await open(new Uint8Array(await file.arrayBuffer()), status);
    } catch (error) {
      status.className = 'notice bad';
      status.textContent = told(error);
    }
  };
  const input = el('input', { type: 'file', id: 'file', accept: '.mcap' });
  input.addEventListener('change', () => { void read(input.files?.[0]); });
  const place = el('div', { class: 'drop' }, el('label', { for: 'file' }, words, ' an MCAP file that Palmares recorded'), input,
    el('p', { class: 'hint' }, 'Or drop it here. It is read in this browser and sent nowhere.'), status);
  document.addEventListener('dragover', (event) => { event.preventDefault(); place.classList.add('over'); });
  document.addEventListener('dragleave', () => { place.classList.remove('over'); });
  document.addEventListener('drop', (event) => { event.preventDefault(); place.classList.remove('over'); void read(event.dataTransfer?.files[0]); });
  return place;
}

if (run) void fetchRun(null);
else app.replaceChildren(el('div', { class: 'title' }, el('h1', {}, 'Replay'), el('p', { class: 'lead' }, 'A run as it was, moment by moment.')), chooser('Open'));
