// Keys that work everywhere on the page.
import type { Store, Tool } from './state';

export interface KeyActions {
  openFolder(): void; openFile(): void; savePicture(): void; export(): void; help(): void; theme(): void; reset(): void;
  lookFrom(direction: string): void;
}

export function listenToKeys(store: Store, actions: KeyActions): void {
  const tool = (name: Tool) => () => store.set({ tool: name, picked: undefined });
  const plain: Record<string, () => void> = {
    n: tool('navigate'), d: tool('distance'), k: tool('crop'), r: actions.reset, b: actions.theme, '?': actions.help,
    Escape: () => store.set(store.state.picked ? { picked: undefined } : { tool: 'navigate', layout: innerWidth > 700 ? 'all' : store.state.layout }),
    ...Object.fromEntries(['A', 'P', 'L', 'R', 'S', 'I'].map((from, i) => [String(i + 1), () => actions.lookFrom(from)])),
  };
  const withControl: Record<string, () => void> = { s: actions.export, p: actions.savePicture };
  const needsScan = new Set(['n', 'd', 'k', 'r', 'Escape', 's', 'p', '1', '2', '3', '4', '5', '6']);

  addEventListener('keydown', (e) => {
    if (document.querySelector('dialog[open]') || e.altKey) return;
    const control = e.ctrlKey || e.metaKey, key = e.key.length === 1 ? e.key.toLowerCase() : e.key;
    const types = e.target instanceof HTMLInputElement && ['number', 'text'].includes(e.target.type) || e.target instanceof HTMLSelectElement;
    if (types && !control) {
      if (key === 'Escape' && e.target instanceof HTMLInputElement) e.target.value = e.target.defaultValue;
      if (key === 'Enter' || key === 'Escape') (e.target as HTMLElement).blur();
      return;
    }
    const action = control ? (key === 'o' ? (e.shiftKey ? actions.openFolder : actions.openFile) : withControl[key]) : plain[key];
    if (!action) return;
    e.preventDefault();
    if (types) (e.target as HTMLElement).blur(); // accepts what is typed, as Enter does
    if (store.state.scan || !needsScan.has(key)) action();
  });
}
