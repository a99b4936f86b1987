// Reading scans, and what goes wrong with them.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import test from 'node:test';
import { gzipSync } from 'node:zlib';

import { bytesOf, dicomSeries, folder, geometry, lumps, marrow, rejection, runNative, withNative, writeVolume } from './support.mjs';

const { Extractor, contour, inspectScan, readScan, scanOf, writeMesh } = marrow;

test('DICOM in memory and on the disk has native\'s surface', withNative, async (t) => {
  const path = folder(t);
  const files = dicomSeries(lumps('int16'));
  for (const file of files) {
    mkdirSync(dirname(join(path, file.path)), { recursive: true });
    writeFileSync(join(path, file.path), file.data);
  }
  await runNative(['-q', 'series', '--isovalue', '55.5', '-o', 'native.stl'], path);
  for (const input of [files, join(path, 'series')]) {
    const scan = await readScan(input);
    assert.equal(scan.name, 'series');
    assert.equal(scan.modality, 'CT');
    assert.equal(scan.unit, 'HU');
    const mesh = await (await Extractor.create(scan)).extract(55.5);
    assert.ok((await bytesOf(await writeMesh(mesh, 'a.stl'))).equals(readFileSync(join(path, 'native.stl'))));
    scan.dispose();
  }
});

// A ZIP archive of files, which are compressed unless they are `stored`. Paths may be bytes of any encoding.
function zip(files, { stored = false } = {}) {
  const parts = [], entries = [];
  let offset = 0;
  for (const { path, data } of files) {
    // A gzip file is a header of 10 bytes, the compressed data, the CRC-32 and the size.
    const name = Buffer.from(path), gzip = gzipSync(data), packed = stored ? data : gzip.subarray(10, -8);
    const common = Buffer.alloc(26);
    common.writeUInt16LE(20, 0);
    common.writeUInt16LE(stored ? 0 : 8, 4);
    gzip.copy(common, 10, gzip.length - 8, gzip.length - 4);
    common.writeUInt32LE(packed.length, 14);
    common.writeUInt32LE(data.length, 18);
    common.writeUInt16LE(name.length, 22);
    parts.push(Buffer.from('PK\x03\x04'), common, name, packed);
    const rest = Buffer.alloc(14);
    rest.writeUInt32LE(offset, 10);
    entries.push(Buffer.from('PK\x01\x02\x14\x00'), common, rest, name);
    offset += 30 + name.length + packed.length;
  }
  const list = Buffer.concat(entries), end = Buffer.alloc(22);
  end.write('PK\x05\x06', 'latin1');
  end.writeUInt16LE(files.length, 8);
  end.writeUInt16LE(files.length, 10);
  end.writeUInt32LE(list.length, 12);
  end.writeUInt32LE(offset, 16);
  return Buffer.concat([...parts, list, end]);
}

test('a ZIP archive is its files', async () => {
  const files = dicomSeries(lumps('int16'));
  const report = await inspectScan({ path: 'study.zip', data: zip(files) });
  assert.equal(report.format, 'DICOM');
  assert.equal(report.series.length, 1);
  assert.equal(report.series[0].files, 23);
  assert.equal(report.chosen, 0);
  assert.equal((await rejection(inspectScan({ path: 'study.zip', data: zip(files).subarray(100) }))).code, 3);
});

test('a ZIP archive with a changed byte is refused, whether it is compressed or not', async () => {
  const files = dicomSeries(lumps('int16'));
  for (const stored of [false, true]) {
    const whole = zip(files, { stored }), { series } = await inspectScan({ path: 'study.zip', data: whole });
    assert.equal(series[0].files, 23);
    for (const at of [600, 900, 1200]) {
      const damaged = Buffer.from(whole);
      damaged[damaged.indexOf('series/011.dcm') + at] ^= 4;
      const error = await rejection(readScan({ path: 'study.zip', data: damaged }));
      assert.equal(error.code, 3);
      assert.match(error.message, /^'study\.zip' is a damaged or unsupported ZIP archive; unpack it first$/);
    }
  }
});

test('files of a ZIP archive whose names are not UTF-8 stay apart', async () => {
  const files = dicomSeries(lumps('int16')).map(({ data }, k) => ({ path: Buffer.from([0x95, 0x81 + k]), data }));
  const { series } = await inspectScan({ path: 'study.zip', data: zip(files) });
  assert.equal(series[0].files, 23);
});

test('two files of the same path are refused', async () => {
  const files = dicomSeries(lumps('int16'));
  const error = await rejection(readScan([...files, files[5]]));
  assert.equal(error.code, 2);
  assert.match(error.message, /two files 'series\/005\.dcm'/);
  // What an archive holds is not what stands beside it.
  const data = zip(dicomSeries(lumps('int16'), geometry, { uid: 2 }));
  assert.deepEqual((await inspectScan([...files, { path: 'series.zip', data }])).series.map((s) => s.files), [23, 23]);
});

test('a header is read with the files that it names, whatever else is beside it', async () => {
  const samples = lumps('int16'), [nx, ny, nz] = geometry.dims, bytes = Buffer.from(samples.buffer), size = 2 * nx * ny;
  const slices = Array.from({ length: nz }, (_, k) => ({ path: `ct/${k}.raw`, data: bytes.subarray(k * size, (k + 1) * size) }));
  const meta = (data) => Buffer.from(`NDims = 3\nDimSize = ${nx} ${ny} ${nz}\nElementSpacing = 1 1 2\nElementType = MET_SHORT\nElementDataFile = ${data}\n`);
  const whole = [{ path: 'ct/ct.mhd', data: meta('ct.raw') }, { path: 'ct/ct.raw', data: bytes }];
  const store = { path: 'ct/.DS_Store', data: Buffer.from('\0\0\0\x01Bud1') };
  const list = { path: 'ct/ct.mhd', data: meta(`LIST\n${slices.map(({ path }) => path.slice(3)).join('\n')}`) };
  for (const files of [whole, [...whole, store], [list, ...slices]]) {
    const scan = await readScan(files);
    assert.equal(scan.name, 'ct.mhd');
    assert.deepEqual((await scan.slice(2, 7)).samples, samples.subarray(7 * nx * ny, 8 * nx * ny));
    scan.dispose();
  }
  // A stray header does not hide a series.
  const stray = { path: 'series/stray.hdr', data: Buffer.from('about something else') };
  assert.equal((await inspectScan([...dicomSeries(samples), stray])).series[0].files, nz);
});

test('loose files are named in errors', async () => {
  const texts = ['a.txt', 'b.txt'].map((path) => ({ path, data: Buffer.from('hello') }));
  assert.match((await rejection(readScan(texts))).message, /^'folder with these files': none of the folder's 2 files/);
});

test('several series are listed, and one is chosen by its number', async () => {
  const files = [
    ...dicomSeries(lumps('int16')),
    ...dicomSeries(lumps('int16'), geometry, { uid: 2, description: 'Sch\xe4del' })
      .map((file) => ({ ...file, path: file.path.replace('/', '/b') })),
  ];
  const report = await inspectScan(files);
  assert.deepEqual(report.series.map(({ description }) => description), ['lumps', 'Sch\u00e4del']);
  assert.equal(report.chosen, undefined);
  const error = await rejection(readScan(files));
  assert.equal(error.code, 4);
  assert.match(error.message, /2 series/);
  const scan = await readScan(files, { series: 2 });
  assert.equal(scan.description, 'Sch\u00e4del');
  scan.dispose();
});

test('a slice that is missing is refused with the reason', async () => {
  const files = dicomSeries(lumps('int16')).filter((_, k) => k !== 11);
  const error = await rejection(readScan(files));
  assert.equal(error.code, 4);
  assert.match(error.message, /uneven/);
  const { series, chosen, reason } = await inspectScan(files);
  assert.equal(chosen, undefined);
  assert.equal(series[0].refusal, reason);
});

test('errors have native\'s code and message', withNative, async (t) => {
  const path = folder(t);
  const whole = readFileSync(writeVolume(join(path, 'whole.mha'), 'int16', lumps('int16')));
  const inputs = {
    'truncated.mha': whole.subarray(0, whole.length / 2), 'empty.nii': Buffer.alloc(0), 'text.nrrd': Buffer.from('NRRD0004\nfoo'),
    'cut.dcm': dicomSeries(lumps('int16'))[0].data.subarray(0, 2000), 'unknown.txt': Buffer.from('hello'),
  };
  for (const [name, data] of Object.entries(inputs)) {
    const alone = join(path, `folder of ${name}`);  // the other files of a folder may belong to a series
    mkdirSync(alone);
    writeFileSync(join(alone, name), data);
    const expected = await runNative([name, '--isovalue', '1', '-o', 'a.stl'], alone);
    expected.message = expected.message.replaceAll('./', '');
    for (const input of [{ path: name, data }, join(alone, name)]) {
      const error = await rejection(readScan(input));
      assert.deepEqual({ code: error.code, message: error.message }, expected);
    }
  }
  const missing = await rejection(readScan(join(path, 'missing.nii')));
  assert.equal(missing.code, 3);
  assert.match(missing.message, /missing\.nii.*no such file/);
});

test('a surface without triangles cannot be written', async () => {
  const scan = await scanOf(lumps('int16'), geometry);
  const mesh = await (await Extractor.create(scan)).extract(30000);
  assert.equal(mesh.triangles.length, 0);
  assert.equal((await rejection(writeMesh(mesh, 'a.stl'))).code, 5);
  assert.equal((await rejection((await Extractor.create(scan)).extract(NaN))).code, 2);
  scan.dispose();
});

test('what does not fit is refused before memory is taken', async () => {
  const error = await rejection(scanOf(new Uint8Array(8), { dims: [100000, 100000, 100] }));
  assert.equal(error.code, 3);
  assert.match(error.message, /memory/);
  const few = await rejection(scanOf(new Uint8Array(8), { dims: [10, 10, 10] }));
  assert.equal(few.code, 2);
});

test('slices are the samples, and contours lie on the surface', async () => {
  const samples = lumps('int16'), [nx, ny, nz] = geometry.dims;
  const scan = await scanOf(samples, geometry);
  const at = (i, j, k) => samples[(k * ny + j) * nx + i];
  const across = [await scan.slice(0, 5), await scan.slice(1, 6), await scan.slice(2, 7)];
  assert.deepEqual(across.map(({ width, height }) => [width, height]), [[ny, nz], [nx, nz], [nx, ny]]);
  assert.equal(across[0].samples[3 * ny + 4], at(5, 4, 3));
  assert.equal(across[1].samples[3 * nx + 4], at(4, 6, 3));
  assert.equal(across[2].samples[3 * nx + 4], at(4, 3, 7));
  // Points of the surface in a slice are those of the contour.
  const mesh = await (await Extractor.create(scan, { closed: false })).extract(55.5);
  const z = Math.fround(geometry.origin[2] + 7 * geometry.spacing[2]), onSurface = [];
  for (let p = 0; p < mesh.points.length; p += 3) {
    if (Math.abs(mesh.points[p + 2] - z) < 1e-4)
      onSurface.push([(mesh.points[p] - geometry.origin[0]) / 0.7, (mesh.points[p + 1] - geometry.origin[1]) / 0.8]);
  }
  const lines = contour(across[2], 55.5), inContour = [];
  for (let i = 0; i < lines.length; i += 2) inContour.push([lines[i], lines[i + 1]]);
  const isNear = ([x, y], points) => points.some(([u, v]) => Math.hypot(u - x, v - y) < 1e-3);
  assert.ok(onSurface.length > 100);
  assert.ok(inContour.every((point) => isNear(point, onSurface)));
  assert.ok(onSurface.every((point) => isNear(point, inContour)));
  scan.dispose();
});

test('contours are the edges of the surface in a slice, with exact topology too', async (t) => {
  const scan = await scanOf(lumps('int16'), geometry), slice = await scan.slice(2, 7);
  t.after(() => scan.dispose());
  const z = Math.fround(geometry.origin[2] + 7 * geometry.spacing[2]), found = [];
  for (const topology of [false, true]) {
    const { points, triangles } = await (await Extractor.create(scan, { closed: false, topology })).extract(55.5);
    // No position is halfway between two hundredths then, and so none is rounded up here and down there.
    const name = (...position) => position.map((x) => (x + 0.00123).toFixed(2)).join(), piece = (a, b) => [a, b].sort().join(' ');
    const inSlice = (p) => Math.abs(points[3 * p + 2] - z) < 1e-4;
    const nameOf = (p) => name((points[3 * p] - geometry.origin[0]) / 0.7, (points[3 * p + 1] - geometry.origin[1]) / 0.8);
    const edges = new Set();
    for (let i = 0; i < triangles.length; ++i) {
      const a = triangles[i], b = triangles[i % 3 === 2 ? i - 2 : i + 1];
      if (inSlice(a) && inSlice(b)) edges.add(piece(nameOf(a), nameOf(b)));
    }
    const lines = contour(slice, 55.5, { topology }), pieces = new Set();
    for (let i = 0; i < lines.length; i += 4) pieces.add(piece(name(lines[i], lines[i + 1]), name(lines[i + 2], lines[i + 3])));
    assert.ok(pieces.size > 50);
    assert.deepEqual([...pieces].sort(), [...edges].sort());
    found.push([...pieces].sort());
  }
  assert.notDeepEqual(found[0], found[1]);
});
