/** `/hands`: the hands; `/hands/NAME`: one of them. Links between them stay in this document, which keeps the token in memory. */
import '../style/base.css';
import '../style/hands.css';
import { getJson } from '../net/api';
import { el, mainElement, name } from '../ui/elements';
import { type Access, describeHand, ANONYMOUS } from '../hands/access';
import { HandListView, type Opener } from '../hands/list';
import type { HandView } from '../hands/view';
import { teamForm } from '../hands/team_form';
import type { HandDescription, SubmittedHand } from '../wire/messages';

class Page implements Opener {
  access: Access = ANONYMOUS;
  official = false;
  private view: HandView | null = null;

  constructor(private readonly app: HTMLElement) {}

  async begin(hand: string): Promise<void> {
    try {
      this.official = (await getJson<{ mode: string }>('/v1/competition')).mode !== 'practice';
    } catch (error) {
      this.fail('Hands', error);
      return;
    }
    window.addEventListener('popstate', () => this.show(handOf(location.pathname), null));
    // The link to the list stays in this document, too.
    this.app.addEventListener('click', (event) => {
      const link = event.target instanceof Element ? event.target.closest('a') : null;
      if (link?.getAttribute('href') !== '/hands' || event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      history.pushState(null, '', '/hands');
      this.show('', null);
    });
    this.show(hand, null);
  }

  open(hand: string, check?: SubmittedHand): void {
    history.pushState(null, '', `/hands/${encodeURIComponent(hand)}`);
    this.show(hand, check ?? null);
  }

  private show(hand: string, check: SubmittedHand | null): void {
    this.view?.dispose();
    this.view = null;
    this.app.classList.remove('stage-page', 'hand-page');
    if (hand === '') {
      document.title = 'Hands \u2013 Palmares';
      new HandListView(this.app, this);
    } else {
      void this.look(hand, check);
    }
  }

  private async look(hand: string, check: SubmittedHand | null): Promise<void> {
    this.app.replaceChildren(el('p', { role: 'status' }, 'Loading …'));
    let description: HandDescription;
    let module: typeof import('../hands/view');
    try {
      [description, module] = await Promise.all([describeHand(hand, this.access), import('../hands/view')]);
    } catch (error) {
      this.fail(hand, error);
      this.app.append(
        el(
          'section',
          { class: 'panel' },
          el('h2', {}, 'Is it your team’s own hand?'),
          teamForm(this.official, this.access, (access) => {
            this.access = access;
            this.show(hand, null);
          }),
        ),
      );
      return;
    }
    // The person has opened another page meanwhile.
    if (handOf(location.pathname) !== hand) return;
    document.title = `${description.name} \u2013 Palmares`;
    this.view = new module.HandView(this.app, description, this, check, el('h1', {}, name(description.name)));
  }

  private fail(hand: string, error: unknown): void {
    this.app.replaceChildren(
      el('h1', {}, name(hand)),
      el('p', { class: 'notice bad', role: 'alert' }, error instanceof Error ? error.message : String(error)),
      el('p', {}, el('a', { href: '/hands' }, 'All hands')),
    );
  }
}

/** The hand in an address. */
function handOf(path: string): string {
  return decodeURIComponent(/^\/hands\/([^/]+)$/.exec(path)?.[1] ?? '');
}

const app = mainElement();
void new Page(app).begin(document.body.dataset['arg'] ?? '');
