// The state of the page, and who is told when it changes.
import type { Crop, LabelSurface, LabelTable, Measures, Mesh, Preset, Scan, ScanFile, ScanReport } from 'marrow-wasm';
import { presets } from 'marrow-wasm';
import type { Geometry, Vec3 } from './scan/geometry';

export type Tool = 'navigate' | 'distance' | 'crop';
export type ViewName = 'surface' | 'axial' | 'coronal' | 'sagittal';

/** A distance between two positions in the patient, LPS mm. */
export interface Distance { from: Vec3; to: Vec3 }

/** The files of a scan, and what their headers tell, as soon as that is known. */
export interface Input { files: ScanFile[]; report: ScanReport | undefined }

/** The surface on the screen. */
export interface Surface {
  mesh: Mesh;
  isovalue: number;
  level: number; // 0: full resolution; n: from every 2^n-th sample
  refined: boolean; // more was done to it than extraction
  preview?: Mesh; // what is drawn instead while the camera moves, if that is slow
}

/** The measures of a surface, and its mesh: the surface that is shown may be another one by now. */
export interface Measured extends Measures { mesh: Mesh }

export type LightState = 'good' | 'bad' | 'busy';

export interface State {
  input?: Input;
  scan?: Scan;
  geometry?: Geometry;
  /** Whether each label has a surface of its own, instead of one surface at the isovalue. */
  asLabels: boolean;

  isovalue: number;
  colour: string; // of the surface, #rrggbb
  opacity: number;
  closed: boolean;
  topology: boolean; // whether it is exact
  largest: boolean;
  smooth: number; // iterations
  keep: number; // % of the triangles
  relax: number; // smoothing passes of label maps
  hidden: ReadonlySet<number>; // labels
  table?: LabelTable; // names and colours of labels, if the user gave them
  crop?: Crop;

  window: { lower: number; upper: number };
  crosshair: Vec3; // index
  tool: Tool;
  picked?: Vec3; // the first end of a distance
  distances: readonly Distance[];
  layout: 'all' | ViewName;

  /** Whether what is shown matches the controls in full resolution: only then it is exported. */
  exact: boolean;
  surface?: Surface;
  labelSurfaces: readonly LabelSurface[];
  measures?: Measured;
  extractMs?: number;
  light: { state: LightState; text: string };
  note: string; // of the last step, what the user should know
}

export const initialState: State = {
  asLabels: false, isovalue: 0, colour: '#f2e8d4', opacity: 1, closed: true, topology: false, largest: false, smooth: 0, keep: 100, relax: 40,
  hidden: new Set(), window: { lower: 0, upper: 1 }, crosshair: [0, 0, 0], tool: 'navigate', distances: [], layout: 'all',
  exact: false, labelSurfaces: [], light: { state: 'busy', text: '' }, note: '',
};

type Listener = () => void;

/** Holds the state. Listeners name the members they depend on, and are called once for each change of some of them. */
export class Store {
  private current: State = initialState;
  private readonly listeners: { keys: ReadonlySet<keyof State>; listener: Listener }[] = [];

  get state(): Readonly<State> { return this.current; }

  on(keys: readonly (keyof State)[], listener: Listener): void {
    this.listeners.push({ keys: new Set(keys), listener });
  }

  set(patch: Partial<State>): void {
    const changed = (Object.keys(patch) as (keyof State)[]).filter((key) => !Object.is(this.current[key], patch[key]));
    if (changed.length === 0) return;
    this.current = { ...this.current, ...patch };
    for (const { keys, listener } of [...this.listeners]) if (changed.some((key) => keys.has(key))) listener();
  }
}

/** The preset whose isovalue is the current one, if presets suit the scan. */
export function currentPreset(state: Readonly<State>): Preset | undefined {
  return state.scan?.unit === 'HU' ? presets.find((preset) => preset.isovalue === state.isovalue) : undefined;
}

export const toHex = (colour: readonly number[]): string =>
  '#' + colour.map((c) => Math.round(c * 255).toString(16).padStart(2, '0')).join('');

/** Whether samples are whole numbers. */
export const isInteger = (scan: Scan): boolean => !scan.sampleType.startsWith('float');

/** The smallest number of the form 1, 2 or 5 times a power of ten that is not below `minimum` > 0. */
export function roundStep(minimum: number): number {
  const power = 10 ** Math.floor(Math.log10(minimum));
  return power * ([1, 2, 5].find((factor) => factor * power >= minimum) ?? 10);
}

/** The nearest isovalue that the controls offer: in scans of whole numbers it lies between two of them. */
export function onGrid(scan: Scan, value: number, steps = 0): number {
  const { lower, upper } = scan.histogram, integers = isInteger(scan);
  const step = isovalueStep(scan), offset = integers && upper > lower ? 0.5 : 0;
  const digits = Math.max(0, -Math.floor(Math.log10(step))) + 1;
  const moved = (Math.round(value / step - offset) + steps + offset) * step;
  return Number(Math.min(Math.max(moved, lower + offset), upper - offset).toFixed(digits));
}

export function isovalueStep(scan: Scan): number {
  const range = scan.histogram.upper - scan.histogram.lower;
  return isInteger(scan) || !(range > 0) ? 1 : roundStep(range / 2000);
}
