/** `/docs`: shows the results of a search while its words are typed. The text and the list are the server's. */
import '../style/base.css';
import '../style/docs.css';
import { mainElement } from '../ui/elements';

/** Time without a key after which the search is sent, ms. */
const PAUSE_MS = 200;

const field = document.querySelector<HTMLInputElement>('#find');
let timer = 0;
let request = new AbortController();

/** Replaces the text by the results for these words. */
async function show(words: string): Promise<void> {
  request.abort();
  request = new AbortController();
  const address = `/docs/search?q=${encodeURIComponent(words)}`;
  const answer = await fetch(address, { signal: request.signal });
  if (!answer.ok) return;
  const page = new DOMParser().parseFromString(await answer.text(), 'text/html');
  const [found, shown] = [page.querySelector('article'), mainElement().querySelector('article')];
  if (found === null || shown === null) return;
  shown.replaceWith(found);
  // The button Back leads to the document where the search began.
  if (location.pathname === '/docs/search') history.replaceState(null, '', address);
  else history.pushState(null, '', address);
}

// A long list begins at the document that is shown.
const list = document.querySelector<HTMLElement>('#list');
const current = list?.querySelector<HTMLElement>('[aria-current]');
if (list && current) list.scrollTop = current.offsetTop - list.offsetTop - 40;

field?.addEventListener('input', () => {
  clearTimeout(timer);
  const words = field.value.trim();
  if (words === '') return;
  timer = window.setTimeout(() => {
    show(words).catch((error: unknown) => {
      // A newer search replaces this one; without the server the form still says so.
      if (!(error instanceof DOMException || error instanceof TypeError)) throw error;
    });
  }, PAUSE_MS);
});
// Back and forward lead to other documents.
window.addEventListener('popstate', () => location.reload());
