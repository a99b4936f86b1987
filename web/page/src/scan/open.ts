// Opens a scan: looks at the headers, asks for what they leave open, and reads the samples.
import type { ReadOptions, Scan, ScanFile, ScanReport } from 'marrow-wasm';
import { MarrowError, inspectScan, presets, readScan } from 'marrow-wasm';
import { ProgressBanner, clearBanners, messageOf, showBanner } from '../banners';
import { chooseSeries } from '../dialogs/series';
import type { State, Store } from '../state';
import { initialState, toHex } from '../state';
import { mark } from '../timing';
import type { Geometry, Mat3, Vec3 } from './geometry';

const COLOUR = '#8cbfe0'; // of surfaces that are not a tissue of a preset
let opening = new AbortController(); // the newest attempt; an earlier one is cancelled

export type Choice = Pick<ReadOptions, 'series' | 'volume' | 'spacing' | 'resample'>;

/** Opens what the user chose. If it cannot be read, a message says why, and the scan before stays open. */
export async function openScan(store: Store, files: ScanFile[]): Promise<void> {
  if (files.length === 0) return showBanner('error', 'There is no file: choose a folder or file that holds a scan.');
  mark('open');
  await attempt(async (signal) => {
    const progress = new ProgressBanner('Reading the headers…', () => opening.abort());
    let report: ScanReport;
    try {
      report = await inspectScan(files, { signal, onProgress: (f) => progress.set(f) });
    } finally {
      progress.remove();
    }
    const choice = plainChoice(report) ?? (await chooseSeries(files, report));
    if (choice) await read(store, files, report, choice, signal);
  });
}

/** Lets the user choose another series of the files that are open. */
export async function openOtherSeries(store: Store): Promise<void> {
  const { input } = store.state;
  if (!input) return;
  await attempt(async (signal) => {
    const choice = await chooseSeries(input.files, input.report);
    if (choice) await read(store, input.files, input.report, choice, signal);
  });
}

async function attempt(work: (signal: AbortSignal) => Promise<void>): Promise<void> {
  opening.abort();
  const { signal } = (opening = new AbortController());
  clearBanners();
  try {
    await work(signal);
  } catch (error) {
    if (!(error instanceof MarrowError && error.code === 130)) showBanner('error', messageOf(error));
  }
}

// What to read where there is nothing to ask: no options, if a series without open questions would be read.
function plainChoice(report: ScanReport): Choice | undefined {
  const series = report.chosen === undefined ? undefined : report.series[report.chosen];
  return series && !series.refusal && series.volumeCount <= 1 && !series.unknown.includes('spacing') ? {} : undefined;
}

async function read(store: Store, files: ScanFile[], report: ScanReport, choice: Choice, signal: AbortSignal): Promise<void> {
  const progress = new ProgressBanner('Reading the scan…', () => opening.abort());
  let scan: Scan;
  try {
    scan = await readScan(files, { ...choice, signal, onProgress: (f) => progress.set(f) });
  } finally {
    progress.remove();
  }
  if (signal.aborted) return scan.dispose();
  const before = store.state.scan;
  store.set({ ...startOf(scan), input: { files, report } });
  before?.dispose();
  document.body.classList.add('open');
  const warnings = [...new Set([...report.warnings, ...scan.warnings])];
  if (scan.unit === 'HU' && scan.unitAssumed) warnings.push('The file does not say that its values are Hounsfield units; the presets assume it.');
  if (warnings.length > 0) showBanner('note', warnings.join('\n'));
}

/** The state of a scan that was just opened: bone, or the isovalue of Otsu's method, or all labels. */
function startOf(scan: Scan): Partial<State> {
  const d = scan.direction as number[];
  const direction: Mat3 = [[d[0]!, d[1]!, d[2]!], [d[3]!, d[4]!, d[5]!], [d[6]!, d[7]!, d[8]!]];
  const geometry: Geometry = { dims: scan.dims, spacing: scan.spacing, origin: scan.origin, direction };
  const bone = presets.find((preset) => preset.name === 'bone')!, hounsfield = scan.unit === 'HU';
  const { lower, upper } = scan.histogram;
  const { closed, largest, smooth, keep, relax, opacity, tool, layout } = initialState;
  return {
    scan, geometry, closed, largest, smooth, keep, relax, opacity, tool, layout,
    asLabels: scan.unit === 'labels',
    isovalue: hounsfield ? bone.isovalue : scan.otsu ?? (lower + upper) / 2,
    colour: hounsfield ? toHex(bone.colour) : COLOUR,
    hidden: new Set(), crop: undefined, picked: undefined, distances: [], labelSurfaces: [],
    window: hounsfield ? { lower: -450, upper: 1050 } : { ...scan.window },
    crosshair: scan.dims.map((n) => Math.floor((n - 1) / 2)) as Vec3,
  };
}
