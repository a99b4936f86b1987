// Options that do not fit are refused, not changed.
import assert from 'node:assert/strict';
import test from 'node:test';

import { geometry, lumps, marrow, rejection } from './support.mjs';

const { Extractor, check, commandLine, keepComponents, labels, measure, readScan, scanOf, simplify, smooth, writeMesh } = marrow;

const tetrahedron = () => ({
  points: Float32Array.of(0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9), triangles: Uint32Array.of(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3),
});

test('numbers that JSON lacks, fractions and unknown words are refused by their names', async (t) => {
  const scan = await scanOf(lumps('uint8'), geometry), extractor = await Extractor.create(scan), mesh = tetrahedron();
  t.after(() => scan.dispose());
  const file = { path: 'a.png', data: new Uint8Array(9) }, { dims } = geometry;
  const refused = {
    spacing: [() => readScan(file, { spacing: [1, 1, NaN] }), () => scanOf(new Uint8Array(8), { dims: [2, 2, 2], spacing: [1, 1] })],
    volume: [() => readScan(file, { volume: 0.5 })],
    index: [() => scan.slice(2, 1.5)],
    snap: [() => Extractor.create(scan, { snap: NaN })],
    crop: [() => Extractor.create(scan, { crop: { first: [0, 0, 0], last: [3.5, 9, 9] } }), () => labels(scan, { crop: { first: dims } })],
    isovalue: [() => extractor.extract(NaN)],
    level: [() => extractor.extract(50, { level: 0.5 })],
    relax: [() => labels(scan, { relax: NaN })],
    only: [() => labels(scan, { only: [1.5] })],
    count: [() => keepComponents(mesh, { count: 1.5 })],
    minVolume: [() => keepComponents(mesh, { minVolume: NaN })],
    iterations: [() => smooth(mesh, { iterations: 2.5 })],
    bound: [() => smooth(mesh, { bound: NaN }), () => smooth(mesh, { bound: '1' })],
    keep: [() => simplify(mesh, { keep: NaN })],
    triangles: [() => simplify(mesh, { triangles: 2.5 })],
    maxError: [() => simplify(mesh, { maxError: Infinity })],
    minWall: [() => check(mesh, { minWall: NaN })],
    colour: [() => writeMesh({ ...mesh, colour: [1, NaN, 0] }, 'a.glb')],
    space: [() => writeMesh(mesh, 'a.stl', { space: 'ras' })],
  };
  for (const [name, calls] of Object.entries(refused)) {
    for (const call of calls) {
      const { code, message } = await rejection(call());
      assert.equal(code, 2, message);
      assert.ok(message.startsWith(`${name} must be `), message);
    }
  }
});

test('arrays that end within a point or a triangle are refused', async () => {
  const { points, triangles } = tetrahedron(), normals = new Float32Array(12);
  const meshes = {
    points: { points: points.slice(1), triangles }, normals: { points, normals: normals.slice(1), triangles },
    triangles: { points, triangles: triangles.slice(1) },
  };
  for (const [name, mesh] of Object.entries(meshes)) {
    for (const call of [() => smooth(mesh), () => writeMesh(mesh, 'a.stl'), ...(name === 'normals' ? [] : [() => measure(mesh), () => check(mesh)])]) {
      const { code, message } = await rejection(call());
      assert.equal(code, 2);
      assert.ok(message.startsWith(name), message);
    }
  }
});

test('samples of a class of their own are those of its base', async () => {
  for (const samples of [Buffer.alloc(8, 7), new (class extends Int16Array {})(8)]) {
    const scan = await scanOf(samples, { dims: [2, 2, 2] });
    assert.equal(scan.sampleType, Buffer.isBuffer(samples) ? 'uint8' : 'int16');
    assert.equal((await scan.slice(2, 1)).samples[3], samples[7]);
    scan.dispose();
  }
});

test('labels that do not look like a map have names and colours, too', async (t) => {
  const samples = lumps('int16').map((v) => 50 * Math.floor(v / 50) - 50);  // -50, 0 and 50
  const scan = await scanOf(samples, geometry);
  t.after(() => scan.dispose());
  assert.equal(scan.unit, '');
  const [surface] = await labels(scan, { relax: 0, only: [-50] });
  assert.equal(surface.name, 'label--50');
  assert.equal(surface.colour.length, 3);
});

test('a command line names a scan as a file, and its output as no pattern', () => {
  const scan = { name: 'check', options: {} };
  assert.equal(commandLine({ scan, surfaces: [1], output: 'a.stl' }), 'marrow ./check --isovalue 1 -o a.stl');
  assert.throws(() => commandLine({ scan, surfaces: [1], output: 'a{name}.stl' }), { code: 2, message: /a\{name\}\.stl/ });
});
