// Runs in a worker: loads the WebAssembly, and does one request after the other.
import { MarrowError } from './errors.mjs';
import { mount, unmount } from './files.mjs';

const inNode = typeof process === 'object' && process.versions?.node !== undefined;
const port = inNode ? (await import('node:worker_threads')).parentPort : globalThis;
const post = (message, transfer) => port.postMessage(message, transfer);

// Written out, so that bundlers find them.
const files = {
  'marrow': {
    script: new URL('./marrow.mjs', import.meta.url),
    wasm: new URL('./marrow.wasm', import.meta.url),
  },
  'marrow-codecs': {
    script: new URL('./marrow-codecs.mjs', import.meta.url),
    wasm: new URL('./marrow-codecs.wasm', import.meta.url),
  },
  'marrow-mt': {
    script: new URL('./marrow-mt.mjs', import.meta.url),
    wasm: new URL('./marrow-mt.wasm', import.meta.url),
    thread: new URL('./marrow-mt.worker.js', import.meta.url),
  },
  'marrow-mt-codecs': {
    script: new URL('./marrow-mt-codecs.mjs', import.meta.url),
    wasm: new URL('./marrow-mt-codecs.wasm', import.meta.url),
    thread: new URL('./marrow-mt-codecs.worker.js', import.meta.url),
  },
};

function filesOf(name, baseUrl) {
  if (baseUrl === undefined) return files[name];
  const at = (ending) => new URL(`${name}${ending}`, baseUrl);
  return { script: at('.mjs'), wasm: at('.wasm'), thread: at('.worker.js') };
}

const kNeedsCodecs = -1;  // call.cpp: only the module with codecs can do it

let module, options;
const recycled = [];  // ArrayBuffers of meshes that the page gave back

// -------------------------------------------------------------------------------------------------------- the module

async function bytesOf(url) {
  if (inNode && url.protocol === 'file:') return (await import('node:fs/promises')).readFile(url);
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} cannot be loaded (${response.status})`);
  return response.arrayBuffer();
}

async function load() {
  const name = `marrow${options.shared ? '-mt' : ''}${options.codecs ? '-codecs' : ''}`;
  const { script, wasm, thread } = filesOf(name, options.baseUrl);
  if (inNode) {
    // The script of emscripten 3.1.6 expects CommonJS there.
    const { createRequire } = await import('node:module');
    const { fileURLToPath } = await import('node:url');
    globalThis.require ??= createRequire(import.meta.url);
    globalThis.__dirname ??= fileURLToPath(new URL('.', import.meta.url));
    globalThis.__filename ??= fileURLToPath(import.meta.url);
  }
  const { default: createMarrow } = await import(/* @vite-ignore */ script.href);
  const bytes = await bytesOf(wasm);
  let failed;
  const failure = new Promise((resolve, reject) => (failed = reject));
  module = await Promise.race([failure, createMarrow({
    marrowThreads: options.threads,
    mainScriptUrlOrBlob: script.href,
    locateFile: (file) => (file.endsWith('.wasm') ? wasm : thread).href,
    instantiateWasm: (imports, receive) => {
      WebAssembly.instantiate(bytes, imports).then((source) => receive(source.instance, source.module), failed);
      return {};
    },
    onProgress: () => true,
    print: () => {},
    printErr: () => {},
  })]);
}

// The library names a function and options of C++ in its messages. In JSON, a string begins after a quotation mark.
const inJavaScript = (json) => json.replace(/([" ])inspect_scan\b/g, '$1inspectScan')
  .replace(/([" ])options\.(series|spacing|resample|volume|snap|topology)\b(?!\.)/g, '$1the option $2');

let broken = false;  // whether an exception of JavaScript left C++ in the middle of its work, such as with a lock held

// Calls the face. Throws a MarrowError, whose code may be kNeedsCodecs.
function run(operation, parameters = {}) {
  const request = JSON.stringify({ operation, ...parameters });
  const size = module.lengthBytesUTF8(request) + 1;
  const address = module._malloc(size);
  if (address === 0) throw new MarrowError('not enough memory for this input', 3);
  module.stringToUTF8(request, address, size);
  broken = true;
  const code = module._marrow_call(address);
  broken = false;
  module._free(address);
  const answer = JSON.parse(inJavaScript(module.UTF8ToString(module._marrow_answer())));
  if (code !== 0) throw new MarrowError(answer.message, code);
  return answer;
}

// Memory moves when it grows, so views are made anew each time. The module has no view of its own to give: HEAPU8 is one.
const memory = () => module.HEAPU8.buffer;

const arrayTypes = {
  uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, int16: Int16Array, int32: Int32Array, float32: Float32Array,
  float64: Float64Array,
};

// Copies an array out, into memory that the page gave back if that is large enough.
function copyOut(Type, { address, count }) {
  const bytes = count * Type.BYTES_PER_ELEMENT;
  const from = new Uint8Array(memory(), address, bytes);
  let best = -1;
  recycled.forEach((buffer, i) => {
    if (buffer.byteLength >= bytes && (best < 0 || buffer.byteLength < recycled[best].byteLength)) best = i;
  });
  // Memory that is much too large would be kept for long.
  const fits = best >= 0 && recycled[best].byteLength <= 4 * bytes + (1 << 16);
  const buffer = fits ? recycled.splice(best, 1)[0] : new ArrayBuffer(bytes + (bytes >> 3) & ~7);
  const to = new Type(buffer.byteLength >= bytes ? buffer : new ArrayBuffer(bytes), 0, count);
  new Uint8Array(to.buffer, 0, bytes).set(from);
  return to;
}

function copyMesh(answer, transfer) {
  const mesh = {
    points: copyOut(Float32Array, answer.points),
    normals: copyOut(Float32Array, answer.normals),
    triangles: copyOut(Uint32Array, answer.triangles),
  };
  transfer.push(mesh.points.buffer, mesh.normals.buffer, mesh.triangles.buffer);
  return mesh;
}

// Copies a mesh out and frees it in the module.
function takeMesh(answer, transfer) {
  const mesh = copyMesh(answer, transfer);
  run('dropMesh', { mesh: answer.mesh });
  return mesh;
}

function putMesh(mesh) {
  const { points, normals, triangles } = mesh;
  const made = run('createMesh', {
    points: points.length / 3, normals: normals.length / 3, triangles: triangles.length / 3,
  });
  new Float32Array(memory(), made.points.address, points.length).set(points);
  new Float32Array(memory(), made.normals.address, normals.length).set(normals);
  new Uint32Array(memory(), made.triangles.address, triangles.length).set(triangles);
  return made.mesh;
}

// Calls f with the numbers of these meshes in the module.
function withMeshes(meshes, f) {
  const numbers = [];
  try {
    for (const mesh of meshes) numbers.push(putMesh(mesh));
    return f(numbers);
  } finally {
    if (!broken) for (const mesh of numbers) run('dropMesh', { mesh });
  }
}

// ------------------------------------------------------------------------------------------------------ the requests

const withoutMesh = ({ mesh, points, normals, triangles, ...rest }) => rest;

function changeMesh(operation, { mesh, ...parameters }, transfer) {
  return withMeshes([mesh], ([number]) => {
    const answer = run(operation, { ...parameters, mesh: number });
    return { ...withoutMesh(answer), mesh: takeMesh(answer, transfer) };
  });
}

async function withFiles(files, operation, parameters) {
  const mounted = await mount(module, files, inNode);
  try {
    // Other threads have no files of their own: they ask this one, which takes longer. Only decoding is worth it.
    const threads = options.codecs ? 0 : 1;
    const answer = run(operation, { ...parameters, threads, path: mounted.path });
    // Warnings and gaps name files as the user knows them, too.
    return { ...JSON.parse(JSON.stringify(answer).replaceAll(`${mounted.root}/`, '')), name: mounted.name };
  } catch (error) {
    throw readable(error, mounted);
  } finally {
    unmount(module, mounted);
  }
}

// Messages name files as the user knows them.
function readable(error, mounted) {
  if (error instanceof MarrowError)
    error.message = error.message.replaceAll(`${mounted.root}/`, '').replaceAll(mounted.root, mounted.name);
  return error;
}

const requests = {
  async start(given) {
    options = given;
    await load();
    const { threads } = run('threads', { threads: options.threads });
    // Compiles what extractions need.
    const samples = new Uint8Array(512).map((_, i) => (i % 7) * 30);
    requests.adopt({ type: 'uint8', dims: [8, 8, 8], samples });
    const { extractor } = requests.createExtractor({ normals: true, closed: true, snap: 0, topology: false });
    for (let i = 0; i < 30; ++i) run('extract', { extractor, isovalue: 50 + i, level: 0 });
    run('dropExtractor', { extractor });
    return { threads };
  },
  inspect: ({ files, ...parameters }) => withFiles(files, 'inspect', parameters),
  read: ({ files, ...parameters }) => withFiles(files, 'read', parameters),
  adopt({ samples, ...parameters }) {
    const { address, count } = run('adopt', parameters);
    const bytes = new Uint8Array(samples.buffer, samples.byteOffset, samples.byteLength);
    if (bytes.length !== count) throw new MarrowError(`there are ${bytes.length} bytes of samples, and dims ask for ${count}`, 2);
    new Uint8Array(memory(), address, count).set(bytes);
    return run('describe');
  },
  slice({ axis, index, type }, transfer) {
    const { samples, ...rest } = run('slice', { axis, index });
    // The copy of a view is never shared memory, which could not be transferred.
    const { buffer } = new Uint8Array(memory(), samples.address, samples.count).slice();
    transfer.push(buffer);
    return { axis, index, ...rest, samples: new arrayTypes[type](buffer) };
  },
  labelTable: ({ files }) => withFiles(files, 'labelTable', {}),
  createExtractor: (parameters) => run('createExtractor', { ...parameters, stoppable: options.stoppable }),
  extract(parameters, transfer) {
    const start = performance.now();
    const answer = run('extract', parameters);
    const extracted = performance.now();
    const mesh = copyMesh(answer, transfer);
    const stats = {
      isovalue: parameters.isovalue, level: parameters.level, extractMs: extracted - start,
      copyMs: performance.now() - extracted,
    };
    return { ...mesh, stats };
  },
  dropExtractor: (parameters) => run('dropExtractor', parameters),
  recycle({ buffers }) {
    recycled.push(...buffers);
    // Six are one mesh that is shown and one on its way.
    recycled.sort((a, b) => b.byteLength - a.byteLength);
    recycled.length = Math.min(recycled.length, 6);
  },
  labels(parameters, transfer) {
    return Object.values(run('labels', parameters)).map((one) => ({ ...withoutMesh(one), ...takeMesh(one, transfer) }));
  },
  keepComponents: (parameters, transfer) => changeMesh('keepComponents', parameters, transfer),
  smooth: (parameters, transfer) => changeMesh('smooth', parameters, transfer),
  simplify: (parameters, transfer) => changeMesh('simplify', parameters, transfer),
  measure: ({ mesh }) => withMeshes([mesh], ([number]) => run('measure', { mesh: number })),
  check: ({ mesh, ...parameters }) => withMeshes([mesh], ([number]) => run('check', { ...parameters, mesh: number })),
  write({ meshes, file, space }, transfer) {
    module.FS.mkdirTree('/out');
    const path = `/out/${file}`;
    try {
      withMeshes(meshes, (numbers) => run('write', {
        objects: numbers.map((mesh, i) => ({ mesh, name: meshes[i].name ?? '', colour: meshes[i].colour })), file: path, space,
      }));
      const bytes = module.FS.readFile(path);
      transfer.push(bytes.buffer);
      return bytes;
    } catch (error) {
      error.message = error.message.replaceAll('/out/', '');
      throw error;
    } finally {
      if (module.FS.analyzePath(path).exists) module.FS.unlink(path);
    }
  },
};

// --------------------------------------------------------------------------------------------------------- the queue

const waiting = [];
let busy = false, startFailure;

// What is quick and drawn at once comes first, then previews, then the rest in order.
function priority({ name, parameters }) {
  if (name === 'slice' || name === 'recycle' || name === 'dropExtractor') return 0;
  return name === 'extract' && parameters.level > 0 ? 1 : 2;
}

function receive(message) {
  if (message.name === 'forget') {
    const at = waiting.findIndex((other) => other.id === message.parameters.call);
    if (at >= 0) waiting.splice(at, 1);
    return;
  }
  if (message.latest !== undefined) {
    const older = waiting.findIndex((other) => other.latest === message.latest);
    if (older >= 0) post({ id: waiting.splice(older, 1)[0].id, error: { message: 'cancelled', code: 130 } });
  }
  waiting.push(message);
  if (!busy) work();
}

async function work() {
  busy = true;
  while (waiting.length > 0) {
    let next = 0;
    for (let i = 1; i < waiting.length; ++i) {
      if (priority(waiting[i]) < priority(waiting[next])) next = i;
    }
    const { id, name, parameters, stop, progress } = waiting.splice(next, 1)[0];
    const transfer = [];
    try {
      if (startFailure) throw startFailure;
      if (module) module.onProgress = reporter(id, progress, stop);
      const result = await requests[name](parameters, transfer);
      if (id !== undefined) post({ id, result }, transfer);
    } catch (error) {
      if (name === 'start') startFailure = error;
      const message = error instanceof WebAssembly.RuntimeError || error instanceof RangeError
        ? `not enough memory for this input (${error.message})` : error.message ?? String(error);
      // Other errors have codes of their own, as those of browsers do.
      const code = error instanceof MarrowError ? error.code : 3, needsCodecs = code === kNeedsCodecs;
      if (id !== undefined) post({ id, error: { message, code, needsCodecs, broken } });
    }
    // Messages that came meanwhile are received before the next request is chosen.
    await new Promise((resolve) => nextTurn(resolve));
  }
  busy = false;
}

const channel = new MessageChannel();
let turn;
channel.port1.onmessage = () => turn?.();
if (inNode) channel.port1.unref();
function nextTurn(f) {
  turn = f;
  if (inNode) setImmediate(f);
  else channel.port2.postMessage(0);
}

// `stop`, if given, is shared with the page, which may set it while this worker is busy.
function reporter(id, wanted, stop) {
  let last = 0;
  return (fraction) => {
    if (stop && Atomics.load(stop, 0) !== 0) return false;
    const now = performance.now();
    if (wanted && (now - last > 50 || fraction === 1)) {
      last = now;
      post({ id, progress: fraction });
    }
    return true;
  };
}

if (inNode) port.on('message', receive);
else port.onmessage = (event) => receive(event.data);
