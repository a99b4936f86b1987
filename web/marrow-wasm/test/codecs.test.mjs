// Compressed scans, which need the module with codecs.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';

import { bytesOf, dicomSeries, folder, geometry, lumps, marrow, runNative, withNative } from './support.mjs';

const { Extractor, inspectScan, readScan, writeMesh } = marrow;
const [columns, rows] = geometry.dims;

/** The reason to skip a test that needs a program. */
function lacks(program, args) {
  try {
    execFileSync(program, args, { stdio: 'ignore' });
    return false;
  } catch {
    return `${program} ${args.join(' ')} fails`;
  }
}
const withDcmtk = { skip: withNative.skip || lacks('dcmcjpeg', ['--version']) };
const withPillow = { skip: withNative.skip || lacks('/usr/bin/python3', ['-c', 'import PIL']) };

/** Compares surfaces of the scan in `path`/`input` with native's, byte for byte. Each sample is near one of them. */
async function assertNative(path, input, options = {}) {
  const spacing = options.spacing ? ['--spacing', options.spacing.join(',')] : [];
  const report = await inspectScan(join(path, input), options);
  assert.equal(report.chosen, 0, report.reason);
  const scan = await readScan(join(path, input), options);
  const extractor = await Extractor.create(scan);
  for (let isovalue = 5.5; isovalue < 100; isovalue += 10) {
    const words = ['-q', '--no-alarm', input, '--isovalue', String(isovalue), ...spacing, '-o', 'native.ply'];
    assert.deepEqual(await runNative(words, path), { code: 0, message: '' });
    const bytes = await bytesOf(await writeMesh(await extractor.extract(isovalue), 'a.ply'));
    assert.ok(bytes.length > 10_000, `${bytes.length} bytes at ${isovalue}`);
    assert.ok(bytes.equals(readFileSync(join(path, 'native.ply'))), `${input} differs at ${isovalue}`);
  }
  scan.dispose();
}

function writeSeries(path, files) {
  mkdirSync(join(path, 'series'), { recursive: true });
  for (const file of files) writeFileSync(join(path, file.path), file.data);
}

const programs = [
  ['lossless JPEG', 16, 'dcmcjpeg', '+e1'], ['JPEG with 8 bits', 8, 'dcmcjpeg', '+eb'], ['JPEG with 12 bits', 12, 'dcmcjpeg', '+ee'],
  ['progressive JPEG', 8, 'dcmcjpeg', '+ep'], ['JPEG-LS', 16, 'dcmcjpls', '+el'], ['near-lossless JPEG-LS', 12, 'dcmcjpls', '+en', '+md', '2'],
];
for (const [name, bits, program, ...args] of programs) {
  test(`DICOM as ${name} has native's surface`, withDcmtk, async (t) => {
    const path = folder(t);
    writeSeries(path, dicomSeries(lumps('int16'), geometry, { bits }));
    for (const file of readdirSync(join(path, 'series'))) execFileSync(program, [...args, file, file], { cwd: join(path, 'series') });
    await assertNative(path, 'series');
  });
}

async function images(t) {
  const path = folder(t);
  execFileSync('/usr/bin/python3', [fileURLToPath(new URL('images.py', import.meta.url)), path, columns, rows], { input: lumps('uint8') });
  return path;
}

test('DICOM as JPEG 2000 has native\'s surface', withPillow, async (t) => {
  const path = await images(t);
  const streams = readdirSync(path).filter((name) => name.endsWith('.j2k')).sort().map((name) => readFileSync(join(path, name)));
  writeSeries(path, dicomSeries(lumps('int16'), geometry, { bits: 8, syntax: '1.2.840.10008.1.2.4.90', streams }));
  await assertNative(path, 'series');
});

for (const ending of ['png', 'jpg', 'tif']) {
  test(`slices as .${ending} have native's surface`, withPillow, async (t) => {
    const path = await images(t), slices = join(path, 'slices');
    mkdirSync(slices);
    for (const name of readdirSync(path)) if (name.endsWith(ending)) writeFileSync(join(slices, name), readFileSync(join(path, name)));
    await assertNative(path, 'slices', { spacing: geometry.spacing });
  });
}

test('TIFF with a compression that browsers are not given is refused by its name', withPillow, async (t) => {
  const path = await images(t);
  for (const name of ['LZMA', 'ZSTD', 'WEBP']) {
    await assert.rejects(readScan(join(path, `${name.toLowerCase()}.tiff`), { spacing: geometry.spacing }), ({ code, message }) => {
      assert.equal(code, 3);
      assert.match(message, new RegExp(`${name.toLowerCase()}\\.tiff.* is compressed by ${name}, which is not supported`));
      return true;
    });
  }
});

test('damaged streams are refused with native\'s reason', withDcmtk, async (t) => {
  for (const [program, option] of [['dcmcjpeg', '+e1'], ['dcmcjpls', '+el']]) {
    const path = folder(t);
    writeSeries(path, dicomSeries(lumps('int16')).slice(0, 2));
    for (const file of readdirSync(join(path, 'series'))) execFileSync(program, [option, file, file], { cwd: join(path, 'series') });
    const damaged = readFileSync(join(path, 'series/000.dcm'));
    damaged.fill(0xff, damaged.length - 300, damaged.length - 20);
    writeFileSync(join(path, 'series/000.dcm'), damaged);
    const native = await runNative(['series', '--isovalue', '1', '-o', 'a.stl'], path);
    await assert.rejects(readScan(join(path, 'series')), ({ code, message }) => {
      assert.equal(code, native.code);
      assert.match(message, /000\.dcm.*pixels are damaged or truncated/);
      // What was opened is the folder, and CharLS's own words in brackets are not DCMTK's.
      assert.equal(message, native.message.replace('series/', '').replace(/ \(.*\)$/, ''));
      return true;
    });
  }
});
