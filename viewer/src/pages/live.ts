/** `/live`: the runs that can be watched; `/live/SESSION`: one of them. */
import '../style/base.css';
import { LiveView } from '../live/view';
import { RunList } from '../live/list';
import { mainElement } from '../ui/elements';

const session = document.body.dataset['arg'] ?? '';
if (session) new LiveView(mainElement(), session === 'featured' ? { featured: true } : { session_id: session });
else new RunList(mainElement());
