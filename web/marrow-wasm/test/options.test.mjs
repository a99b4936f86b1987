// Options that do not fit are refused, not changed.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import test from 'node:test';

import { dicomSeries, folder, geometry, lumps, marrow, rejection, writeVolume } from './support.mjs';

const {
  Extractor, check, commandLine, inspectScan, keepComponents, labels, measure, prepare, readLabelTable, readScan, scanOf, simplify,
  smooth, writeMesh,
} = marrow;

const tetrahedron = () => ({
  points: Float32Array.of(0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9), triangles: Uint32Array.of(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3),
});

test('numbers that JSON lacks, fractions and unknown words are refused by their names', async (t) => {
  const scan = await scanOf(lumps('uint8'), geometry), extractor = await Extractor.create(scan), mesh = tetrahedron();
  t.after(() => scan.dispose());
  const file = { path: 'a.png', data: new Uint8Array(9) }, { dims } = geometry;
  const refused = {
    spacing: [
      () => readScan(file, { spacing: [1, 1, NaN] }), () => readScan(file, { spacing: [1, 0, 1] }),
      () => scanOf(new Uint8Array(8), { dims: [2, 2, 2], spacing: [1, 1] }),
    ],
    volume: [() => readScan(file, { volume: 0.5 })],
    dims: [() => scanOf(new Uint8Array(8), {})],
    axis: [() => scan.slice(3, 0), () => scan.slice(-1, 0), () => scan.slice()],
    index: [() => scan.slice(2, 1.5), () => scan.slice(2)],
    snap: [() => Extractor.create(scan, { snap: NaN })],
    crop: [
      () => Extractor.create(scan, { crop: { first: [0, 0, 0], last: [3.5, 9, 9] } }), () => labels(scan, { crop: { first: dims } }),
      () => Extractor.create(scan, { crop: { first: [0, 0, 0], last: dims } }),
      () => labels(scan, { crop: { first: [0, 0, -1], last: [9, 9, 9] } }),
      () => Extractor.create(scan, { crop: { first: [0, 5, 0], last: [9, 4, 9] } }),
    ],
    isovalue: [() => extractor.extract(NaN), () => extractor.extract()],
    level: [() => extractor.extract(50, { level: 0.5 }), () => extractor.extract(50, { level: 2 ** 32 })],
    relax: [() => labels(scan, { relax: NaN }), () => labels(scan, { relax: -1 })],
    only: [() => labels(scan, { only: [1.5] })],
    table: [() => labels(scan, { table: [] })],
    count: [() => keepComponents(mesh, { count: 1.5 })],
    minVolume: [() => keepComponents(mesh, { minVolume: NaN })],
    iterations: [() => smooth(mesh, { iterations: 2.5 }), () => smooth(mesh, { iterations: 2 ** 32 })],
    bound: [() => smooth(mesh, { bound: NaN }), () => smooth(mesh, { bound: '1' })],
    keep: [NaN, 0, -0.5, 2].map((keep) => () => simplify(mesh, { keep })),
    triangles: [() => simplify(mesh, { triangles: 2.5 })],
    maxError: [() => simplify(mesh, { maxError: Infinity })],
    minWall: [() => check(mesh, { minWall: NaN })],
    scan: [() => simplify(mesh, { keep: 0.5, scan: 'scan' })],
    name: [() => writeMesh({ ...mesh, name: 5 }, 'a.glb')],
    colour: [() => writeMesh({ ...mesh, colour: [1, NaN, 0] }, 'a.glb')],
    space: [() => writeMesh(mesh, 'a.stl', { space: 'ras' })],
    signal: [() => readScan(file, { signal: 5 }), () => extractor.extract(50, { signal: {} }), () => check(mesh, { signal: 'now' })],
    onProgress: [() => readScan(file, { onProgress: 5 }), () => measure(mesh, { onProgress: true })],
    threads: [() => prepare({ threads: 0 })],
    baseUrl: [() => prepare({ baseUrl: 'http://' })],
  };
  for (const [name, calls] of Object.entries(refused)) {
    for (const call of calls) {
      const { code, message } = await rejection(call());
      assert.equal(code, 2, message);
      assert.ok(message.startsWith(`${name} must be `), message);
    }
  }
});

test('what is out of range is refused with the code of the command line', async (t) => {
  const samples = lumps('float32'), mesh = tetrahedron();
  const scan = await scanOf(samples, geometry), extractor = await Extractor.create(scan);
  t.after(() => scan.dispose());
  const refused = [
    () => Extractor.create(scan, { snap: 0.9 }), () => Extractor.create(scan, { snap: -0.1 }),
    () => Extractor.create(scan, { snap: 0.3, topology: true }),
    () => extractor.extract(50, { level: 99 }), () => scan.slice(2, geometry.dims[2]), () => scan.slice(2, -1),
    () => keepComponents(mesh, { count: 0 }), () => keepComponents(mesh, { minVolume: -1 }),
    () => smooth(mesh, { iterations: -1 }), () => smooth(mesh, { bound: -1 }),
    () => simplify(mesh, { triangles: -1 }), () => simplify(mesh, { maxError: 0 }), () => check(mesh, { minWall: -1 }),
    () => writeMesh([mesh, mesh], 'a.stl'), () => writeMesh([], 'a.stl'),
    () => scanOf(samples, { ...geometry, dims: [-1, 1, 1] }),
    () => scanOf(samples, { ...geometry, direction: [1, 0, 0, 1, 0, 0, 0, 0, 1] }),
    ...[smooth, measure, check].map((work) => () => work({ ...mesh, triangles: Uint32Array.of(0, 1, 9) })),
  ];
  for (const call of refused) {
    const { code, message } = await rejection(call());
    assert.equal(code, 2, message);
  }
  // Other faults keep their codes, for the same call too.
  assert.equal((await rejection(labels(scan))).code, 3);  // the samples are no labels
  assert.equal((await rejection(writeMesh({ ...mesh, triangles: new Uint32Array() }, 'a.stl'))).code, 5);
});

test('an extractor that is disposed of says so', async (t) => {
  const scan = await scanOf(lumps('uint8'), geometry), extractor = await Extractor.create(scan);
  t.after(() => scan.dispose());
  extractor.dispose();
  const { code, message } = await rejection(extractor.extract(50));
  assert.equal(code, 2);
  assert.match(message, /^the extractor is disposed of/);
});

test('what is missing, or is something else, is named with what to give', async (t) => {
  const scan = await scanOf(lumps('uint8'), geometry), mesh = tetrahedron(), { points } = mesh;
  t.after(() => scan.dispose());
  const bytes = new Uint8Array(9);
  const refused = {
    files: [
      ...[undefined, 5, null, [undefined], bytes, { path: 'a.nii' }, { data: bytes }, [{ path: 'a.nii', data: bytes.buffer }]]
        .map((files) => () => readScan(files)),
      () => inspectScan(), () => readLabelTable(scan),
    ],
    scan: [
      ...[undefined, 5, { ...scan }, Promise.resolve(scan)].map((other) => () => Extractor.create(other)),
      () => labels(), () => readLabelTable(undefined, { path: 'a.txt', data: bytes }),
    ],
    samples: [() => scanOf(), () => scanOf([1, 2, 3], geometry), () => scanOf(new Uint32Array(8), { dims: [2, 2, 2] })],
    dims: [() => scanOf(new Uint8Array(8))],
    mesh: [
      () => keepComponents(), () => smooth(), () => simplify(undefined, { keep: 0.5 }), () => measure(), () => check(null),
      () => writeMesh(),
      () => writeMesh([mesh, undefined], 'a.glb'), () => smooth(5), () => smooth({ points }), () => measure({ points }),
    ],
    simplify: [() => simplify(mesh), () => simplify(mesh, {})],
    'keep and triangles': [() => simplify(mesh, { keep: 0.5, triangles: 10 })],
    name: [() => writeMesh(mesh)],
  };
  for (const [name, calls] of Object.entries(refused)) {
    for (const call of calls) {
      const { code, message } = await rejection(call());
      assert.equal(code, 2, message);
      assert.ok(message.startsWith(`${name} `) && !message.includes('\n'), message);
    }
  }
  assert.equal((await keepComponents(mesh)).mesh.triangles.length, 12);
});

test('a name of no format is refused with those that there are', async () => {
  for (const name of ['a.xyz', 'a', '', '.stl', 'a.dcm', 'a.vtp.gz', '.stl.gz', 'stl']) {
    const { code, message } = await rejection(writeMesh(tetrahedron(), name));
    assert.equal(code, 2);
    const extensions = '.stl, .ply, .obj (also with .gz), .vtp, .3mf or .glb';
    assert.equal(message, `there is no mesh format for '${name}': its extension must be ${extensions}`);
  }
  for (const name of ['A.STL', 'a.b.Obj.GZ', 'a..ply.gz', 'a.VTP', 'a.3mf', 'a.glb'])
    assert.ok((await writeMesh(tetrahedron(), name)).size > 0);
});

test('messages name options and functions as this package does', async (t) => {
  const path = writeVolume(join(folder(t), 'my options.spacing.mha'), 'uint8', lumps('uint8'));
  const several = [1, 2].flatMap((uid) => dicomSeries(lumps('int16'), geometry, { uid })
    .map(({ path, data }) => ({ path: `${uid}/${path}`, data })));
  const uneven = dicomSeries(lumps('int16')).filter((_, k) => k !== 11), scan = await readScan(path);
  t.after(() => scan.dispose());
  const said = [
    [() => readScan(path, { spacing: [1, 1, 1] }), /^'my options\.spacing\.mha': states .* mm; do not set the option spacing$/],
    [() => readScan(path, { series: 1 }), /only DICOM has series; do not set the option series$/],
    [() => readScan(path, { resample: true }), /do not set the option resample$/],
    [() => readScan(several), /choose one by its number with the option series; inspectScan lists all$/],
    [() => readScan(several, { series: 3 }), /^there is no series '3'.*; inspectScan lists all$/],
    [() => readScan(uneven), /; the option resample makes them even$/],
    [() => Extractor.create(scan, { snap: 0.3, topology: true }), /^the option topology and the option snap do not go together/],
  ];
  for (const [call, expected] of said) {
    const { message } = await rejection(call());
    assert.match(message, expected);
  }
  const { series, reason } = await inspectScan(uneven);
  assert.match(series[0].refusal, /; the option resample makes them even$/);
  assert.equal(reason, series[0].refusal);
  assert.equal((await inspectScan(several, { series: 2 })).reason, 'the option series selects it');
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

test('normals that are not one for each point are refused', async () => {
  const mesh = tetrahedron(), few = { ...mesh, normals: new Float32Array(3) };
  for (const call of [() => keepComponents(few), () => smooth(few), () => simplify(few, { keep: 0.5 }), () => writeMesh(few, 'a.ply')]) {
    const { code, message } = await rejection(call());
    assert.equal(code, 2);
    assert.equal(message, 'normals must be one for each of the 4 points, or none, not 1');
  }
  assert.ok((await measure(few)).volume > 0);  // takes no normals
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
