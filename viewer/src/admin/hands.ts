/** The teams' own hands: drawings and figures, compared with the built-in hands and the limits; approve or reject. */
import { figureTable } from '../hands/figure_table';
import { dateTime } from '../ui/format';
import { button, type Child, el, facts, name } from '../ui/elements';
import { confirmAction, type ActionDialog } from './dialog';
import { type AdminClient, errorText, type Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import { sides } from '../hands/hand_views';
import type { HandRow, ShownHand } from '../wire/messages';

const COLOUR: Record<string, string> = { pending: 'warn', approved: 'ok', rejected: 'bad' };

/** The tab. */
export function handsTab(admin: AdminClient): Tab {
  const details = el('section', { class: 'panel', tabindex: -1, hidden: true, 'aria-label': 'Details of the hand' });
  let at: string | null = null;
  const table = new KeyedTable<HandRow>(
    [
      { head: 'Hand' },
      { head: 'Team' },
      { head: 'State' },
      { head: 'Uploaded' },
      { head: 'Warnings', class: 'wide' },
      { head: '', class: 'wide' },
    ],
    (hand) => hand.hand_id,
    (hand) => [
      [name(hand.name), el('span', { class: 'id' }, hand.hand_id)],
      name(hand.team),
      el('span', { class: `badge ${COLOUR[hand.status] ?? ''}` }, hand.status),
      dateTime(hand.created_unix_ms),
      hand.warnings.length === 0 ? 'none' : el('ul', { class: 'plain' }, ...hand.warnings.map((text) => el('li', {}, text))),
      el(
        'div',
        { class: 'row' },
        button('Details', () => void look(hand.hand_id), { class: 'small' }),
        ...decide(hand),
      ),
    ],
    { label: 'Teams’ own hands', empty: 'No team has uploaded a hand.' },
  );

  function decide(hand: HandRow): Child[] {
    return [
      hand.status !== 'approved' && button('Approve…', () => void confirmAction(dialog(hand, 'Approve', 'approve')), { class: 'small' }),
      hand.status !== 'rejected' &&
        button('Reject…', () => void confirmAction(dialog(hand, 'Reject', 'reject')), { class: 'small danger' }),
    ];
  }

  function dialog(hand: HandRow, verb: string, path: string): ActionDialog {
    const warned = hand.warnings.length > 0 && path === 'approve' ? ` The check found: ${hand.warnings.join('; ')}.` : '';
    return {
      title: [`${verb} `, name(hand.name), ' of ', name(hand.team)],
      verb,
      danger: path === 'reject',
      needsReason: path === 'reject',
      text: `${path === 'approve' ? 'The team may use it in the competition.' : 'The team cannot use it in the competition. The team sees the reason.'}${warned}`,
      act: async (reason) => {
        await admin.post(`/v1/admin/hand/${path}`, { hand_id: hand.hand_id, reason });
        await tab.refresh();
        if (at === hand.hand_id) void look(hand.hand_id);
        return `${verb}: done.`;
      },
    };
  }

  async function look(id: string): Promise<void> {
    at = id;
    details.hidden = false;
    details.replaceChildren(el('p', { role: 'status' }, 'Measuring the hand …'));
    try {
      const shown = await admin.get<ShownHand>(`/v1/admin/hands/${encodeURIComponent(id)}`);
      if (at === id) details.replaceChildren(...about(shown));
    } catch (error) {
      details.replaceChildren(el('p', { class: 'error', role: 'alert' }, errorText(error)));
    }
    details.focus();
    details.scrollIntoView({ block: 'start' });
  }

  function about({ hand, figures, in_the_way: way, description }: ShownHand): HTMLElement[] {
    return [
      el(
        'div',
        { class: 'row head' },
        el('h2', {}, name(hand.name), ' of ', name(hand.team)),
        el('span', { class: `badge ${COLOUR[hand.status] ?? ''}` }, hand.status),
        el(
          'span',
          { class: 'end row' },
          ...decide(hand),
          button('Archive', () => void admin.save(`/v1/admin/hands/${encodeURIComponent(hand.hand_id)}/archive`, `${hand.hand_id}.zip`), {
            class: 'small',
          }),
          button(
            'Close',
            () => {
              at = null;
              details.hidden = true;
              details.replaceChildren();
            },
            { class: 'small' },
          ),
        ),
      ),
      description === undefined
        ? el(
            'p',
            { class: 'notice' },
            'This server does not send the hand’s shapes. For an image run ',
            el('code', {}, `palmares admin hand show ${hand.hand_id} -o sides.png`),
            '.',
          )
        : sides(description),
      facts([
        ['Uploaded', dateTime(hand.created_unix_ms)],
        ['Decided', dateTime(hand.decided_unix_ms)],
        ['Note', hand.note ?? '–'],
        ['SHA-256', el('code', {}, hand.sha256)],
        ['Touches at the start', way.length === 0 ? 'nothing' : el('ul', { class: 'plain bad' }, ...way.map((text) => el('li', {}, text)))],
      ]),
      el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Figures' }, figureTable(figures)),
    ];
  }

  const tab: Tab = {
    id: 'hands',
    title: 'Hands',
    period: 10_000,
    element: el('div', { class: 'stack' }, table.element, details),
    async refresh() {
      const { hands } = await admin.get<{ hands: HandRow[] }>('/v1/admin/hands');
      const waits = (hand: HandRow): number => (hand.status === 'pending' ? 0 : 1);
      table.show([...hands].sort((a, b) => waits(a) - waits(b)));
    },
  };
  return tab;
}
