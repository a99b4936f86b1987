// Opens a scan: looks at the headers, asks for what they leave open, and reads the samples.
import type { ReadOptions, Scan, ScanFile, ScanReport } from 'marrow-wasm';
import { MarrowError, inspectScan, presets, readScan } from 'marrow-wasm';
import { ProgressBanner, clearBanners, messageOf, showBanner } from '../banners';
import { closeDialog } from '../dialogs/dialog';
import { chooseSeries, mendsOf } from '../dialogs/series';
import type { State, Store } from '../state';
import { initialState, toHex } from '../state';
import { mark } from '../timing';
import { pathOf } from './collect_files';
import type { Geometry, Mat3, Vec3 } from './geometry';
import { isTable, openTable } from './label_table';

const COLOUR = '#8cbfe0'; // of surfaces that are not a tissue of a preset
let opening: AbortController | undefined; // of the newest attempt while it lasts

export type Choice = Pick<ReadOptions, 'series' | 'volume' | 'spacing' | 'resample'>;

/** Whether a scan is on its way, from the files to the samples. */
export const isOpening = (): boolean => opening !== undefined;

/** Opens what the user chose. If it cannot be read, a message says why, and the scan before stays open. */
export function openScan(store: Store, files: ScanFile[] | Promise<ScanFile[]>): Promise<void> {
  return attempt(async (own) => {
    await open(store, await withProgress(own, 'Looking for files…', () => files), own);
  });
}

/** Computes the demo scan and opens it. */
export function openDemo(store: Store): Promise<void> {
  return attempt(async (own) => {
    const { demoScan } = await import('../demo/demo');
    const files = await withProgress(own, 'Computing the demo scan…', (set) => demoScan(set, own.signal));
    await open(store, files, own);
  });
}

async function open(store: Store, files: ScanFile[], own: AbortController): Promise<void> {
  own.signal.throwIfAborted();
  if (files.length === 0) throw new Error('There is no file: choose a folder or file that holds a scan.');
  const tables = files.filter(isTable), images = files.filter((file) => !isTable(file));
  if (images.length === 0 && store.state.asLabels) return openTable(store, tables[0]!);
  mark('open');
  // One table beside a map belongs to it, while the texts beside many slices are about something else.
  const belongs = images.length > 0 && images.length <= 2 && tables.length === 1;
  const [input, table] = belongs ? [images, tables[0]] : [files, undefined];
  try {
    await read(store, input, {}, own);
  } catch (error) {
    // The scan is ambiguous, or its geometry is incomplete or uneven: ask.
    if (!(error instanceof MarrowError && error.code === 4)) throw error;
    await choose(store, input, undefined, error.message, own);
  }
  if (!table || store.state.input?.files !== input || !store.state.asLabels) return;
  const parts = pathOf(table).split('/');
  await openTable(store, table).catch((error) => {
    own.signal.throwIfAborted();
    // In a folder, the user did not choose it, and it may be about something else. Only errors of the table name its file.
    if (parts.length === 1 || !(error instanceof MarrowError && error.message.includes(parts.at(-1)!))) throw error;
    showBanner('note', `The text beside the map is ignored: ${messageOf(error)}`);
  });
}

/** Lets the user choose another series of the files that are open. */
export async function openOtherSeries(store: Store): Promise<void> {
  const { input } = store.state;
  if (!input?.report) return;
  const { files, report } = input;
  await attempt((own) => choose(store, files, report, report.reason, own));
}

// Only the newest attempt goes on: it takes the place of an earlier one, with its dialog and messages.
async function attempt(work: (own: AbortController) => Promise<void>): Promise<void> {
  opening?.abort();
  const own = (opening = new AbortController());
  closeDialog();
  clearBanners();
  try {
    await work(own);
  } catch (error) {
    if (!own.signal.aborted) showBanner('error', messageOf(error));
  }
  if (opening === own) opening = undefined;
}

// Shows the progress of a part of an attempt, which the user may cancel.
async function withProgress<T>(
  own: AbortController, text: string, work: (set: (fraction: number) => void) => T | Promise<T>): Promise<T> {
  const progress = new ProgressBanner(text, () => {
    own.abort();
    progress.remove();
  });
  try {
    return await work((fraction) => progress.set(fraction));
  } finally {
    progress.remove();
  }
}

// Asks which series to read, and reads it.
async function choose(store: Store, files: ScanFile[], known: ScanReport | undefined, reason: string,
                      own: AbortController): Promise<void> {
  const { signal } = own;
  const [report, mends] = await withProgress(own, 'Looking at the series…', async () => {
    const found = known ?? (await inspectScan(files, { signal }));
    return [found, await mendsOf(files, found, signal)] as const;
  });
  signal.throwIfAborted();
  const choice = await chooseSeries(report, mends, reason);
  if (choice) await read(store, files, choice, own);
}

async function read(store: Store, files: ScanFile[], choice: Choice, own: AbortController): Promise<void> {
  const { signal } = own;
  const scan = await withProgress(own, 'Reading the scan…', (onProgress) =>
    readScan(files, { ...choice, signal, onProgress }));
  if (signal.aborted) return scan.dispose();
  const { scan: before, input } = store.state, report = input?.files === files ? input.report : undefined;
  store.set({ ...startOf(scan), input: { files, report } });
  before?.dispose();
  document.body.classList.add('open');
  const warnings = [...scan.warnings];
  if (scan.unit === 'HU' && scan.unitAssumed) warnings.push('The file does not say that its values are Hounsfield units; the presets assume it.');
  if (warnings.length > 0) showBanner('warning', warnings.join('\n'));
}

const inspected = new WeakSet<ScanFile[]>(); // the inputs whose inspection began

/** Looks whether the files hold other series, or other volumes of the series. */
export async function inspectInput(store: Store): Promise<void> {
  const { input } = store.state;
  if (!input || input.report || inspected.has(input.files)) return;
  inspected.add(input.files);
  // Headers that could be read to open the scan can be read again.
  const report = await inspectScan(input.files).catch(() => undefined);
  if (report && store.state.input?.files === input.files) store.set({ input: { ...input, report } });
}

/** The state of a scan that was just opened: bone, or the isovalue of Otsu's method, or all labels. */
function startOf(scan: Scan): Partial<State> {
  const d = scan.direction as number[];
  const direction: Mat3 = [[d[0]!, d[1]!, d[2]!], [d[3]!, d[4]!, d[5]!], [d[6]!, d[7]!, d[8]!]];
  const geometry: Geometry = { dims: scan.dims, spacing: scan.spacing, origin: scan.origin, direction };
  const bone = presets.find((preset) => preset.name === 'bone')!, hounsfield = scan.unit === 'HU';
  const { lower, upper } = scan.histogram;
  const { closed, topology, largest, smooth, keep, relax, opacity, tool, layout } = initialState;
  return {
    scan, geometry, closed, topology, largest, smooth, keep, relax, opacity, tool, layout,
    asLabels: scan.unit === 'labels',
    isovalue: hounsfield ? bone.isovalue : scan.otsu ?? (lower + upper) / 2,
    colour: hounsfield ? toHex(bone.colour) : COLOUR,
    hidden: new Set(), table: undefined, crop: undefined, picked: undefined, distances: [], labelSurfaces: [],
    window: hounsfield ? { lower: -450, upper: 1050 } : { ...scan.window },
    crosshair: scan.dims.map((n) => Math.floor((n - 1) / 2)) as Vec3,
  };
}
