/** Tabs after the WAI-ARIA pattern: arrow keys move between them, and the visible one is refreshed. */
import { el } from '../ui/elements';
import { errorText, type Tab } from './admin_client';

/** Shows the tabs, initially the one in the address or the first. The returned function stops the refreshes. */
export function showTabs(parent: HTMLElement, tabs: readonly Tab[]): () => void {
  const error = el('p', { class: 'notice bad', role: 'alert', hidden: true });
  const buttons = tabs.map((tab) =>
    el(
      'button',
      {
        type: 'button',
        role: 'tab',
        id: `tab-${tab.id}`,
        'aria-controls': `panel-${tab.id}`,
        on: { click: () => choose(tab) },
      },
      tab.title,
    ),
  );
  const panels = tabs.map((tab) =>
    el('div', { role: 'tabpanel', id: `panel-${tab.id}`, 'aria-labelledby': `tab-${tab.id}`, hidden: true }, tab.element),
  );
  const bar = el(
    'div',
    { class: 'tabs', role: 'tablist', 'aria-label': 'Organizer tabs', on: { keydown: (event) => steer(event as KeyboardEvent) } },
    ...buttons,
  );
  parent.append(bar, error, ...panels);
  let chosen: Tab | null = null;
  let timer = 0;
  let over = false;

  function choose(tab: Tab): void {
    chosen = tab;
    tabs.forEach((one, index) => {
      const yes = one === tab;
      buttons[index]?.setAttribute('aria-selected', String(yes));
      buttons[index]?.setAttribute('tabindex', yes ? '0' : '-1');
      const panel = panels[index];
      if (panel !== undefined) panel.hidden = !yes;
    });
    buttons[tabs.indexOf(tab)]?.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    history.replaceState(null, '', `#${tab.id}`);
    window.clearTimeout(timer);
    void again(tab);
  }

  /** Refreshes the tab, and again after its period while it is visible. */
  async function again(tab: Tab): Promise<void> {
    try {
      if (!document.hidden) await tab.refresh();
      error.hidden = true;
    } catch (failure) {
      error.textContent = `Not up to date: ${errorText(failure)}.`;
      error.hidden = false;
    }
    if (chosen === tab && !over) timer = window.setTimeout(() => void again(tab), tab.period);
  }

  function steer(event: KeyboardEvent): void {
    const at = tabs.findIndex((tab) => tab === chosen);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    const index = (to + tabs.length) % tabs.length;
    const tab = tabs[index];
    if (tab !== undefined) choose(tab);
    buttons[index]?.focus();
  }

  const first = tabs.find((tab) => location.hash === `#${tab.id}`) ?? tabs[0];
  if (first !== undefined) choose(first);
  return () => {
    over = true;
    window.clearTimeout(timer);
  };
}
