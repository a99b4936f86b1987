// The package's interface; index.d.ts documents it.
import { commandLine } from './command_line.mjs';
import { contour } from './contour.mjs';
import { Engine, canUseThreads, chosenThreads, configure, prepareEngine } from './engine.mjs';
import { MarrowError } from './errors.mjs';
import { checked } from './options.mjs';

export { MarrowError, commandLine, contour };

export const version = '0.2.0';

export const presets = Object.freeze([
  { name: 'bone', lowest: 226, colour: [0.95, 0.91, 0.83] },
  { name: 'skin', lowest: -300, colour: [0.93, 0.72, 0.6] },
  { name: 'soft', lowest: -100, colour: [0.86, 0.6, 0.52] },
  { name: 'fat', lowest: -150, colour: [0.94, 0.83, 0.58] },
  { name: 'muscle', lowest: 10, colour: [0.72, 0.32, 0.28] },
].map((preset) => Object.freeze({ ...preset, isovalue: preset.lowest - 0.5 })));

export async function prepare(setup = {}) {
  checked({ threads: setup.threads, baseUrl: setup.baseUrl });
  if (setup.threads > 1 && !canUseThreads())
    throw new MarrowError('threads need SharedArrayBuffer, which this page does not have: send the headers ' +
      'Cross-Origin-Opener-Policy: same-origin and Cross-Origin-Embedder-Policy: require-corp', 2);
  configure(setup);
  await prepareEngine();
}

export const threads = () => chosenThreads();

// ------------------------------------------------------------------------------------------------------------- scans

function listOf(files) {
  if (typeof files === 'string') return files;
  const one = (file) => {
    const whole = file?.path !== undefined && file.data !== undefined;
    const { path, data } = whole ? file : { path: file?.webkitRelativePath || file?.name, data: file };
    if (typeof path !== 'string' || !['Blob', 'File', 'Uint8Array'].includes(data?.[Symbol.toStringTag]))
      throw new MarrowError('files must be File objects or { path, data } with a Blob or Uint8Array as data, or in node a path', 2);
    return { path, data };
  };
  return Array.from(typeof files?.[Symbol.iterator] === 'function' ? files : [files], one);
}

function request(files, { series, spacing, resample, volume } = {}) {
  return { files: listOf(files), series: series === undefined ? undefined : String(series), ...checked({ spacing, resample, volume }) };
}

// Does work in a worker that waits for the next task afterwards.
async function inWorker(f) {
  const engine = Engine.take();
  try {
    return await f(engine);
  } finally {
    engine.giveBack();
  }
}

let codecs = false;  // whether a file needed codecs: the next ones probably do, too

// Lets a worker look at files. If they need codecs, a worker that has them does it again.
async function askAboutFiles(operation, parameters, options) {
  const engine = Engine.take({ codecs });
  try {
    return { engine, answer: await engine.call(operation, parameters, options) };
  } catch (error) {
    engine.giveBack();
    if (!error.needsCodecs) throw error;
    codecs = true;
    return askAboutFiles(operation, parameters, options);
  }
}

export async function inspectScan(files, options = {}) {
  const { engine, answer } = await askAboutFiles('inspect', request(files, options), options);
  engine.giveBack();
  return answer;
}

export async function readScan(files, options = {}) {
  const { engine, answer } = await askAboutFiles('read', request(files, options), options);
  const { series, spacing, resample, volume } = options;
  return new Scan(engine, answer, { series, spacing, resample, volume });
}

const typeNames = {
  Uint8Array: 'uint8', Uint8ClampedArray: 'uint8', Int8Array: 'int8', Uint16Array: 'uint16', Int16Array: 'int16',
  Int32Array: 'int32', Float32Array: 'float32', Float64Array: 'float64',
};

export async function scanOf(samples, { dims, spacing, origin, direction } = {}) {
  const type = typeNames[samples?.[Symbol.toStringTag]];  // of a subclass, too
  if (!type) throw new MarrowError(`samples of ${samples?.constructor?.name} are not supported: convert them to Float64Array`, 2);
  const geometry = checked({ dims, spacing, origin, direction }), engine = Engine.take();
  try {
    const description = await engine.call('adopt', { type, ...geometry, samples });
    return new Scan(engine, { ...description, name: 'scan' }, {});
  } catch (error) {
    engine.giveBack();
    throw error;
  }
}

class Scan {
  #engine;

  constructor(engine, description, options) {
    this.#engine = engine;
    const { histogram, ...rest } = description;
    Object.assign(this, rest, { options, histogram: { ...histogram, counts: Float64Array.from(histogram.counts) } });
  }

  async slice(axis, index) {
    return this.#engine.call('slice', { ...checked({ axis, index }), type: this.sampleType });
  }

  dispose() {
    this.#engine.cancel();
  }

  static engineOf(scan) {
    const known = Object(scan) === scan && #engine in scan;
    if (!known) throw new MarrowError('scan must be what readScan() or scanOf() resolves to', 2);
    return scan.#engine;
  }
}

// ---------------------------------------------------------------------------------------------------------- surfaces

function checkCrop(crop, { dims }) {
  if (crop && !dims.every((n, a) => 0 <= crop.first[a] && crop.first[a] <= crop.last[a] && crop.last[a] < n))
    throw new MarrowError(`crop must be within 0,0,0 to ${dims.map((n) => n - 1)}, not from ${crop.first} to ${crop.last}`, 2);
}

export class Extractor {
  #engine;
  #number;

  constructor(engine, number, scan, options) {
    this.#engine = engine;
    this.#number = number;
    this.scan = scan;
    this.options = options;
  }

  static async create(scan, { closed = true, snap = 0, topology = false, normals = true, crop } = {}) {
    const options = checked({ closed, snap, topology, normals, crop }), engine = Scan.engineOf(scan);
    checkCrop(crop, scan);
    const { extractor } = await engine.call('createExtractor', options);
    return new Extractor(engine, extractor, scan, options);
  }

  async extract(isovalue, { level = 0, signal } = {}) {
    checked({ isovalue, level, signal });
    const latest = `${this.#number}:${level}`;
    const mesh = await this.#engine.call('extract', { extractor: this.#number, isovalue, level }, { latest, signal, abandon: true });
    return { ...mesh, name: String(isovalue) };
  }

  recycle(mesh) {
    const buffers = [mesh.points, mesh.normals, mesh.triangles].map((array) => array.buffer).filter((b) => b.byteLength > 0);
    mesh.points = new Float32Array();
    mesh.normals = new Float32Array();
    mesh.triangles = new Uint32Array();
    this.#engine.tell('recycle', { buffers }, buffers);
  }

  dims(level) {
    const { crop } = this.options;
    return this.scan.dims.map((n, a) => Math.ceil((crop ? crop.last[a] - crop.first[a] + 1 : n) / 2 ** level));
  }

  dispose() {
    this.#engine.tell('dropExtractor', { extractor: this.#number });
  }
}

export async function readLabelTable(scan, file) {
  const { labels, matches, name } = await Scan.engineOf(scan).call('labelTable', { files: listOf(file) });
  if (!matches) throw new MarrowError(`'${name}' has none of the map's labels`, 2);
  return { name, labels };
}

export async function labels(scan, { relax = 40, only, crop, table, onProgress, signal } = {}) {
  const engine = Scan.engineOf(scan), parameters = checked({ relax, only, crop });
  checked({ table });
  checkCrop(crop, scan);
  // Ending the worker would lose the scan.
  const surfaces = await engine.call('labels', parameters, { onProgress, signal, abandon: true });
  const known = new Map(table?.labels.map((label) => [label.label, label]));
  const sample = scan.spacing[0] * scan.spacing[1] * scan.spacing[2] * Math.abs(determinant(scan.direction));
  return surfaces.map((surface) => {
    const { name, colour } = known.get(surface.label) ?? surface;
    return { ...surface, name, colour, samplesVolume: surface.samples * sample };
  });
}

function determinant([a, b, c, d, e, f, g, h, i]) {
  return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
}

// ------------------------------------------------------------------------------------------------------------ meshes

// The worker makes room for whole points and triangles.
function arraysOf(mesh) {
  for (const [name, array] of Object.entries(mesh)) {
    if (array?.length === undefined) throw new MarrowError(`mesh must have ${name}: give one such as extract() returns`, 2);
    if (array.length % 3 !== 0) throw new MarrowError(`${name} must have three elements each, but there are ${array.length} in all`, 2);
  }
  return mesh;
}

function plain(mesh) {
  const { points, normals = new Float32Array(), triangles, name, colour } = mesh ?? {};
  const arrays = arraysOf({ points, normals, triangles });
  if (normals.length !== 0 && normals.length !== points.length)
    throw new MarrowError(`normals must be one for each of the ${points.length / 3} points, or none, not ${normals.length / 3}`, 2);
  return { ...arrays, ...checked({ name, colour }) };
}
const named = (mesh, { name, colour }) => ({ ...mesh, ...(name !== undefined && { name }), ...(colour && { colour }) });

export async function keepComponents(mesh, { largest, count, minVolume, cavities, ...work } = {}) {
  const parameters = { mesh: plain(mesh), ...checked({ largest, count, minVolume, cavities }) };
  const answer = await inWorker((engine) => engine.call('keepComponents', parameters, work));
  return { mesh: named(answer.mesh, mesh), note: '' };
}

export async function smooth(mesh, { iterations = 20, bound, ...work } = {}) {
  checked({ iterations, bound });
  const matrix = typeof bound === 'object' ? rowsOf(bound.indexToPhysical) : undefined;
  const parameters = { mesh: plain(mesh), iterations, bound: matrix, maxMove: matrix ? undefined : bound };
  const { restored, ...answer } = await inWorker((engine) => engine.call('smooth', parameters, work));
  const note = restored === 0 ? '' : restored === 1 ? '1 component is too small to smooth and keeps its shape'
    : `${restored} components are too small to smooth and keep their shape`;
  return { ...answer, mesh: named(answer.mesh, mesh), note };
}

// The linear part of a matrix in columns of four, row by row.
const rowsOf = (m) => [m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]];

export async function simplify(mesh, { keep, triangles, maxError, scan, ...work } = {}) {
  const parameters = { mesh: plain(mesh), ...checked({ keep, triangles, maxError }) };
  checked({ scan });
  if ((keep ?? triangles ?? maxError) === undefined)
    throw new MarrowError('simplify needs keep, triangles or maxError, to know when to stop', 2);
  if (keep !== undefined && triangles !== undefined)
    throw new MarrowError('keep and triangles both set the number of triangles: give one of them', 2);
  const { wanted, ...answer } = await inWorker((engine) => engine.call('simplify', parameters, work));
  const notes = [];
  if (maxError === undefined && wanted !== undefined && answer.mesh.triangles.length / 3 > wanted)
    notes.push(`${wanted} triangles were requested, but the step stopped where the surface would change its topology or pass ` +
      'through itself');
  const coarsest = scan ? Math.max(...scan.spacing) : Infinity;
  if (maxError === undefined && answer.deviationMax > coarsest)
    notes.push(`the surface moved by up to ${answer.deviationMax.toPrecision(3)} mm, more than the ${coarsest.toPrecision(3)} mm ` +
      'between samples: a largest error keeps it closer');
  return { ...answer, mesh: named(answer.mesh, mesh), note: notes.join('; ') };
}

// Normals play no part in these, so they are not copied to the worker.
const bare = (mesh) => ({ ...arraysOf({ points: mesh?.points, triangles: mesh?.triangles }), normals: new Float32Array() });

export const measure = (mesh, work = {}) => inWorker((engine) => engine.call('measure', { mesh: bare(mesh) }, work));

export const check = (mesh, { minWall, ...work } = {}) =>
  inWorker((engine) => engine.call('check', { mesh: bare(mesh), ...checked({ minWall }) }, work));

export async function writeMesh(mesh, name, { space = 'LPS', ...work } = {}) {
  const meshes = (Array.isArray(mesh) ? mesh : [mesh]).map(plain);
  checked({ space });
  if (typeof name !== 'string') throw new MarrowError(`name must be that of a file, such as 'skull.stl', not ${name}`, 2);
  if (/[/\\]/.test(name)) throw new MarrowError(`'${name}' is a path: give the name of a file`, 2);
  if (!/.\.((stl|ply|obj)(\.gz)?|vtp|3mf|glb)$/i.test(name))
    throw new MarrowError(`there is no mesh format for '${name}': ` +
      'its extension must be .stl, .ply, .obj (also with .gz), .vtp, .3mf or .glb', 2);
  if (space === 'RAS' && /\.glb$/i.test(name)) throw new MarrowError('glTF has its own axes and cannot be in RAS', 2);
  const bytes = await inWorker((engine) => engine.call('write', { meshes, file: name, space }, work));
  return new Blob([bytes], { type: mediaTypeOf(name) });
}

function mediaTypeOf(name) {
  const types = { stl: 'model/stl', glb: 'model/gltf-binary', '3mf': 'model/3mf', obj: 'model/obj', ply: 'application/ply' };
  return types[name.split('.').pop().toLowerCase()] ?? 'application/octet-stream';
}
