// The line at the bottom: what is open.
import { byId, elementOf, sizeText } from '../dom';
import { openOtherSeries } from '../scan/open';
import type { Store } from '../state';

export function makeStatus(store: Store): void {
  store.on(['scan', 'input'], () => {
    const { scan, input } = store.state;
    if (!scan) return;
    const parts = [scan.format, scan.dims.join(' × '), `${scan.spacing.map((s) => Number(s.toPrecision(4))).join(' × ')} mm`, scan.sampleType, scan.modality, sizeText(scan.bytes)];
    byId('status').replaceChildren(elementOf('span', { class: 'name', title: scan.description }, scan.name),
      ...parts.filter(Boolean).map((part) => elementOf('span', {}, part)));
    if (input && (input.report.series.length > 1 || input.report.series.some((s) => s.volumeCount > 1))) {
      const button = elementOf('button', { class: 'text', type: 'button' }, 'Other series…');
      button.addEventListener('click', () => void openOtherSeries(store));
      byId('status').append(button);
    }
  });
}
