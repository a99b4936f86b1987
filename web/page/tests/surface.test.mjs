// The page in a real browser: the surface of a scan, and its isovalue, compared with the command line.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { describe, test } from 'node:test';
import { assertSameBytes, mainThreadTasks, marrow, measuresOf, numberOf, openBytes, openFolder, openPage, served, setIsovalue, settled, setUp, startTrace, text } from './browser.mjs';
import { cubeNrrd, niftiBall } from './scans.mjs';

const { browser, shared, head } = await setUp();

describe('a DICOM folder', () => {
  test('has the numbers of the command line', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const json = JSON.parse(execFileSync(marrow, ['head', '-o', 'numbers.stl', '--type', 'bone', '--json', '-q'], { cwd: shared, encoding: 'utf8' }));
    const measures = await measuresOf(page);
    assert.equal(measures.Volume, `${(json.volume_mm3 / 1000).toFixed(1)} mL`);
    assert.equal(measures.Area, `${(json.area_mm2 / 100).toFixed(1)} cm²`);
    assert.equal(measures.Triangles.replace(/\D/g, ''), String(json.triangles));
    assert.equal(measures.Components, String(json.components));
    assert.equal(await text(page, '#light'), 'watertight');
    assert.match(await text(page, '#status'), /head.*DICOM.*144 × 196 × 170.*1\.2 × 1\.2 × 1\.2 mm.*int16.*CT/);
  });

  test('is exported with the bytes of the command line that is shown', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    for (const format of ['stl', '3mf', 'glb', 'ply']) await assertSameBytes(page, shared, format);
    await assertSameBytes(page, shared, 'stl', { space: 'RAS' });

    await page.getByLabel('Largest component only').check();
    await settled(page);
    assert.equal((await measuresOf(page)).Components, '1');
    assert.match(await assertSameBytes(page, shared, '3mf'), /--largest/);

    await page.getByLabel('Open at the border of the scan').check();
    await settled(page);
    assert.equal(await text(page, '#light'), 'open at the border');
    assert.match(await assertSameBytes(page, shared, 'ply'), /--open/);
    await page.getByLabel('Open at the border of the scan').uncheck();

    await page.getByLabel('Exact topology').check();
    await settled(page);
    assert.match(await assertSameBytes(page, shared, 'ply'), /--topology/);
    await page.getByLabel('Exact topology').uncheck();

    await page.getByLabel('Last sample along z').fill('90');
    await page.press('[aria-label="Last sample along z"]', 'Enter');
    await settled(page);
    assert.match(await assertSameBytes(page, shared, 'stl'), /--crop vox:0,143,0,195,0,90/);

    await page.fill('#field-smooth', '10');
    await page.press('#field-smooth', 'Enter');
    await page.fill('#field-keep', '40');
    await page.press('#field-keep', 'Enter');
    await settled(page);
    assert.equal(await text(page, '#light'), 'watertight');
    assert.match(await assertSameBytes(page, shared, 'glb'), /--smooth 10 --keep 0\.4/);
  });

  test('gives the same bytes with one thread, where the server does not isolate the page', async (t) => {
    const page = await openPage(t, browser, await served(t, { isolated: false }));
    assert.equal(await page.getAttribute('body', 'data-threads'), '1');
    assert.equal(await page.evaluate(() => crossOriginIsolated), false);
    await openFolder(page, head);
    await setIsovalue(page, 400.5);
    await assertSameBytes(page, shared, 'stl');
  });

  test('uses the threads that there are, where the server isolates the page', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const threads = await page.evaluate(() => Math.min(navigator.hardwareConcurrency, 8));
    assert.equal(await page.getAttribute('body', 'data-threads'), String(threads));
  });
});

test('the export dialog is about the number that is typed, saves by Enter, and ends by Cancel or a click beside it', async (t) => {
  const page = await openPage(t, browser, await served(t)), saved = [];
  page.on('download', (download) => saved.push(download.suggestedFilename()));
  const dialogs = () => page.locator('dialog').count();
  const dialogIsGone = () => page.locator('dialog').waitFor({ state: 'detached' }); // the browser tells that it closed a moment later
  await openBytes(t, page, 'ball.nii', niftiBall());
  await settled(page);
  await page.fill('#isovalue-number', '100');
  await page.keyboard.press('Control+s');
  assert.equal(await dialogs(), 0);
  assert.match(await text(page, '.banner.note p'), /still being made/);
  await settled(page);
  await page.keyboard.press('Control+s');
  assert.match(await text(page, 'dialog code'), /--isovalue 100 /);
  await page.getByRole('button', { name: 'Cancel' }).click();
  await dialogIsGone();

  await page.click('#export');
  const { x, y, height } = await page.locator('#export-name').boundingBox();
  await page.mouse.move(x + 60, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(20, y + height / 2, { steps: 5 }); // a selection that ends beside the dialog
  await page.mouse.up();
  assert.equal(await dialogs(), 1);
  await page.mouse.click(20, y);
  await dialogIsGone();

  await page.click('#export');
  await page.fill('#export-name', 'skull');
  await Promise.all([page.waitForEvent('download'), page.press('#export-name', 'Enter')]);
  await dialogIsGone();
  assert.deepEqual(saved, ['skull.stl']);
});

describe('the isovalue', () => {
  test('follows a drag on the histogram, whose last surface is that of the command line', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const box = await page.locator('.histogram').boundingBox(), y = box.y + box.height / 2;
    await startTrace(page);
    await page.mouse.move(box.x + box.width * 0.4, y);
    await page.mouse.down();
    for (let i = 0; i <= 20; ++i) await page.mouse.move(box.x + box.width * (0.4 + 0.01 * i), y);
    await page.mouse.up();
    await settled(page);
    const { worked } = await mainThreadTasks(page);
    assert.ok(worked.length > 100 && Math.max(...worked) < 100, `${worked.length} tasks, the longest worked ${Math.max(...worked)} ms`);
    const value = await numberOf(page);
    assert.ok(value > 600 && value % 1 !== 0, `${value} lies between two whole numbers`);
    assert.match(await assertSameBytes(page, shared, 'stl'), new RegExp(`--isovalue ${value}\\b`));
  });

  test('follows presets, keys and the number', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await page.click('[data-preset="skin"]');
    await settled(page);
    assert.equal(await numberOf(page), -300.5);
    assert.equal(await page.getAttribute('[data-preset="skin"]', 'aria-pressed'), 'true');
    await page.focus('.histogram');
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('PageUp');
    assert.equal(await numberOf(page), -289.5);
    assert.equal(await page.getAttribute('.histogram', 'aria-valuetext'), '-289.5 HU');
    await setIsovalue(page, 1e6);
    assert.equal(await text(page, '#light'), 'no surface');
  });

  test('in the field is that of a scan that opens while one is typed', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await setIsovalue(page, 400.5);
    await page.focus('#isovalue-number');
    await page.keyboard.type('77');
    await openBytes(t, page, 'cube.nrrd', cubeNrrd('short', Int16Array, 0, 100));
    await page.waitForFunction(() => document.title.startsWith('cube.nrrd'));
    const opened = await numberOf(page);
    assert.notEqual(opened, 400.5);
    await page.locator('#isovalue-number').blur();
    await settled(page);
    assert.equal(await numberOf(page), opened);
    assert.equal(await page.getAttribute('.histogram', 'aria-valuenow'), String(opened));
  });

  test('that is typed is left by Escape, as every number', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await setIsovalue(page, 400.5);
    const fields = page.locator('input[type="number"]');
    const values = () => fields.evaluateAll((inputs) => inputs.map((input) => input.value));
    const before = await values(), line = await text(page, '#isovalue code');
    assert.equal(before.length, 12); // isovalue, smoothing (2), triangles, crop box (6), window (2)
    for (const field of await fields.all()) {
      if (!(await field.isVisible())) continue;
      await field.fill('3');
      await field.press('Escape');
      assert.ok(!(await field.evaluate((input) => input === document.activeElement)));
    }
    assert.deepEqual(await values(), before);
    assert.equal(await text(page, '#isovalue code'), line);
    assert.equal(await page.getAttribute('.histogram', 'aria-valuenow'), '400.5');
  });

  test('whose extraction fails has no surface to export', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        const { name, parameters } = message;
        if (name === 'extract' && parameters.isovalue === 300.5) parameters.extractor = 1e6;
        postMessage.call(this, message, ...more);
      };
    });
    await openFolder(page, head);
    await setIsovalue(page, 300.5);
    assert.equal(await text(page, '#light'), 'failed');
    assert.match((await measuresOf(page)).Volume, /^≈/);
    await page.click('#export');
    assert.match(await page.locator('.banner.note').textContent(), /no surface of these settings/);
    await setIsovalue(page, 400.5);
    await assertSameBytes(page, shared, 'stl');
  });

  test('whose extractions fail for the same reason has one message', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name === 'extract') window.worker = this;
        postMessage.call(this, message, ...more);
      };
    });
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    await page.evaluate(() => window.worker.dispatchEvent(new ErrorEvent('error', { message: 'it ran out of memory' })));
    for (const value of [100.5, 200.5, 300.5]) {
      await setIsovalue(page, value);
      assert.equal(await text(page, '#light'), 'failed');
      assert.deepEqual(await page.locator('.banner.error p').allTextContents(), ['the worker stopped: it ran out of memory; open the scan again']);
    }
    await openBytes(t, page, 'ball.nii', niftiBall());
    await page.waitForFunction(() => !document.querySelector('.banner.error'));
    // The surface of the default isovalue may follow one of an isovalue before.
    await page.waitForFunction(() => document.querySelector('#light').textContent === 'watertight');
  });

  test('has the measures of the surface before with ≈ until the new one is measured', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const before = await measuresOf(page);
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name !== 'measure') return postMessage.call(this, message, ...more);
        window.goOn = () => postMessage.call(this, message, ...more);
      };
    });
    await page.fill('#isovalue-number', '400.5');
    await page.press('#isovalue-number', 'Enter');
    await page.waitForFunction(() => window.goOn);
    const during = await measuresOf(page);
    assert.match(during.Triangles, /^\d/); // of the surface that is shown
    for (const name of ['Volume', 'Area', 'Size, mm', 'Components']) assert.equal(during[name], `≈ ${before[name]}`);
    await page.evaluate(() => window.goOn());
    await settled(page);
    const after = await measuresOf(page);
    assert.equal(after.Triangles, during.Triangles);
    assert.match(after.Volume, /^\d/);
    assert.notEqual(after.Volume, before.Volume);
  });

  test('can change a hundred times without memory growing', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const system = await browser.newBrowserCDPSession(), here = await page.context().newCDPSession(page);
    const change = async (times) => {
      for (let i = 0; i < times; ++i) await setIsovalue(page, i % 2 ? 225.5 : 300.5);
      await here.send('HeapProfiler.collectGarbage');
    };
    const pages = async () => (await system.send('SystemInfo.getProcessInfo')).processInfo.filter((p) => p.type === 'renderer')
      .reduce((sum, p) => sum + Number(readFileSync(`/proc/${p.id}/statm`, 'utf8').split(' ')[1]), 0);
    await change(20);
    const earlier = await pages();
    await change(100);
    const grown = ((await pages()) - earlier) * 4096;
    t.diagnostic(`the page holds ${((earlier * 4096) / 1e6).toFixed(0)} MB, and ${(grown / 1e6).toFixed(0)} MB more after 100 changes`);
    // One surface has 14 MB; if each stayed, there would be more than a gigabyte.
    assert.ok(grown < 100e6, `${grown} bytes more`);
  });
});
