// Scans for the tests: the demo's head as DICOM, and small files in other formats.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { build } from 'vite';

const root = fileURLToPath(new URL('..', import.meta.url));

/** Compiles modules of src/demo for node. */
async function demoModules() {
  const result = await build({
    configFile: false, root, logLevel: 'error',
    build: { write: false, minify: false, lib: { entry: { all: join(root, 'tests/demo_modules.ts') }, formats: ['es'] } },
  });
  const { code } = result[0].output[0];
  return import(`data:text/javascript;base64,${Buffer.from(code).toString('base64')}`);
}

/** Writes the demo's head as a folder of DICOM files; returns the folder. */
export async function writeHead(folder) {
  const { DIMS, headFile } = await demoModules(), to = join(folder, 'head');
  mkdirSync(to);
  for (let k = 0; k < DIMS[2]; ++k) writeFileSync(join(to, `${String(k + 1).padStart(3, '0')}.dcm`), headFile(k));
  return to;
}

/** A ball of bone in air, 48 samples along each axis, as samples in Hounsfield units. */
function ball() {
  const n = 48, samples = new Int16Array(n ** 3);
  for (let k = 0; k < n; ++k)
    for (let j = 0; j < n; ++j)
      for (let i = 0; i < n; ++i)
        samples[(k * n + j) * n + i] = Math.max(-1000, Math.min(1500, 225.5 + 500 * (18 - Math.hypot(i - 23.5, j - 22, k - 24))));
  return { n, samples };
}

/** NIfTI-1 of a ball whose axes are oblique in the patient. */
export function niftiBall() {
  const { n, samples } = ball(), header = Buffer.alloc(352);
  header.writeInt32LE(348, 0);
  [3, n, n, n, 1, 1, 1, 1].forEach((d, i) => header.writeInt16LE(d, 40 + 2 * i));
  header.writeInt16LE(4, 70); // int16
  header.writeInt16LE(16, 72);
  [1, 0.8, 0.9, 1.5].forEach((d, i) => header.writeFloatLE(d, 76 + 4 * i));
  header.writeFloatLE(352, 108);
  header.writeFloatLE(1, 112);
  header.writeUInt8(2, 123); // mm
  header.writeInt16LE(1, 254); // sform
  const c = Math.cos(0.3), s = Math.sin(0.3);
  [[0.8 * c, -0.9 * s, 0, -10], [0.8 * s, 0.9 * c, 0, 20], [0, 0, 1.5, -30]].flat().forEach((v, i) => header.writeFloatLE(v, 280 + 4 * i));
  header.write('n+1\0', 344, 'latin1');
  return Buffer.concat([header, Buffer.from(samples.buffer)]);
}

/** The same with a second volume, in which the ball is air in bone. */
export function niftiVolumes() {
  const one = niftiBall(), second = Int16Array.from(ball().samples, (v) => 451 - v);
  one.writeInt16LE(4, 40);
  one.writeInt16LE(2, 48);
  return Buffer.concat([one, Buffer.from(second.buffer)]);
}

export const niftiBallGz = () => gzipSync(niftiBall());

/** NRRD with samples of 1 mm. `more` lines may follow the header's own. */
export function nrrd(type, dims, samples, more = '') {
  const header = `NRRD0005\ntype: ${type}\ndimension: 3\nsizes: ${dims.join(' ')}\nspace: left-posterior-superior\n` +
    'space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n' + `${more}\n`;
  return Buffer.concat([Buffer.from(header), Buffer.from(samples.buffer)]);
}

/** NRRD of 16 samples along each axis: `inside` in a cube in the middle, and `outside` around it. */
export function cubeNrrd(type, Samples, outside, inside) {
  const n = 16, middle = (i) => i >= 4 && i < 12;
  const at = (i) => [i % n, Math.floor(i / n) % n, Math.floor(i / n / n)].every(middle);
  return nrrd(type, [n, n, n], Samples.from({ length: n ** 3 }, (_, i) => (at(i) ? inside : outside)));
}

/** NRRD of a label map with the halves of a ball; `segments` are the lines of 3D Slicer about them. */
export function labelNrrd(segments) {
  const { n, samples } = ball();
  return nrrd('uint8', [n, n, n], Uint8Array.from(samples, (v, at) => (v < 225.5 ? 0 : at % n < 24 ? 1 : 2)), segments);
}
