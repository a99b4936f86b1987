// Surfaces have the bytes of the native program's.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';

import { bytesOf, folder, geometry, lumps, marrow, runNative, sampleTypes, withNative, writeVolume } from './support.mjs';

const { Extractor, commandLine, labels, readLabelTable, readScan, scanOf, writeMesh } = marrow;

const kinds = {
  closed: {}, open: { closed: false }, snapped: { snap: 0.3 }, exact: { topology: true },
  cropped: { crop: { first: [3, 2, 5], last: [30, 25, 19] } },
};

for (const type of Object.keys(sampleTypes)) {
  test(`surfaces of ${type} are native's`, withNative, async (t) => {
    const path = folder(t);
    const samples = lumps(type);
    const input = writeVolume(join(path, 'scan.mha'), type, samples);
    const [read, given] = [await readScan(input), await scanOf(samples, geometry)];
    t.after(() => [read, given].forEach((scan) => scan.dispose()));
    assert.equal(read.sampleType, type);
    for (const [kind, options] of Object.entries(kinds)) {
      const recipe = { scan: read, surfaces: [55.5], extractor: options, output: `${kind}.ply` };
      const words = commandLine(recipe).split(' ');
      assert.equal(words.shift(), 'marrow');
      assert.deepEqual(await runNative(['--no-alarm', ...words], path), { code: 0, message: '' });
      for (const scan of [read, given]) {
        const extractor = await Extractor.create(scan, options);
        const mesh = await extractor.extract(55.5);
        assert.ok(mesh.triangles.length > 1000);
        const bytes = await bytesOf(await writeMesh(mesh, `${kind}.ply`));
        assert.ok(bytes.equals(readFileSync(join(path, `${kind}.ply`))), `${kind} differs`);
        extractor.dispose();
      }
    }
  });
}

for (const output of ['a.stl', 'a.ply', 'a.obj', 'a.vtp', 'a.3mf', 'a.glb', 'a.stl.gz']) {
  test(`${output} is native's`, withNative, async (t) => {
    const path = folder(t);
    const scan = await readScan(writeVolume(join(path, 'scan.mha'), 'int16', lumps('int16')));
    t.after(() => scan.dispose());
    const space = output === 'a.glb' ? 'LPS' : 'RAS';
    const words = commandLine({ scan, surfaces: [60.25], output, space }).split(' ').slice(1);
    assert.deepEqual(await runNative(words, path), { code: 0, message: '' });
    const mesh = await (await Extractor.create(scan)).extract(60.25);
    assert.ok((await bytesOf(await writeMesh(mesh, output, { space }))).equals(readFileSync(join(path, output))));
  });
}

test('steps after extraction are native\'s', withNative, async (t) => {
  const path = folder(t);
  const scan = await readScan(writeVolume(join(path, 'scan.mha'), 'float32', lumps('float32')));
  t.after(() => scan.dispose());
  const recipe = {
    scan, surfaces: [62], components: { largest: true }, smooth: { iterations: 15, bound: scan }, simplify: { keep: 0.4 },
    output: 'steps.ply',
  };
  const result = await runNative(['-q', ...commandLine(recipe).split(' ').slice(1)], path);
  assert.deepEqual(result, { code: 0, message: '' });
  let mesh = await (await Extractor.create(scan)).extract(62);
  ({ mesh } = await marrow.keepComponents(mesh, recipe.components));
  ({ mesh } = await marrow.smooth(mesh, recipe.smooth));
  ({ mesh } = await marrow.simplify(mesh, recipe.simplify));
  assert.equal((await marrow.measure(mesh)).components, 1);
  const checked = await marrow.check(mesh);
  assert.equal(checked.closed, true);
  assert.ok((await bytesOf(await writeMesh(mesh, 'steps.ply'))).equals(readFileSync(join(path, 'steps.ply'))));
});

test('surfaces of labels are native\'s', withNative, async (t) => {
  const path = folder(t);
  const samples = lumps('uint8').map((v) => (v < 40 ? 0 : v < 60 ? 1 : v < 75 ? 2 : 7));
  for (let i = 0; i < samples.length; i += 37) samples.fill(samples[i], i, i + 12);
  const scan = await readScan(writeVolume(join(path, 'map.mha'), 'uint8', samples));
  t.after(() => scan.dispose());
  assert.equal(scan.unit, 'labels');
  assert.deepEqual(scan.labels.map(({ label }) => label), [1, 2, 7]);
  const words = commandLine({ scan, labels: {}, output: 'map.3mf' }).split(' ').slice(1);
  assert.deepEqual(await runNative(['-q', ...words], path), { code: 0, message: '' });
  const surfaces = await labels(scan);
  assert.deepEqual(surfaces.map(({ name }) => name), ['label-1', 'label-2', 'label-7']);
  assert.ok(surfaces.every(({ heldBack }) => Number.isInteger(heldBack) && heldBack >= 0));
  assert.deepEqual((await labels(scan, { relax: 0 })).map(({ heldBack }) => heldBack), [0, 0, 0]);
  assert.ok((await bytesOf(await writeMesh(surfaces, 'map.3mf'))).equals(readFileSync(join(path, 'map.3mf'))));

  const data = Buffer.from('# names\n1 liver 255 0 10\n2 "left kidney"\n9 none\n');
  writeFileSync(join(path, 'my names.txt'), data);
  const table = await readLabelTable(scan, { path: 'my names.txt', data });
  const command = commandLine({ scan, labels: { table }, output: 'named.glb' });
  assert.match(command, /--labels 'my names\.txt' -o/);
  assert.deepEqual(await runNative(['-q', 'map.mha', '--labels', 'my names.txt', '-o', 'named.glb'], path), { code: 0, message: '' });
  const named = await labels(scan, { table });
  assert.deepEqual(named.map(({ name }) => name), ['liver', 'left kidney', 'label-7']);
  assert.ok((await bytesOf(await writeMesh(named, 'named.glb'))).equals(readFileSync(join(path, 'named.glb'))));
  await assert.rejects(readLabelTable(scan, { path: 'a.txt', data: Buffer.from('8 spleen\n') }), { code: 2 });
  await assert.rejects(readLabelTable(scan, { path: 'a.txt', data: Buffer.from('spleen\n') }), { code: 3, message: /'a\.txt', line 1/ });
});
