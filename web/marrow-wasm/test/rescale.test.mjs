// Scans whose values have a fraction: samples stay as they are stored, and all that a page gets are values.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';

import { bytesOf, folder, geometry, lumps, marrow, runNative, withNative } from './support.mjs';

const { Extractor, readScan, writeMesh } = marrow;
const [nx, ny, nz] = geometry.dims;
const slope = 0.25, intercept = -1000.375;  // exact in float32
const value = (sample) => slope * sample + intercept;

/** Writes lumps of int16 as NIfTI with this slope and intercept. */
function writeNifti(path, samples) {
  const header = Buffer.alloc(352);
  header.writeInt32LE(348, 0);
  [3, nx, ny, nz, 1, 1, 1, 1].forEach((size, i) => header.writeInt16LE(size, 40 + 2 * i));
  header.writeInt16LE(4, 70);
  header.writeInt16LE(16, 72);
  [1, ...geometry.spacing].forEach((distance, i) => header.writeFloatLE(distance, 76 + 4 * i));
  [352, slope, intercept].forEach((number, i) => header.writeFloatLE(number, 108 + 4 * i));
  header.writeUInt8(2, 123);
  header.write('n+1\0', 344, 'latin1');
  writeFileSync(path, Buffer.concat([header, Buffer.from(samples.buffer)]));
  return path;
}

test('samples stay as stored, and a page gets their values', async (t) => {
  const samples = lumps('int16');
  const scan = await readScan(writeNifti(join(folder(t), 'scan.nii'), samples));
  assert.equal(scan.bytes, samples.byteLength);
  assert.equal(scan.sampleType, 'float32');
  for (const [axis, index, at] of [[0, 5, (u, v) => [5, u, v]], [1, 6, (u, v) => [u, 6, v]], [2, 7, (u, v) => [u, v, 7]]]) {
    const slice = await scan.slice(axis, index);
    assert.ok(slice.samples instanceof Float32Array);
    assert.equal(slice.samples.length, slice.width * slice.height);
    const [i, j, k] = at(4, 3);
    assert.equal(slice.samples[3 * slice.width + 4], value(samples[(k * ny + j) * nx + i]));
  }
  assert.equal(scan.histogram.lower, value(Math.min(...samples)));
  assert.equal(scan.histogram.upper, value(Math.max(...samples)));
  const sorted = Int16Array.from(samples).sort(), part = (share) => value(sorted[Math.floor(share * (sorted.length - 1))]);
  assert.deepEqual(scan.window, { lower: part(0.01), upper: part(0.99) });
  assert.ok(scan.otsu > part(0.1) && scan.otsu < part(0.9));
  scan.dispose();
});

test('the surface at a value is native\'s', withNative, async (t) => {
  const path = folder(t);
  const scan = await readScan(writeNifti(join(path, 'scan.nii'), lumps('int16')));
  const isovalue = value(55.5);
  assert.deepEqual(
    await runNative(['-q', '--no-alarm', 'scan.nii', `--isovalue=${isovalue}`, '-o', 'native.ply'], path), { code: 0, message: '' });
  const mesh = await (await Extractor.create(scan)).extract(isovalue);
  assert.ok(mesh.triangles.length > 1000);
  assert.ok((await bytesOf(await writeMesh(mesh, 'a.ply'))).equals(readFileSync(join(path, 'native.ply'))));
  scan.dispose();
});
