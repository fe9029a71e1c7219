/** The state of a competition in sentences: phase, pause, places, next slot. */
import { clock } from '../ui/format';
import type { CompetitionResponse } from '../wire/messages';

const PHASES = { closed: 'not open yet', open: 'open', revealed: 'over' } as const;

/** The fields that the sentences need. */
export type Standing = Pick<CompetitionResponse, 'mode' | 'phase' | 'paused_unix_ms' | 'places' | 'schedule'> &
  Partial<Pick<CompetitionResponse, 'worlds'>>;

/** The sentences; empty on a practice server. */
export function standing(info: Standing): string {
  if (info.mode !== 'official') return '';
  if (typeof info.paused_unix_ms === 'number' && info.phase !== 'revealed') return 'The competition is paused: all clocks are stopped.';
  const sentences = [`The competition is ${PHASES[info.phase ?? 'closed']}.`];
  const { places, schedule } = info;
  if (info.phase === 'open' && places && places.playing > 0) {
    const within = places.free_within_s;
    if (places.playing < places.total) sentences.push(`${places.playing} of ${places.total} places are in use.`);
    else
      sentences.push(
        `All ${places.total} places are in use${typeof within === 'number' ? `; the next is free in at most ${clock(within)}` : ''}.`,
      );
  }
  const waiting = info.worlds?.waiting ?? 0;
  if (info.phase === 'open' && waiting > 0) sentences.push(`${waiting === 1 ? '1 team waits' : `${waiting} teams wait`} for a place.`);
  const next = schedule?.next_unix_ms;
  if (info.phase === 'open' && typeof next === 'number') {
    const at = new Date(next);
    const two = (n: number): string => String(n).padStart(2, '0');
    const date =
      at.toDateString() === new Date().toDateString() ? '' : `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} `;
    sentences.push(`The next slot begins at ${date}${two(at.getHours())}:${two(at.getMinutes())}.`);
  }
  return sentences.join(' ');
}
