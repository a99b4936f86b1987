#!/usr/bin/env node
// Compares the next isovalue of a slider in Chromium with vtk.js's vtkImageMarchingCubes (merged points and normals), and
// with the native library on one thread: the head CT of `make demo`, two isovalues in turn, medians.
// usage: node tests/compare.mjs VTKJS MARROW_BENCH     (VTKJS: a folder where `npm install @kitware/vtk.js` ran;
//        MARROW_BENCH: the program marrow-bench; `make web` first)
import { execFileSync } from 'node:child_process';
import { cpSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'vite';
import { serve } from '../serve.mjs';
import { launch } from './browser.mjs';

const [vtkjs, bench] = process.argv.slice(2);
if (!bench) {
  console.error('usage: node tests/compare.mjs VTKJS MARROW_BENCH');
  process.exit(2);
}
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const folder = mkdtempSync(join(tmpdir(), 'marrow-compare-'));
const [cranium] = JSON.parse(execFileSync(bench, ['--volumes', 'cranium', '--save', folder], { encoding: 'utf8' }));
cpSync(fileURLToPath(new URL('../../../build/web/marrow-wasm', import.meta.url)), join(folder, 'marrow-wasm'), { recursive: true });
writeFileSync(join(folder, 'index.html'), '<!doctype html>');
const { output: [{ code }] } = await build({
  configFile: false, root: vtkjs, logLevel: 'error',
  plugins: [{
    name: 'entry', resolveId: (id) => (id === 'entry' ? '\0entry' : undefined),
    load: (id) => (id !== '\0entry' ? undefined : ['Common/DataModel/ImageData', 'Common/Core/DataArray', 'Filters/General/ImageMarchingCubes']
      .map((path) => `export { default as ${path.split('/').pop()} } from '${vtkjs}/node_modules/@kitware/vtk.js/${path}.js';`).join('\n')),
  }],
  build: { write: false, minify: false, rollupOptions: { input: 'entry', preserveEntrySignatures: 'strict', output: { format: 'es', inlineDynamicImports: true } } },
});
writeFileSync(join(folder, 'vtk.js'), code);

// Runs in the page: milliseconds of each contender, in turn.
async function compare({ dims, isovalue, rounds }) {
  const { Extractor, scanOf, prepare, threads } = await import('/marrow-wasm/index.mjs');
  const { ImageData, DataArray, ImageMarchingCubes } = await import('/vtk.js');
  const samples = new Int16Array(await (await fetch('/cranium.raw')).arrayBuffer());
  await prepare();
  const extractor = await Extractor.create(await scanOf(samples, { dims }), { closed: false });
  const image = ImageData.newInstance({ extent: dims.flatMap((n) => [0, n - 1]) });
  image.getPointData().setScalars(DataArray.newInstance({ values: samples, numberOfComponents: 1 }));
  const times = { whole: [], worker: [], vtkjs: [] }, points = {};
  let mesh = await extractor.extract(isovalue);
  for (let round = 0; round < rounds; ++round) {
    for (const value of [isovalue * 1.04, isovalue]) {
      for (let i = 0; i < 5; ++i) {
        await extractor.extract(value === isovalue ? isovalue * 1.04 : isovalue).then((m) => extractor.recycle(m));
        extractor.recycle(mesh);
        const start = performance.now();
        mesh = await extractor.extract(value);
        times.whole.push(performance.now() - start);
        times.worker.push(mesh.stats.extractMs);
      }
      const cubes = ImageMarchingCubes.newInstance({ contourValue: value, computeNormals: true, mergePoints: true });
      cubes.setInputData(image);
      const start = performance.now();
      cubes.update();
      times.vtkjs.push(performance.now() - start);
      points.vtkjs = cubes.getOutputData().getPoints().getNumberOfPoints();
      points.marrow = mesh.points.length / 3;
    }
  }
  return { times, points, threads: threads() };
}

const native = () => JSON.parse(execFileSync(bench, ['--volumes', 'cranium', '--contenders', 'marrow-next', '--threads', '1', '--rounds', '15', '--json'], { encoding: 'utf8' }))
  .find((row) => row.contender === 'marrow-next' && row.memory === 'retained').ms;
const browser = await launch();
for (const isolated of [false, true]) {
  const server = await serve(folder, { isolated }), page = await browser.newPage();
  const before = native();
  await page.goto(server.url);
  const { times, points, threads } = await page.evaluate(compare, { dims: cranium.dims, isovalue: cranium.isovalue, rounds: 4 });
  const [whole, worker, theirs, here] = [median(times.whole), median(times.worker), median(times.vtkjs), (before + native()) / 2];
  console.log(`${threads} threads: ${worker.toFixed(1)} ms in the worker, ${whole.toFixed(1)} ms until the page has the mesh (${points.marrow} points); ` +
    `vtk.js ${theirs.toFixed(0)} ms (${points.vtkjs} points): ${(theirs / worker).toFixed(0)} and ${(theirs / whole).toFixed(0)} times; ` +
    `native on one thread ${here.toFixed(1)} ms: ${(worker / here).toFixed(2)} times`);
  await page.close();
  await server.close();
}
await browser.close();
rmSync(folder, { recursive: true });
