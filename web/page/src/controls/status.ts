// The line at the bottom: what is open.
import { byId, elementOf, sizeText } from '../dom';
import { inspectInput, openOtherSeries } from '../scan/open';
import type { Store } from '../state';

export function makeStatus(store: Store): void {
  store.on(['scan', 'input'], () => {
    const { scan, input } = store.state;
    if (!scan) return;
    const parts = [scan.format, scan.dims.join(' × '), `${scan.spacing.map((s) => Number(s.toPrecision(4))).join(' × ')} mm`, scan.sampleType, scan.modality, sizeText(scan.bytes)];
    byId('status').replaceChildren(elementOf('span', { class: 'name', title: scan.description }, scan.name),
      ...parts.filter(Boolean).map((part) => elementOf('span', {}, part)));
    const series = input?.report?.series ?? [];
    if (series.length > 1 || series.some((s) => s.volumeCount > 1)) {
      const button = elementOf('button', { class: 'text', type: 'button' }, 'Other series…');
      button.addEventListener('click', () => void openOtherSeries(store));
      byId('status').append(button);
    }
  });
  // What else the files hold can wait until the first surface is measured.
  store.on(['measures', 'labelSurfaces'], () => {
    const { measures, labelSurfaces } = store.state;
    if (measures || labelSurfaces.length > 0) void inspectInput(store);
  });
}
