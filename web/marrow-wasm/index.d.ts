/**
 * Marrow in JavaScript: reads CT and MRI scans, extracts their surfaces, and prepares, measures, checks and writes
 * them. Everything runs on this computer, in workers; nothing is sent anywhere. For research use only.
 *
 * Results are those of the command line, byte for byte. Coordinates are millimetres in LPS (x to the patient's left,
 * y to posterior, z to superior).
 *
 * @packageDocumentation
 */

/** Three numbers, along x, y and z or along the index axes i, j and k. */
export type Vec3 = [number, number, number];

/** Red, green and blue from 0 to 1, sRGB. */
export type Colour = [number, number, number];

/** The types of samples. */
export type SampleType = 'uint8' | 'int8' | 'uint16' | 'int16' | 'int32' | 'float32' | 'float64';

export type Samples =
  Uint8Array | Int8Array | Uint16Array | Int16Array | Int32Array | Float32Array | Float64Array;

// ---------------------------------------------------------------------------------------------------------- errors

/**
 * Every promise of this package rejects with it. `message` is one line that says what is wrong, where, and what to do.
 */
export class MarrowError extends Error {
  /**
   * The exit code of the command line: 2 an argument does not fit; 3 a file cannot be read (missing, damaged, not
   * supported, too large) or written; 4 the scan is ambiguous, or its geometry would distort the result; 5 there is no
   * surface; 130 cancelled.
   */
  readonly code: 2 | 3 | 4 | 5 | 130;
}

/** What long work takes. */
export interface WorkOptions {
  /** Called with the fraction of the work that is done, from 0 to 1. */
  onProgress?: (fraction: number) => void;
  /** Cancels the work, which then rejects with code 130. */
  signal?: AbortSignal;
}

// --------------------------------------------------------------------------------------------------------- loading

/** How the WebAssembly is loaded. */
export interface Setup {
  /**
   * Threads to use, at least 1. More than 1 needs SharedArrayBuffer, which browsers give only to pages that are
   * `crossOriginIsolated`. The default is all of the computer's, at most 8, where the page is isolated, and 1 elsewhere.
   */
  threads?: number;
  /** Where the package's files are, if not beside index.mjs: a URL that ends in a slash. */
  baseUrl?: string | URL;
}

/**
 * Sets how the WebAssembly is loaded, and loads it ahead of the first use. It need not be called.
 * Later calls affect only workers that start afterwards.
 */
export function prepare(setup?: Setup): Promise<void>;

/** The version of Marrow, such as "0.3.0". */
export const version: string;

/** The number of threads that prepare() chose: 1 without SharedArrayBuffer. */
export function threads(): number;

// ----------------------------------------------------------------------------------------------------------- scans

/**
 * A file of a scan. A File of an `<input webkitdirectory>` brings its path along; for others, as from a dropped folder,
 * give it. Paths have slashes and are relative, and no two are equal. Browsers read Blobs piece by piece, not as a whole.
 */
export type ScanFile = File | { path: string; data: Blob | Uint8Array };

/**
 * A scan: one file, a folder's files, or .zip archives of these. In node it may also be the path of a file or
 * folder.
 */
export type ScanFiles = string | ScanFile | Iterable<ScanFile>;

export interface ReadOptions extends WorkOptions {
  /** The series to read if there are several: SeriesReport.id or the first part of it, or its number, from 1. */
  series?: string | number;
  /** mm along i, j and k, only for input that does not state it: slice images, a single DICOM slice. */
  spacing?: Vec3;
  /** Interpolate unevenly spaced DICOM slices linearly to even spacing. */
  resample?: boolean;
  /** The index, from 0, of a volume of a 4-D scan: SeriesReport.volumes. */
  volume?: number;
}

/** What the headers tell about one series, as `marrow info` shows it. Absent members are not known. */
export interface SeriesReport {
  /** Identifies the series as ReadOptions.series; empty for formats without series, which hold only one. */
  id: string;
  /** The number of the series from 1, which ReadOptions.series takes too. */
  index: number;
  description: string;
  /** "CT", "MR", ...; empty if the format does not state it. */
  modality: string;
  dims: Vec3;
  /** mm; 0 along an axis whose spacing is unknown. */
  spacing: Vec3;
  files: number;
  /** Why readScan would refuse the series. Absent: it can be read. */
  refusal?: string;
  warnings: string[];
  /** Unusual gaps between slices. */
  gaps: string[];
  /** Tilt of the gantry, degrees. */
  tilt: number;
  /** SeriesNumber of DICOM. */
  number?: number;
  /** "2005-07-26" */
  date: string;
  echoTime?: number;
  imageType: string;
  kernel: string;
  /** Such as "axial". Absent: not stated. */
  plane?: string;
  /** Whether samples are Hounsfield units. */
  hounsfield?: boolean;
  /** What each volume is, if ReadOptions.volume could choose one: "echo time 12 ms". */
  volumes: string[];
  volumeCount: number;
  /** Bytes that the samples need. */
  memory: number;
  /** One line with the above, as `marrow info` prints it. */
  summary: string;
  /** What the headers do not state: "spacing", "orientation in the patient", "modality", "unit of the values". */
  unknown: string[];
}

export interface ScanReport {
  /** "DICOM", "NIfTI", "NRRD", "MetaImage", "TIFF" or "slices". */
  format: string;
  files: number;
  series: SeriesReport[];
  /** The index in `series`, from 0, of the one that readScan would read without ReadOptions.series. Absent: none. */
  chosen?: number;
  /** Why it would read that series, or none. */
  reason: string;
  /** About files that are skipped. */
  warnings: string[];
}

/** Lists the series of an input from its headers, and says which can be read. */
export function inspectScan(files: ScanFiles, options?: ReadOptions): Promise<ScanReport>;

/**
 * Reads a scan: DICOM, NIfTI, NRRD, MetaImage, TIFF, or slices as PNG, TIFF, JPEG or BMP images. It rejects, with the
 * reason, what would give a wrong surface.
 *
 * Each scan lives in a worker of its own: dispose() ends the worker and frees the memory.
 */
export function readScan(files: ScanFiles, options?: ReadOptions): Promise<Scan>;

/** A scan of samples of your own: x fastest, `dims` samples. The array is copied. */
export function scanOf(samples: Samples, geometry: {
  dims: Vec3;
  spacing?: Vec3;
  origin?: Vec3;
  /** Nine numbers, row by row; column a is the unit vector of index axis a. */
  direction?: number[];
}): Promise<Scan>;

/** Counts of the finite samples in 256 equal bins from `lower` to `upper`, without padding. */
export interface Histogram {
  lower: number;
  upper: number;
  /** Empty if no sample is finite. */
  counts: Float64Array;
  /** NaN and infinite samples. */
  nonFinite: number;
}

/** A label of a label map. */
export interface Label {
  label: number;
  /** From the file's table, or "label-7". */
  name: string;
  colour: Colour;
  /** Number of samples. */
  samples: number;
}

export interface Scan {
  /**
   * What the user dropped, for titles and commandLine(): the name of the file or top folder. Files that lie in no common
   * folder are the 'folder with these files', as the command line reads several files only from a folder.
   */
  readonly name: string;
  readonly format: string;
  readonly description: string;
  readonly seriesId: string;
  /** What ReadOptions were given, for commandLine(). */
  readonly options: Pick<ReadOptions, 'series' | 'spacing' | 'resample' | 'volume'>;
  /** "CT", "MR", ...; empty if not stated. */
  readonly modality: string;
  /**
   * The type of the samples of slices. Where stored samples of 8 or 16 bits stand for values with a fraction, this is
   * float32, although the scan keeps them as stored.
   */
  readonly sampleType: SampleType;
  readonly dims: Vec3;
  /** mm */
  readonly spacing: Vec3;
  /** The position of sample (0, 0, 0). */
  readonly origin: Vec3;
  /** Nine numbers, row by row; column a is the unit vector of index axis a. */
  readonly direction: number[];
  /** From index to position: 16 numbers, column by column, as for three.js' Matrix4.fromArray(). */
  readonly indexToPhysical: number[];
  /** "HU" if samples are Hounsfield units, "labels" if it looks like a label map, else "". */
  readonly unit: 'HU' | 'labels' | '';
  /** Whether the unit is assumed, because the format does not state it. */
  readonly unitAssumed: boolean;
  /** One line each. */
  readonly warnings: string[];
  readonly histogram: Histogram;
  /** The isovalue that separates dark from bright best (Otsu). Absent: all samples are equal. */
  readonly otsu?: number;
  /** A grey window that shows most of the samples: the lowest 1 % black, the highest 1 % white. */
  readonly window: { lower: number; upper: number };
  /** The labels except for the background, if `unit` is "labels"; else empty. */
  readonly labels: Label[];
  /** Bytes of the samples in memory. */
  readonly bytes: number;

  /**
   * One slice across an index axis: 0 across i (columns j, rows k), 1 across j (columns i, rows k), 2 across k
   * (columns i, rows j). It is answered before waiting extractions.
   */
  slice(axis: 0 | 1 | 2, index: number): Promise<Slice>;

  /** Ends the worker of the scan and frees its memory. Unanswered calls reject with code 130. */
  dispose(): void;
}

export interface Slice {
  axis: 0 | 1 | 2;
  index: number;
  /** Samples in a row, and rows. */
  width: number;
  height: number;
  /** mm between columns and between rows. */
  spacing: [number, number];
  /** Whether the samples are values, rounded to float32, of samples that the scan keeps as stored. */
  rescaled: boolean;
  /** width * height samples, row by row. */
  samples: Samples;
}

/**
 * The outline of the isosurface in a slice: x0, y0, x1, y1 for each piece, in columns and rows, where (0, 0) is the
 * centre of the first sample. It is where Marrow's surface cuts the slice; with `topology`, the surface of an Extractor
 * with that option. It runs where it is called and takes a few milliseconds.
 */
export function contour(slice: Slice, isovalue: number, options?: Pick<ExtractorOptions, 'topology'>): Float32Array;

/** A tissue in CT: the surface encloses the samples of at least `lowest` HU. */
export interface Preset {
  name: 'bone' | 'skin' | 'soft' | 'fat' | 'muscle';
  lowest: number;
  isovalue: number;
  colour: Colour;
}

/** The presets of the command line's --type. They suit scans whose `unit` is "HU". */
export const presets: readonly Preset[];

// -------------------------------------------------------------------------------------------------------- surfaces

/** A triangle mesh. The arrays are yours. */
export interface Mesh {
  /** x, y, z for each point, mm in LPS. */
  points: Float32Array;
  /** A unit normal for each point, or empty. */
  normals: Float32Array;
  /** Three indices for each triangle, counter-clockwise as seen from outside. */
  triangles: Uint32Array;
  /** For the formats that have names: the isovalue, the preset's or the label's name. */
  name?: string;
  /** For the formats that have colours. */
  colour?: Colour;
}

/** The part of a scan to keep: the first and the last sample along each axis, both included and within the scan. */
export interface Crop {
  first: Vec3;
  last: Vec3;
}

export interface ExtractorOptions {
  /** Close the surface at the border of the scan, as the command line does without --open. Default: true. */
  closed?: boolean;
  /** Merge points closer to a sample than this fraction of an edge, 0 <= snap < 0.5; 0.3 is a good value. Default: 0. */
  snap?: number;
  /** Give the surface exactly the topology of the trilinear interpolant; not with snap. Default: false. */
  topology?: boolean;
  /** Compute normals. Default: true. */
  normals?: boolean;
  /** Default: the whole scan. */
  crop?: Crop;
}

export interface ExtractOptions {
  /** 0: the full resolution; n: a preview from every 2^n-th sample along each axis. Default: 0. */
  level?: number;
  /**
   * Cancels the extraction, which then rejects with code 130. In node, and where the page is `crossOriginIsolated`, the worker
   * stops at once; elsewhere it ends the extraction first.
   */
  signal?: AbortSignal;
}

export interface ExtractStats {
  isovalue: number;
  level: number;
  /** ms in the worker: the extraction, and copying the mesh out. */
  extractMs: number;
  copyMs: number;
}

export interface Isosurface extends Mesh {
  name: string;
  stats: ExtractStats;
}

/**
 * Extracts surfaces of a scan, as for a slider. The newest request wins: of the requests that wait while another one
 * runs, only the last is done for each level, previews first; the others reject with code 130. So `extract(v, {level: 2})`
 * and `extract(v)` can both be called on every movement of a slider.
 *
 * A surface without triangles is not an error here; writeMesh() refuses it.
 */
export class Extractor {
  static create(scan: Scan, options?: ExtractorOptions): Promise<Extractor>;
  /** The surface at `isovalue`. Its name is String(isovalue). */
  extract(isovalue: number, options?: ExtractOptions): Promise<Isosurface>;
  /** Gives the arrays of a mesh back, to be used for the next surface, which saves time. The mesh becomes empty. */
  recycle(mesh: Mesh): void;
  readonly scan: Scan;
  readonly options: Required<Omit<ExtractorOptions, 'crop'>> & Pick<ExtractorOptions, 'crop'>;
  /** The number of samples of a level along each axis, to choose a preview level by. */
  dims(level: number): Vec3;
  dispose(): void;
}

/** Names and colours for the labels of a map. */
export interface LabelTable {
  /** The name of the file, for commandLine(). */
  readonly name: string;
  /**
   * All labels of the map. A name or a colour that the table lacks is that of the file's own segment, or else
   * "label-7" and a colour that depends on the label.
   */
  readonly labels: Label[];
}

/**
 * Reads a table of the labels of a map, in the forms that the command line's --labels takes: text of 3D Slicer, FreeSurfer
 * or ITK-SNAP, or one `LABEL NAME` a line. Rejects with code 2 if it has none of the map's labels.
 */
export function readLabelTable(scan: Scan, file: ScanFile): Promise<LabelTable>;

export interface LabelOptions extends WorkOptions {
  /** Smoothing passes; 0: none. Default: 40. */
  relax?: number;
  /** The labels to return; all are extracted, so that a surface does not depend on the choice. Default: all. */
  only?: number[];
  crop?: Crop;
  /** Names and colours that come before those of the file. */
  table?: LabelTable;
}

export interface LabelSurface extends Mesh {
  label: number;
  name: string;
  colour: Colour;
  /** Samples of the label, their volume in mm3, and the volume of the surface in mm3. */
  samples: number;
  samplesVolume: number;
  volume: number;
  /** Points that relaxation held back, so that no surface is folded or passes through itself or another. */
  heldBack: number;
}

/**
 * One closed surface for each label of a label map, in ascending order of labels. A signal stops the work at once where
 * it stops an extraction at once (ExtractOptions.signal), and the scan stays open.
 */
export function labels(scan: Scan, options?: LabelOptions): Promise<LabelSurface[]>;

// --------------------------------------------------------------------------------------------- what is done to meshes
//
// In the order of the command line: keepComponents, smooth, simplify. Meshes that are passed in stay as they are. The
// work runs in a worker of its own, beside extractions; cancelling it frees the worker at once.

export interface ComponentOptions extends WorkOptions {
  /** Keep only the largest component, without its cavities. */
  largest?: boolean;
  /** Keep this many components: those with the most triangles. */
  count?: number;
  /** mm3; drop components and cavities that enclose less. */
  minVolume?: number;
  /** Keep cavities. Default: true. */
  cavities?: boolean;
}

/** What is known about a result beside the mesh, as in the command line's report. */
export interface StepResult {
  mesh: Mesh;
  /** What the user should know; empty: nothing. */
  note: string;
}

export function keepComponents(mesh: Mesh, options: ComponentOptions): Promise<StepResult>;

export interface SmoothOptions extends WorkOptions {
  /** Default: 20. */
  iterations?: number;
  /** mm: no point moves further. Or a scan: no further than half a sample along each axis. Default: no bound. */
  bound?: number | Scan;
}

/** Removes noise and steps. Only parts that are a few samples thick shrink. */
export function smooth(mesh: Mesh, options?: SmoothOptions):
  Promise<StepResult & { movedMean: number; movedMax: number; heldBack: number }>;

/** When to stop: `keep` or `triangles`, `maxError`, or `maxError` with one of them: at the first that is reached. */
export interface SimplifyOptions extends WorkOptions {
  /** The fraction of the triangles to keep, above 0 and at most 1. */
  keep?: number;
  /** The number of triangles to keep. */
  triangles?: number;
  /** mm: the largest distance from the original, as measured. */
  maxError?: number;
  /** Compare the distance with the scan's spacing in `note`. */
  scan?: Scan;
}

/** Reduces the number of triangles. The topology does not change, and the surface never passes through itself. */
export function simplify(mesh: Mesh, options: SimplifyOptions):
  Promise<StepResult & { deviationMean: number; deviationMax: number }>;

/** Lengths in mm. */
export interface Measures {
  points: number;
  triangles: number;
  components: number;
  cavities: number;
  boundaryEdges: number;
  nonmanifoldEdges: number;
  /** mm2 */
  area: number;
  /** mm3; it has a meaning only where boundaryEdges is 0. */
  volume: number;
  lower: Vec3;
  upper: Vec3;
}

export function measure(mesh: Mesh, options?: WorkOptions): Promise<Measures>;

export interface CheckOptions extends WorkOptions {
  /** mm: find walls that are thinner. */
  minWall?: number;
}

export interface Check {
  /** Whether a slicer has nothing to repair: all of the following. */
  sound: boolean;
  closed: boolean;
  manifold: boolean;
  oriented: boolean;
  /** Pairs of triangles. */
  selfIntersections: number;
  degenerateTriangles: number;
  misorientedEdges: number;
  nonmanifoldPoints: number;
  unusedPoints: number;
  cavities: number;
  /** Handles, if the mesh is closed, manifold and oriented. */
  genus?: number;
  thinTriangles: number;
  /** mm2 */
  thinArea: number;
  /** mm */
  thinnestWall?: number;
  measures: Measures;
}

/** Whether a mesh is fit to be printed and measured. */
export function check(mesh: Mesh, options?: CheckOptions): Promise<Check>;

// ----------------------------------------------------------------------------------------------------------- files

export type Space = 'LPS' | 'RAS';

export interface WriteOptions extends WorkOptions {
  /** Default: 'LPS'. glb allows no other. */
  space?: Space;
}

/**
 * The bytes of a mesh file, the same as the command line writes for commandLine(). The extension of `name` chooses the
 * format: .stl, .ply, .obj, .vtp, .3mf, .glb; .gz may follow the first three. .3mf, .glb, .obj and .vtp hold several
 * meshes. Rejects with code 5 if a mesh has no triangles.
 */
export function writeMesh(mesh: Mesh | readonly Mesh[], name: string, options?: WriteOptions): Promise<Blob>;

/** What was done, in the words of this package. */
export interface Recipe {
  scan: Scan;
  /** Isovalues or presets: one surface each, in the order of the meshes given to writeMesh(). */
  surfaces?: (number | Preset['name'])[];
  extractor?: ExtractorOptions;
  /** Instead of `surfaces`. */
  labels?: Omit<LabelOptions, keyof WorkOptions>;
  components?: Omit<ComponentOptions, keyof WorkOptions>;
  smooth?: Omit<SmoothOptions, keyof WorkOptions>;
  simplify?: Omit<SimplifyOptions, keyof WorkOptions | 'scan'>;
  /** The name given to writeMesh(). */
  output: string;
  space?: Space;
}

/**
 * The command line that writes the same bytes, such as `marrow skull --isovalue 226.5 --largest -o skull.stl`, quoted for
 * a POSIX shell. Throws a MarrowError with code 2 if `output` has braces, because there they make a pattern.
 */
export function commandLine(recipe: Recipe): string;
