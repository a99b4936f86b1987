// Asks which series of an input to read, and for what its headers leave open.
import type { ScanFile, ScanReport, SeriesReport } from 'marrow-wasm';
import { inspectScan } from 'marrow-wasm';
import { withoutOptions } from '../banners';
import { elementOf, sizeText } from '../dom';
import type { Vec3 } from '../scan/geometry';
import type { Choice } from '../scan/open';
import { cancelButton, makeDialog, show } from './dialog';

/** The user's choice, or undefined. `reason` says why there is a choice. Series that cannot be read are listed with the reason. */
export async function chooseSeries(
  report: ScanReport, mends: readonly Mend[], reason: string): Promise<Choice | undefined> {
  const several = report.series.length > 1;
  const dialog = makeDialog(several ? 'Choose a series' : 'About this scan');
  dialog.body.append(elementOf('p', { class: 'faint' }, withoutOptions(reason)));

  const rows = report.series.map((series, i) => row(series, mends.find((mend) => mend.series[i] && !mend.series[i].refusal)?.choice));
  const first = rows.find((r) => r.input && r.series.index - 1 === report.chosen) ?? rows.find((r) => r.input);
  if (first?.input) first.input.checked = true;
  dialog.body.append(...rows.map((r) => r.element));

  const open = elementOf('button', { class: 'primary', type: 'submit', value: 'open' }, 'Open');
  open.disabled = !first;
  dialog.foot.append(cancelButton(), open);
  if ((await show(dialog)) !== 'open') return undefined;
  const chosen = rows.find((r) => r.input?.checked);
  return chosen && { ...(several && { series: chosen.series.id || chosen.series.index }), ...chosen.options() };
}

/** What is known of the series if the user chooses something for them. */
export interface Mend { choice: Choice; series: readonly SeriesReport[] }

/** Some of the series that are refused can be read with slices interpolated, or if a volume is chosen. */
export async function mendsOf(files: ScanFile[], report: ScanReport, signal: AbortSignal): Promise<Mend[]> {
  const mends: Mend[] = [{ choice: {}, series: report.series }];
  if (!report.series.some((s) => s.refusal)) return mends;
  const volumes: Choice[] = report.series.some((s) => s.volumeCount > 1) ? [{ volume: 0 }] : [];
  for (const choice of [...volumes, ...[{}, ...volumes].map((c) => ({ ...c, resample: true }))]) {
    const mended = await inspectScan(files, { ...choice, signal }).catch(() => undefined);
    if (mended) mends.push({ choice, series: mended.series });
  }
  return mends;
}

interface Row { series: SeriesReport; element: HTMLElement; input?: HTMLInputElement; options(): Choice }

/** `mend` is the choice with which a series can be read. */
function row(series: SeriesReport, mend: Choice | undefined): Row {
  const asksSpacing = series.unknown.includes('spacing');
  const readable = mend !== undefined || asksSpacing;
  const title = elementOf('b', {}, series.description || (series.number === undefined ? `Series ${series.index}` : `Series ${series.number}`));
  const about = [series.modality, series.dims.join(' × '), spacingText(series.spacing), series.plane, series.date,
    `${series.files} ${series.files === 1 ? 'file' : 'files'}`, sizeText(series.memory)].filter(Boolean).join(' · ');
  const details = [elementOf('span', { class: 'about' }, about)];
  if (series.refusal && (!mend || mend.resample)) details.push(elementOf('span', { class: 'reason' }, withoutOptions(series.refusal)));
  for (const text of [...series.warnings, ...series.gaps]) details.push(elementOf('span', { class: 'about' }, text));
  if (!readable) {
    return { series, options: () => ({}), element: elementOf('div', { class: 'series refused' }, elementOf('span', {}, '✕'), title, ...details) };
  }

  const input = elementOf('input', { type: 'radio', name: 'series', value: series.index });
  const element = elementOf('label', { class: 'series' }, input, title, ...details);
  const parts: (() => Choice)[] = [];
  if (mend?.resample) {
    details.push(elementOf('span', { class: 'about' }, 'Open interpolates the slices linearly to even spacing.'));
    element.append(details.at(-1)!);
    parts.push(() => ({ resample: true }));
  }
  if (series.volumeCount > 1) parts.push(volumeField(element, series));
  if (asksSpacing) parts.push(spacingField(element, series));
  return { series, element, input, options: () => Object.assign({}, ...parts.map((part) => part())) as Choice };
}

const spacingText = (spacing: Vec3): string =>
  spacing.some((s) => s === 0) ? '' : `${spacing.map((s) => Number(s.toPrecision(4))).join(' × ')} mm`;

const MOST_LISTED = 10_000; // a damaged header may claim any number

function volumeField(element: HTMLElement, series: SeriesReport): () => Choice {
  const listed = Math.min(series.volumeCount, MOST_LISTED);
  const select = elementOf('select', { 'aria-label': 'Volume' }, ...Array.from({ length: listed }, (_, i) =>
    elementOf('option', { value: i }, series.volumes[i] ?? `Volume ${i + 1}`)));
  element.append(elementOf('span', { class: 'about row' }, 'Volume', select));
  return () => ({ volume: Number(select.value) });
}

function spacingField(element: HTMLElement, series: SeriesReport): () => Choice {
  const inputs = ['x', 'y', 'z'].map((axis, a) => elementOf('input',
    { type: 'number', min: 0.001, max: 1000, step: 'any', value: series.spacing[a] || 1, 'aria-label': `Spacing along ${axis} in mm` }));
  element.append(elementOf('span', { class: 'about row' }, 'Spacing', ...inputs, 'mm'));
  return () => ({ spacing: inputs.map((input) => input.valueAsNumber) as Vec3 });
}
