/** The time slots of teams: import from CSV, add, move, remove. */
import { dateTime } from '../ui/format';
import { button, el, name } from '../ui/elements';
import { confirmAction, type ActionDialog, type Field } from './dialog';
import type { AdminClient, Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import type { Schedule, Slot } from '../wire/messages';

const STATES = { later: ['later', 'info'], now: ['now', 'ok'], over: ['over', 'soft'] } as const;

/** A time in ms since 1970 as the local time of a form field. */
export function fieldTime(unixMs: number): string {
  const at = new Date(unixMs);
  return new Date(unixMs - at.getTimezoneOffset() * 60_000).toISOString().slice(0, 19);
}

/** The local time of a form field with its offset, for the server. */
export function wireTime(field: string | undefined): string {
  return new Date(field ?? '').toISOString();
}

/** The tab. */
export function scheduleTab(admin: AdminClient): Tab {
  const warnings = el('ul', { class: 'plain' });
  const notice = el('div', { class: 'notice', role: 'status', hidden: true }, el('b', {}, 'To check'), warnings);
  const line = el('p', { class: 'soft', role: 'status' });
  const table = new KeyedTable<Slot>(
    [
      { head: 'Team' },
      { head: 'State' },
      { head: 'Begins' },
      { head: 'Ends' },
      { head: 'Minutes', class: 'n' },
      { head: '', class: 'wide' },
    ],
    (slot) => `${slot.team} ${slot.begins_unix_ms}`,
    (slot) => {
      const [word, colour] = STATES[slot.state as keyof typeof STATES];
      return [
        name(slot.team),
        el('span', { class: `badge ${colour}` }, word),
        dateTime(slot.begins_unix_ms),
        dateTime(slot.ends_unix_ms),
        Math.round((slot.ends_unix_ms - slot.begins_unix_ms) / 60_000),
        el(
          'div',
          { class: 'row' },
          button('Move…', () => void confirmAction(move(slot)), { class: 'small' }),
        ),
      ];
    },
    { label: 'Schedule', empty: 'No schedule: every team can begin its session at any time while the competition is open.' },
  );

  /** Sends a change and shows the schedule that the server returns. */
  async function change(verb: string, body: Record<string, unknown>): Promise<string> {
    show(await admin.post<Schedule>(`/v1/admin/schedule/${verb}`, body));
    return 'The schedule is changed.';
  }

  const times = (begins: number, ends: number): Field[] => [
    { name: 'begins', label: 'Begins', type: 'datetime-local', value: fieldTime(begins), hint: 'In the time zone of this browser.' },
    { name: 'ends', label: 'Ends', type: 'datetime-local', value: fieldTime(ends) },
  ];
  const move = (slot: Slot): ActionDialog => ({
    title: ['Move the slot of ', name(slot.team)],
    text: 'The team can begin its session in the new slot only.',
    verb: 'Move',
    fields: times(slot.begins_unix_ms, slot.ends_unix_ms),
    act: (reason, { begins, ends }) =>
      change('move', {
        team: slot.team,
        from: new Date(slot.begins_unix_ms).toISOString(),
        begins_at: wireTime(begins),
        ends_at: wireTime(ends),
        reason,
      }),
  });
  const add = (): ActionDialog => ({
    title: 'Add a slot',
    text: 'With a schedule, only teams with a slot can begin a session.',
    verb: 'Add',
    fields: [{ name: 'team', label: 'Team', maxlength: 200 }, ...times(Date.now() + 600_000, Date.now() + 3_000_000)],
    act: (reason, { team, begins, ends }) => change('add', { team, begins_at: wireTime(begins), ends_at: wireTime(ends), reason }),
  });
  const shift = (): ActionDialog => ({
    title: 'Move all slots',
    text: 'Moves every slot that has not begun.',
    verb: 'Move',
    fields: [
      {
        name: 'minutes',
        label: 'Minutes',
        type: 'number',
        value: '15',
        min: -1440,
        max: 1440,
        hint: 'A negative number moves to earlier times.',
      },
    ],
    act: (reason, { minutes }) => change('move', { by_s: Math.round(60 * Number(minutes)), reason }),
  });
  const clear = (): ActionDialog => ({
    title: 'Remove slots',
    text: 'Without any slot, every team can begin its session at any time while the competition is open.',
    verb: 'Remove',
    danger: true,
    fields: [{ name: 'team', label: 'Team', maxlength: 200, optional: true, hint: 'Empty for all teams.' }],
    act: (reason, { team }) => change('clear', { ...(team === undefined || team === '' ? {} : { team }), reason }),
  });

  const file = el('input', {
    type: 'file',
    accept: '.csv,text/csv',
    hidden: true,
    'aria-label': 'CSV file',
    on: { change: () => void chosen() },
  });
  async function chosen(): Promise<void> {
    const [one] = file.files ?? [];
    if (one === undefined) return;
    const csv = await one.text();
    file.value = '';
    await confirmAction({
      title: ['Import ', name(one.name)],
      text: 'The file replaces the whole schedule.',
      verb: 'Import',
      act: (reason) => change('import', { csv, reason }),
    });
  }

  const removeAll = button('Remove…', () => void confirmAction(clear()), { class: 'danger' });
  const moveAll = button('Move all…', () => void confirmAction(shift()));
  // Until the slots are known there are none.
  removeAll.hidden = moveAll.hidden = true;

  function show(schedule: Schedule): void {
    const { slots, places } = schedule;
    notice.hidden = schedule.warnings.length === 0;
    warnings.replaceChildren(...schedule.warnings.map((text) => el('li', {}, name(text))));
    const running = slots.filter((slot) => slot.state === 'now').length;
    line.textContent = slots.length === 0 ? '' : `${running} of ${slots.length} slots run now. There are ${places} places.`;
    removeAll.hidden = moveAll.hidden = slots.length === 0;
    table.show(slots);
  }

  return {
    id: 'schedule',
    title: 'Schedule',
    period: 10_000,
    element: el(
      'section',
      { class: 'panel' },
      el(
        'div',
        { class: 'row head' },
        el('h2', {}, 'Schedule'),
        el(
          'span',
          { class: 'end row' },
          removeAll,
          moveAll,
          button('Add a slot…', () => void confirmAction(add())),
          button('Import a CSV file…', () => file.click(), { class: 'primary' }),
          file,
        ),
      ),
      el(
        'p',
        { class: 'soft' },
        'Columns of the file: team, begins_at, ends_at. Times state their offset from UTC: 2027-05-04T09:00:00+02:00.',
      ),
      notice,
      line,
      table.element,
    ),
    async refresh() {
      show(await admin.get<Schedule>('/v1/admin/schedule'));
    },
  };
}
