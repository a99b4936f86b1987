// The extractor as a slider uses it.
import assert from 'node:assert/strict';
import test from 'node:test';

import { geometry, lumps, marrow } from './support.mjs';

const { Extractor, scanOf } = marrow;
const large = { ...geometry, dims: [120, 110, 100] };

async function outcome(promise) {
  try {
    return (await promise).stats.isovalue;
  } catch (error) {
    return error.code;
  }
}

test('the newest request wins', async (t) => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  t.after(() => scan.dispose());
  const extractor = await Extractor.create(scan);
  const outcomes = await Promise.all([50, 51, 52, 53, 54].map((isovalue) => outcome(extractor.extract(isovalue))));
  assert.equal(outcomes[4], 54);
  assert.deepEqual(outcomes.slice(1, 4), [130, 130, 130]);
});

test('previews come before the full resolution', async (t) => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  t.after(() => scan.dispose());
  const extractor = await Extractor.create(scan);
  await extractor.extract(50, { level: 1 });
  const order = [];
  const running = outcome(extractor.extract(49));  // so that the others wait
  const [, full, preview] = await Promise.all([
    running,
    extractor.extract(51).finally(() => order.push('full')),
    extractor.extract(51, { level: 1 }).finally(() => order.push('preview')),
  ]);
  assert.deepEqual(order, ['preview', 'full']);
  assert.ok(preview.triangles.length < full.triangles.length);
  assert.deepEqual(extractor.dims(1), [60, 55, 50]);
});

test('an extraction that a signal cancels rejects at once, and the extractor goes on', async (t) => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  t.after(() => scan.dispose());
  const extractor = await Extractor.create(scan), controller = new AbortController();
  const running = outcome(extractor.extract(50)), cancelled = outcome(extractor.extract(51, { level: 1, signal: controller.signal }));
  controller.abort();
  assert.equal(await cancelled, 130);
  assert.equal(await running, 50);
  assert.equal(await outcome(extractor.extract(52, { signal: controller.signal })), 130);
  assert.equal(await outcome(extractor.extract(53)), 53);
});

test('a signal stops an extraction that runs, and the next one is right', async (t) => {
  let stopped = 0;
  const listen = (worker) => worker.on('message', ({ error }) => { stopped += error?.code === 130; });
  process.on('worker', listen);
  t.after(() => process.off('worker', listen));
  const dims = [160, 160, 160], noise = Uint8Array.from({ length: 160 ** 3 }, (_, i) => Math.imul(i ^ (i >>> 7), 0x9e3779b1) >>> 24);
  const scan = await scanOf(noise, { dims });
  t.after(() => scan.dispose());
  const extractor = await Extractor.create(scan);
  // The worker answers only what it began: a request that waits is forgotten. Others may be done before the signal.
  for (let attempt = 0; stopped === 0; ++attempt) {
    assert.ok(attempt < 100, 'no extraction was stopped');
    const controller = new AbortController(), running = outcome(extractor.extract(100 + attempt, { signal: controller.signal }));
    await new Promise((resolve) => setTimeout(resolve, 5 * (attempt % 20)));
    controller.abort();
    await running;
    extractor.recycle(await extractor.extract(250));
  }
  const after = await extractor.extract(253), fresh = await (await Extractor.create(scan)).extract(253);
  assert.ok(after.triangles.length > 1000);
  for (const name of ['points', 'normals', 'triangles']) assert.deepEqual(after[name], fresh[name]);
});

test('a signal stops the surfaces of labels, and the next ones are right', async (t) => {
  let stopped = 0;
  const listen = (worker) => worker.on('message', ({ error }) => { stopped += error?.code === 130; });
  process.on('worker', listen);
  t.after(() => process.off('worker', listen));
  const dims = [64, 64, 64], blocks = Uint8Array.from({ length: 64 ** 3 }, (_, i) => 1 + (i % 64 >> 4) + 4 * (i >> 10 & 3) + 16 * (i >> 16));
  const [scan, other] = [await scanOf(blocks, { dims }), await scanOf(blocks, { dims })], controller = new AbortController();
  t.after(() => [scan, other].forEach((one) => one.dispose()));
  await assert.rejects(marrow.labels(scan, { signal: controller.signal, onProgress: () => controller.abort() }), { code: 130 });
  await scan.slice(2, 0);  // comes after the worker's answer
  assert.equal(stopped, 1);
  const options = { relax: 2, crop: { first: [0, 0, 0], last: [19, 19, 19] } };
  const after = await marrow.labels(scan, options);
  assert.equal(after.length, 8);
  assert.deepEqual(after, await marrow.labels(other, options));
});

test('memory does not grow over 100 extractions', async (t) => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  t.after(() => scan.dispose());
  const extractor = await Extractor.create(scan);
  const extract = async (count) => {
    for (let i = 0; i < count; ++i) extractor.recycle(await extractor.extract(45 + (i % 20)));
    return process.memoryUsage().rss;
  };
  const mesh = await extractor.extract(45);
  const size = mesh.points.byteLength + mesh.normals.byteLength + mesh.triangles.byteLength;
  const before = await extract(40), after = await extract(100);
  assert.ok(size > 4e6);
  assert.ok(after - before < 20 * size, `${(after - before) >> 20} MiB more; a mesh has ${size >> 20}`);
});

test('a disposed scan rejects what waits', async () => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  const extractor = await Extractor.create(scan);
  const waiting = outcome(extractor.extract(50));
  scan.dispose();
  assert.equal(await waiting, 130);
  assert.equal(await outcome(extractor.extract(50)), 130);
});

test('long work can be cancelled', async () => {
  const scan = await scanOf(lumps('int16', large.dims), large);
  const mesh = await (await Extractor.create(scan)).extract(50);
  const controller = new AbortController();
  let progress = 0;
  const work = marrow.simplify(mesh, {
    keep: 0.1, signal: controller.signal,
    onProgress: (fraction) => {
      progress = fraction;
      controller.abort();
    },
  });
  await assert.rejects(work, { code: 130 });
  assert.ok(progress < 1);
  assert.ok((await marrow.measure(mesh)).triangles > 0);  // the package goes on
  scan.dispose();
});
