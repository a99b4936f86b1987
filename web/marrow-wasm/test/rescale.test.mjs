// Scans whose values have a fraction: samples stay as they are stored, and all that a page gets are values.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';

import { bytesOf, folder, geometry, lumps, marrow, runNative, withNative } from './support.mjs';

const { Extractor, commandLine, contour, labels, readScan, scanOf, writeMesh } = marrow;
const [nx, ny, nz] = geometry.dims;
const exact = { slope: 0.25, intercept: -1000.375 };  // in float32
const value = (sample) => exact.slope * sample + exact.intercept;

/** Writes samples of int16 as NIfTI. */
function writeNifti(path, samples, { slope, intercept } = exact) {
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

test('contours enclose samples of the isovalue, as the surface does', async (t) => {
  const slope = Math.fround(0.1), samples = new Int16Array(nx * ny * nz).fill(3);
  for (let k = 5; k < 15; ++k)
    for (let j = 6; j < 20; ++j) samples.fill(2870, (k * ny + j) * nx + 8, (k * ny + j) * nx + 25);
  const isovalue = slope * 2870;
  assert.ok(isovalue > Math.fround(isovalue));
  const scan = await readScan(writeNifti(join(folder(t), 'scan.nii'), samples, { slope, intercept: 0 }));
  const slice = await scan.slice(2, 7);
  assert.equal(slice.rescaled, true);
  assert.ok((await (await Extractor.create(scan)).extract(isovalue)).triangles.length > 0);
  assert.equal(contour(slice, isovalue).length, 4 * 2 * (17 + 14));
  scan.dispose();

  // Samples that are float32 themselves are below it.
  const values = await scanOf(Float32Array.from(samples, (sample) => slope * sample), geometry);
  const plain = await values.slice(2, 7);
  assert.equal(plain.rescaled, false);
  assert.equal((await (await Extractor.create(values)).extract(isovalue)).triangles.length, 0);
  assert.equal(contour(plain, isovalue).length, 0);
  values.dispose();
});

for (const [name, slope] of [['a half', 0.5], ['a 255th', 1 / 255]]) {
  test(`labels are values where the slope is ${name}`, withNative, async (t) => {
    const path = folder(t);
    const map = lumps('int16').map((v) => (v < 40 ? 0 : v < 60 ? 1 : v < 75 ? 2 : 4));
    for (let i = 0; i < map.length; i += 37) map.fill(map[i], i, i + 12);
    const stored = map.map((label) => Math.round(label / slope));
    const scan = await readScan(writeNifti(join(path, 'map.nii'), stored, { slope, intercept: 0 }));
    t.after(() => scan.dispose());
    assert.equal(scan.unit, 'labels');
    assert.deepEqual(scan.labels.map(({ label }) => label), [1, 2, 4]);
    assert.equal((await scan.slice(2, 7)).rescaled, false);
    const words = commandLine({ scan, labels: {}, output: 'map.3mf' }).split(' ').slice(1);
    assert.deepEqual(await runNative(['-q', ...words], path), { code: 0, message: '' });
    assert.ok((await bytesOf(await writeMesh(await labels(scan), 'map.3mf'))).equals(readFileSync(join(path, 'map.3mf'))));
  });
}
