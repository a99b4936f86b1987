// Light or dark: as the system, until the user says otherwise.
const KEY = 'marrow-theme';
const wish = matchMedia('(prefers-color-scheme: light)');
const listeners: (() => void)[] = [];

// Storage may be forbidden, as in private windows or in files from disk; then the choice lasts as long as the page.
function stored(): string | null {
  try { return localStorage.getItem(KEY); } catch { return null; }
}

function apply(theme: string): void {
  document.documentElement.dataset['theme'] = theme;
  for (const listener of listeners) listener();
}

/** `changed()` is called for what the style sheet does not reach. */
export function startTheme(changed: () => void): void {
  listeners.push(changed);
  apply(stored() ?? (wish.matches ? 'light' : 'dark'));
  wish.addEventListener('change', () => { if (!stored()) apply(wish.matches ? 'light' : 'dark'); });
}

export function toggleTheme(): void {
  const theme = document.documentElement.dataset['theme'] === 'light' ? 'dark' : 'light';
  try { localStorage.setItem(KEY, theme); } catch { /* as above */ }
  apply(theme);
}
