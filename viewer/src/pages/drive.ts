/** `/drive`: a person controls a hand, on practice servers. */
import '../style/base.css';
import '../style/drive.css';
import { getJson } from '../net/api';
import { el, mainElement, name } from '../ui/elements';
import { DriveView } from '../drive/view';
import type { CompetitionResponse } from '../wire/messages';

async function open(app: HTMLElement): Promise<void> {
  let competition: CompetitionResponse;
  try {
    competition = await getJson<CompetitionResponse>('/v1/competition');
  } catch (error) {
    app.replaceChildren(
      el('h1', {}, 'Drive'),
      el('p', { class: 'notice bad' }, `${error instanceof Error ? error.message : String(error)}. Reload the page to try again.`),
    );
    return;
  }
  if (competition.mode !== 'practice') {
    app.replaceChildren(
      el('h1', {}, 'Drive'),
      el('p', { class: 'notice' }, 'Only practice servers have this page; this server runs the competition ', name(competition.name), '.'),
      el('p', {}, 'Start a practice server with ', el('code', {}, 'palmares serve'), ' and open its page ', el('code', {}, '/drive'), '.'),
    );
    return;
  }
  app.replaceChildren();
  new DriveView(app);
}

void open(mainElement());
