// Messages above the views: errors, warnings, and the progress of long work.
import { byId, elementOf, icon } from './dom';

export type BannerKind = 'error' | 'warning' | 'note';

function close(label: string, onClick: () => void): HTMLElement {
  const button = elementOf('button', { type: 'button', 'aria-label': label }, icon('close'));
  button.addEventListener('click', onClick);
  return button;
}

/** Shows a message until it is closed, in place of the same one before; a note also goes by itself. */
export function showBanner(kind: BannerKind, text: string): void {
  for (const other of [...byId('banners').children]) if (other.textContent === text) other.remove();
  const banner = elementOf('div', { class: `banner ${kind}`, role: kind === 'error' ? 'alert' : undefined }, elementOf('p', {}, text));
  banner.append(close('Close', () => banner.remove()));
  byId('banners').append(banner);
  if (kind === 'note') setTimeout(() => banner.remove(), 12_000);
}

export function clearBanners(): void {
  byId('banners').replaceChildren();
}

/** The progress of work, which may be cancelled. It is unknown until it is set. */
export class ProgressBanner {
  private readonly bar = elementOf('progress', { max: 1 });
  private readonly element: HTMLElement;

  constructor(text: string, cancel?: () => void) {
    this.bar.setAttribute('aria-label', text);
    this.element = elementOf('div', { class: 'banner note' }, elementOf('p', {}, text), this.bar);
    if (cancel) this.element.append(close('Cancel', cancel));
    byId('banners').append(this.element);
  }
  set(fraction: number): void { this.bar.value = fraction; }
  remove(): void { this.element.remove(); }
}

/** The one line that says what went wrong. */
export const messageOf = (error: unknown): string => withoutOptions(error instanceof Error ? error.message : String(error));

/** A message of the package without what it says about its options, which users of the page do not see. */
export const withoutOptions = (text: string): string => text.replace(/[;:] ([^;:]*\bthe option \w+[^;:]*|inspectScan lists all)/g, '');
