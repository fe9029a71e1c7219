/**
 * `/replay/RUN`: a run's replay; `?with=RUN` compares it with another run. `/replay`: the server's runs, and local files, which are not
 * uploaded.
 */
import '../style/base.css';
import '../style/replay.css';
import { el, mainElement, toast } from '../ui/elements';
import { ReplayList } from '../replay/run_list';
import { type Loaded, ReplayUnavailable, fromFile, fromServer, errorText } from '../replay/source';
import { ReplayView } from '../replay/view';

const app = mainElement();
let run = document.body.dataset['arg'] ?? '';

let token: string | null = null;
let loaded: Loaded[] = [];
let view: ReplayView | null = null;

/** The time in the address, s. */
function timeInAddress(): number | null {
  const found = /[#&]t=([0-9.]+)/.exec(location.hash);
  const time = Number(found?.[1] ?? NaN);
  return Number.isFinite(time) ? time : null;
}

/** Shows the loaded runs, at the time of the previous view. */
function show(): void {
  const start = view?.player.time ?? timeInAddress() ?? 0;
  view?.dispose();
  view = new ReplayView(app, loaded, start, {
    addRun: (other) => void compareRun(other),
    addFile: (file) => void compareFile(file),
    remove:
      loaded.length > 1
        ? () => {
            loaded = loaded.slice(0, 1);
            address(null);
            show();
          }
        : null,
  });
  const shown = view;
  document.title = `${loaded.map(({ recording }) => recording.info.get('team') ?? '–').join(' and ')} – Replay – Palmares`;
  window.palmares = {
    stage: shown.stages[0],
    stages: shown.stages,
    recording: loaded[0]?.recording,
    recordings: loaded.map((one) => one.recording),
    player: shown.player,
    time: () => shown.player.time,
  };
}

/** Writes the second run into the address. */
function address(other: string | null): void {
  const here = new URL(location.href);
  if (other === null) here.searchParams.delete('with');
  else here.searchParams.set('with', other);
  history.replaceState(null, '', here);
}

/** Shows progress, or an error. */
function waiting(): { say: (words: string) => void; fail: (error: unknown) => void } {
  const status = el('p', { role: 'status' });
  app.className = '';
  app.replaceChildren(el('h1', {}, 'Replay'), status);
  return {
    say: (words) => {
      status.textContent = words;
    },
    fail: (error) => {
      status.className = 'notice bad';
      status.setAttribute('role', 'alert');
      status.textContent = errorText(error);
      const form = error instanceof ReplayUnavailable && error.wantsToken ? [tokenForm(() => void fetchRuns())] : [];
      app.append(el('div', { class: 'stack' }, ...form, chooser()));
    },
  };
}

/** Loads the run in the address, and the second one. */
async function fetchRuns(): Promise<void> {
  const { say, fail } = waiting();
  say('Downloading the replay …');
  try {
    loaded = [await fromServer(run, token, say)];
  } catch (error) {
    fail(error);
    return;
  }
  const other = new URLSearchParams(location.search).get('with');
  if (!other) show();
  else if (!(await compareRun(other, say))) show();
}

/** Adds a second run from this server; returns whether that worked. */
async function compareRun(other: string, say: (words: string) => void = () => undefined): Promise<boolean> {
  try {
    const second = await fromServer(other, token, say);
    loaded = [...loaded.slice(0, 1), second];
    address(other);
    show();
    return true;
  } catch (error) {
    toast(`${other}: ${errorText(error)}`, true);
    return false;
  }
}

async function compareFile(file: File): Promise<void> {
  try {
    loaded = [...loaded.slice(0, 1), await fromFile(file, () => undefined)];
    address(null);
    show();
  } catch (error) {
    toast(`${file.name}: ${errorText(error)}`, true);
  }
}

async function openFile(file: File | undefined): Promise<void> {
  if (!file) return;
  if (view) return compareFile(file);
  const { say, fail } = waiting();
  try {
    loaded = [await fromFile(file, say)];
    show();
  } catch (error) {
    fail(error);
  }
}

function tokenForm(use: () => void): HTMLElement {
  const field = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false' });
  return el(
    'form',
    {
      class: 'panel',
      on: {
        submit: (event) => {
          event.preventDefault();
          token = field.value.trim() || null;
          use();
        },
      },
    },
    el(
      'div',
      { class: 'field' },
      el('label', { for: 'token' }, 'Token'),
      field,
      el('p', { class: 'hint' }, 'This page keeps it only in memory.'),
    ),
    el('button', { type: 'submit' }, 'Use this token'),
  );
}

/** Form for a local file, chosen or dropped. */
function chooser(): HTMLElement {
  const input = el('input', { type: 'file', id: 'file', accept: '.mcap' });
  input.addEventListener('change', () => void openFile(input.files?.[0]));
  return el(
    'div',
    { class: 'drop stack' },
    el('label', { for: 'file' }, 'Open an MCAP file recorded by Palmares'),
    el('div', {}, input),
    el('p', { class: 'hint' }, 'Or drop it anywhere on this page. The file stays on this computer.'),
  );
}

document.addEventListener('dragover', (event) => {
  event.preventDefault();
  document.body.classList.add('dropping');
});
document.addEventListener('dragleave', (event) => {
  if (event.relatedTarget === null) document.body.classList.remove('dropping');
});
document.addEventListener('drop', (event) => {
  event.preventDefault();
  document.body.classList.remove('dropping');
  void openFile(event.dataTransfer?.files[0]);
});
window.addEventListener('hashchange', () => {
  const time = timeInAddress();
  if (time !== null) view?.player.seek(time);
});

/** `/replay` without a run: the server's runs, and a file. */
function start(): void {
  const list = new ReplayList((chosen) => {
    run = chosen;
    history.pushState(null, '', `/replay/${encodeURIComponent(chosen)}`);
    window.addEventListener('popstate', () => location.reload());
    void fetchRuns();
  });
  app.replaceChildren(
    el(
      'div',
      { class: 'title' },
      el('h1', {}, 'Replay'),
      el('p', { class: 'lead' }, 'Play a recorded run and look at its motors, forces and score.'),
    ),
    el(
      'div',
      { class: 'stack' },
      list.element,
      chooser(),
      el(
        'details',
        { class: 'panel' },
        el('summary', {}, 'I have a token'),
        tokenForm(() => void list.load(token)),
      ),
    ),
  );
  void list.load(null);
}

if (run) void fetchRuns();
else start();
