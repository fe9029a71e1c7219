/** `/hands`: the hands, each with drawings, and the upload form. */
import { el, name } from '../ui/elements';
import { VIEWS, turntable } from './outline';
import { side } from './hand_views';
import { type Access, describeHand, listHands } from './access';
import { uploadForm } from './upload';
import { teamForm } from './team_form';
import type { HandInfo, Hands, SubmittedHand } from '../wire/messages';

/** The page around this view. */
export interface Opener {
  access: Access;
  readonly official: boolean;
  open(hand: string, check?: SubmittedHand): void;
}

export class HandListView {
  private readonly cards = el('div', { class: 'hand-cards' });
  private readonly says = el('p', { class: 'soft', role: 'status' });
  private readonly own = el('section', { class: 'panel', hidden: true });

  constructor(
    app: HTMLElement,
    private readonly page: Opener,
  ) {
    const { official } = page;
    app.replaceChildren(
      el(
        'div',
        { class: 'title' },
        el('h1', {}, 'Hands'),
        el('p', { class: 'lead' }, 'Close a hand, push it, and see its joints, tendons and links.'),
      ),
      this.says,
      this.cards,
      this.own,
      el(
        'div',
        { class: 'columns' },
        el(
          'section',
          { class: 'panel' },
          el('h2', {}, 'Your team'),
          teamForm(official, page.access, (access) => {
            page.access = access;
            void this.load();
          }),
        ),
        el(
          'section',
          { class: 'panel' },
          el('h2', {}, 'Your own hand'),
          el(
            'p',
            { class: 'hint' },
            'The server checks it and keeps it for your team; then you can use it on this page. How to make one: docs/hands.md.',
          ),
          uploadForm(
            () => page.access,
            official,
            (hand) => page.open(hand.name, hand),
          ),
        ),
      ),
    );
    void this.load();
  }

  private async load(): Promise<void> {
    let list: Hands;
    try {
      list = await listHands(this.page.access);
    } catch (error) {
      this.says.className = 'error';
      this.says.textContent = error instanceof Error ? error.message : String(error);
      return;
    }
    this.says.className = 'soft';
    this.says.textContent = '';
    const { own = [] } = list;
    this.cards.replaceChildren(
      ...list.hands.map((hand) =>
        this.card(
          hand,
          own.some((one) => one.name === hand.name),
        ),
      ),
    );
    this.own.hidden = own.length === 0;
    this.own.replaceChildren(
      el('h2', {}, 'Uploaded by your team'),
      el(
        'ul',
        { class: 'plain' },
        ...own.map((hand) =>
          el(
            'li',
            {},
            name(hand.name),
            ' ',
            el('span', { class: `badge ${hand.status === 'approved' ? 'ok' : hand.status === 'rejected' ? 'bad' : 'warn'}` }, hand.status),
            hand.note === null ? null : el('span', { class: 'soft' }, ' ', name(hand.note)),
          ),
        ),
      ),
    );
  }

  private card(hand: HandInfo, own: boolean): HTMLElement {
    const count = (n: number, what: string): string => `${n} ${what}${n === 1 ? '' : 's'}`;
    const link = el('a', { href: `/hands/${encodeURIComponent(hand.name)}` }, name(hand.name));
    link.addEventListener('click', (event) => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      this.page.open(hand.name);
    });
    const drawings = el('div', { class: 'pair' });
    void this.draw(hand.name, drawings);
    return el(
      'article',
      { class: 'card hand-card' },
      drawings,
      el('h2', {}, link, own ? el('span', { class: 'badge info' }, 'your team’s') : null),
      el('p', { class: 'soft' }, `${count(hand.joints.length, 'coordinate')}, ${count(hand.motors.length, 'motor')}`),
      el('p', {}, name(hand.description)),
    );
  }

  private async draw(hand: string, into: HTMLElement): Promise<void> {
    try {
      const description = await describeHand(hand, this.page.access);
      into.replaceChildren(side(description, 'palm', VIEWS.palm), side(description, 'at an angle', turntable(0.7)));
    } catch {
      /* The card has no drawings. */
    }
  }
}
