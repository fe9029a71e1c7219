/** Hands that teams sent in: their figures beside those of the program's hands and the limits; approve or reject. */
import { figureTable } from '../hands/figure_table';
import { dateTime } from '../ui/format';
import { button, type Child, el, facts, name } from '../ui/elements';
import { confirmAction, type ActionDialog } from './dialog';
import { type AdminClient, errorText, type Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import { sides } from '../hands/hand_views';
import type { Hand, ShownHand } from './types';

const COLOUR: Record<string, string> = { pending: 'warn', approved: 'ok', rejected: 'bad' };

/** The tab. */
export function handsTab(desk: AdminClient): Tab {
  const looked = el('section', { class: 'panel', tabindex: -1, hidden: true, 'aria-label': 'The hand that is looked at' });
  let at: string | null = null;
  const table = new KeyedTable<Hand>(
    [{ head: 'Hand' }, { head: 'Team' }, { head: 'State' }, { head: 'Came' }, { head: 'Warnings', class: 'wide' }, { head: '', class: 'wide' }],
    (hand) => hand.hand_id,
    (hand) => [
      [name(hand.name), el('span', { class: 'id' }, hand.hand_id)], name(hand.team), el('span', { class: `badge ${COLOUR[hand.status] ?? ''}` }, hand.status),
      dateTime(hand.created_unix_ms), hand.warnings.length === 0 ? 'none' : el('ul', { class: 'plain' }, ...hand.warnings.map((text) => el('li', {}, text))),
      el('div', { class: 'row' }, button('Look at it', () => { void look(hand.hand_id); }, { class: 'small' }), ...decide(hand)),
    ],
    { label: 'Teams’ own hands', empty: 'No team has sent in a hand.' });

  function decide(hand: Hand): Child[] {
    return [
      hand.status !== 'approved' && button('Approve…', () => { void confirmAction(question(hand, 'Approve', 'approve')); }, { class: 'small' }),
      hand.status !== 'rejected' && button('Reject…', () => { void confirmAction(question(hand, 'Reject', 'reject')); }, { class: 'small danger' }),
    ];
  }

  function question(hand: Hand, verb: string, path: string): ActionDialog {
    const warned = hand.warnings.length > 0 && path === 'approve' ? ` The check found: ${hand.warnings.join('; ')}.` : '';
    return {
      title: [`${verb} `, name(hand.name), ' of ', name(hand.team)], verb, danger: path === 'reject', needsReason: path === 'reject',
      text: `${path === 'approve' ? 'The team may play it in the competition.' : 'The team cannot play it in the competition. It reads the reason.'}${warned}`,
      act: async (reason) => {
        await desk.post(`/v1/admin/hand/${path}`, { hand_id: hand.hand_id, reason });
        await tab.refresh();
        if (at === hand.hand_id) void look(hand.hand_id);
        return `${verb}: done.`;
      },
    };
  }

  async function look(id: string): Promise<void> {
    at = id;
    looked.hidden = false;
    looked.replaceChildren(el('p', { role: 'status' }, 'The hand is measured …'));
    try {
      const shown = await desk.get<ShownHand>(`/v1/admin/hands/${encodeURIComponent(id)}`);
      if (at === id) looked.replaceChildren(...about(shown));
    } catch (error) {
      looked.replaceChildren(el('p', { class: 'error', role: 'alert' }, errorText(error)));
    }
    looked.focus();
    looked.scrollIntoView({ block: 'start' });
  }

  function about({ hand, figures, in_the_way: way, description }: ShownHand): HTMLElement[] {
    return [
      el('div', { class: 'row head' }, el('h2', {}, name(hand.name), ' of ', name(hand.team)), el('span', { class: `badge ${COLOUR[hand.status] ?? ''}` }, hand.status),
        el('span', { class: 'end row' }, ...decide(hand), button('Archive', () => { void desk.save(`/v1/admin/hands/${encodeURIComponent(hand.hand_id)}/archive`, `${hand.hand_id}.zip`); }, { class: 'small' }),
          button('Close', () => { at = null; looked.hidden = true; looked.replaceChildren(); }, { class: 'small' }))),
      description === undefined
        ? el('p', { class: 'notice' }, 'This server does not send the hand’s shapes. See it with ', el('code', {}, `palmares admin hand show ${hand.hand_id} -o sides.png`), '.')
        : sides(description),
      facts([['sent', dateTime(hand.created_unix_ms)], ['decided', dateTime(hand.decided_unix_ms)], ['note', hand.note ?? '–'], ['SHA-256', el('code', {}, hand.sha256)],
        ['in the way', way.length === 0 ? 'of nothing' : el('ul', { class: 'plain bad' }, ...way.map((text) => el('li', {}, text)))]]),
      el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Figures' }, figureTable(figures)),
    ];
  }

  const tab: Tab = {
    id: 'hands', title: 'Hands', period: 10_000,
    element: el('div', { class: 'stack' }, table.element, looked),
    async refresh() {
      const { hands } = await desk.get<{ hands: Hand[] }>('/v1/admin/hands');
      const waits = (hand: Hand): number => hand.status === 'pending' ? 0 : 1;
      table.show([...hands].sort((a, b) => waits(a) - waits(b)));
    },
  };
  return tab;
}
