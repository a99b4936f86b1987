#!/usr/bin/env node
// Measures the page: its size, the time to the first surface, and how it keeps up with a drag.
// usage: node tests/measure.mjs SCAN...      (folders of DICOM files; `npm run build` first)
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { built } from '../serve.mjs';
import { launch, mainThreadTasks, openPage, served, settled, startTrace } from './browser.mjs';

const cleanUps = [];
const t = { after: (f) => cleanUps.unshift(f) };
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

function printSizes() {
  const all = readdirSync(built, { recursive: true, withFileTypes: true }).filter((f) => f.isFile());
  let sum = 0;
  for (const file of all) {
    const bytes = readFileSync(join(file.parentPath ?? file.path, file.name)), zipped = gzipSync(bytes, { level: 9 }).length;
    sum += zipped;
    console.log(`${String(bytes.length).padStart(9)} B, ${String(zipped).padStart(8)} B gzipped  ${file.name}`);
  }
  console.log(`${(sum / 1e6).toFixed(3)} MB gzipped in all`);
}

const longestText = (ms) => `${Math.round(Math.max(...ms))} ms, ${ms.filter((each) => each > 100).length} above 100 ms`;
const tasksText = ({ took, worked }) => `longest ${longestText(took)}, of which it worked: longest ${longestText(worked)}`;

async function measure(browser, url, scan) {
  const page = await openPage(t, browser, url, { viewport: { width: 1440, height: 900 } });
  const system = await browser.newBrowserCDPSession();
  const memory = async () => (await system.send('SystemInfo.getProcessInfo')).processInfo.filter((p) => p.type === 'renderer')
    .reduce((sum, p) => sum + Number(readFileSync(`/proc/${p.id}/statm`, 'utf8').split(' ')[1]) * 4096, 0);
  await startTrace(page);
  await page.setInputFiles('#folder-input', scan);
  await page.waitForFunction(() => performance.getEntriesByName('surface drawn').length > 0, null, { timeout: 60_000 });
  const first = await page.evaluate(() => performance.getEntriesByName('surface drawn')[0].startTime - performance.getEntriesByName('open')[0].startTime);
  await settled(page);
  const opening = await mainThreadTasks(page);
  await page.waitForTimeout(4000);

  const box = await page.locator('.histogram').boundingBox(), y = box.y + 50, surfaces = [];
  await page.evaluate(() => {
    window.drawn = [];
    new PerformanceObserver((list) => window.drawn.push(...list.getEntries().filter((e) => e.name === 'surface drawn').map((e) => e.startTime))).observe({ type: 'mark' });
  });
  await startTrace(page);
  await page.mouse.move(box.x + box.width * 0.35, y);
  await page.mouse.down();
  const start = performance.now();
  for (let i = 0; i <= 100; ++i) {
    await page.mouse.move(box.x + box.width * (0.35 + 0.002 * i), y);
    await page.waitForTimeout(30);
  }
  const seconds = (performance.now() - start) / 1000;
  await page.mouse.up();
  await settled(page);
  const dragging = await mainThreadTasks(page), drawn = await page.evaluate(() => window.drawn);
  for (let i = 1; i < drawn.length; ++i) surfaces.push(drawn[i] - drawn[i - 1]);
  const extraction = await page.locator('#measures dd').last().textContent();
  console.log(`${scan}, ${await page.getAttribute('body', 'data-threads')} threads: first surface ${first.toFixed(0)} ms after opening; tasks of the main thread while opening: ${tasksText(opening)}; ` +
    `drag of ${seconds.toFixed(1)} s: ${drawn.length} surfaces drawn, ${median(surfaces)?.toFixed(0)} ms apart (median), tasks of the main thread: ${tasksText(dragging)}; ` +
    `full extraction ${extraction}; ${((await memory()) / 1e6).toFixed(0)} MB in the page's process`);
  await page.context().close();
}

printSizes();
const browser = await launch();
for (const isolated of [true, false]) {
  const url = await served(t, { isolated });
  for (const scan of process.argv.slice(2)) await measure(browser, url, scan);
}
for (const cleanUp of cleanUps) await cleanUp();
await browser.close();
