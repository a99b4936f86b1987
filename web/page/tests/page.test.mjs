// The page in a real browser: what a user does with it, compared with the command line.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, rmSync, utimesSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { createServer, request } from 'node:http';
import { createRequire } from 'node:module';
import { built, serve } from '../serve.mjs';
import { assertSameBytes, errorText, launch, mainThreadTasks, marrow, openFiles, openFolder, openPage, served, settled, startTrace, temporaryFolder } from './browser.mjs';
import { cubeNrrd, labelNrrd, niftiBall, niftiBallGz, niftiVolumes, nrrd, writeHead } from './scans.mjs';

let browser, shared, head;
before(async () => {
  browser = await launch();
  shared = temporaryFolder({ after: (remove) => { cleanUp = remove; } });
  head = await writeHead(shared);
});
let cleanUp = () => {};
after(async () => {
  await browser?.close();
  cleanUp();
});

/** The reason to skip a test that compresses DICOM. */
const lacksDcmtk = () => (spawnSync('dcmcjpeg', ['--version']).status === 0 ? false : "dcmcjpeg is missing: install Debian's package dcmtk");
const text = (page, selector) => page.locator(selector).textContent();
const numberOf = (page) => page.inputValue('#isovalue-number').then(Number);

async function measuresOf(page) {
  const names = await page.locator('#measures dt').allTextContents(), values = await page.locator('#measures dd').allTextContents();
  return Object.fromEntries(names.map((name, i) => [name, values[i]]));
}

/** How many pixels of a view have the colour of outlines, once there are any. */
async function outlinePixels(page, view) {
  const count = (name) => {
    const canvas = document.querySelector(`[data-view="${name}"] canvas`);
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let pixels = 0;
    for (let i = 0; i < data.length; i += 4) pixels += Math.abs(data[i] - 255) < 8 && Math.abs(data[i + 1] - 176) < 8 && Math.abs(data[i + 2] - 46) < 8;
    return pixels;
  };
  return (await page.waitForFunction(count, view, { timeout: 30_000 })).jsonValue();
}

async function setIsovalue(page, value) {
  await page.fill('#isovalue-number', String(value));
  await page.press('#isovalue-number', 'Enter');
  await settled(page);
}

/** Opens one file of a scan that the test made. */
async function openBytes(t, page, name, bytes) {
  const folder = temporaryFolder(t);
  writeFileSync(join(folder, name), bytes);
  await openFiles(page, [join(folder, name)]);
  return folder;
}

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
    await settled(page);
    assert.equal(await text(page, '#light'), 'watertight');
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

describe('other input', () => {
  for (const [outside, inside] of [[0.9999999999999998, 1], [1000, 1000.0000000000005]]) {
    test(`a histogram of samples from ${outside} to ${inside}`, async (t) => {
      const page = await openPage(t, browser, await served(t));
      await openBytes(t, page, 'cube.nrrd', cubeNrrd('double', Float64Array, outside, inside));
      await settled(page);
      const box = await page.locator('.histogram').boundingBox();
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await page.mouse.wheel(0, -2000);
      await page.waitForFunction(() => true, null, { polling: 'raf', timeout: 30_000 }); // it was drawn
    });
  }

  test('an oblique NIfTI, plain or compressed', async (t) => {
    const page = await openPage(t, browser, await served(t));
    for (const [name, bytes] of [['ball.nii', niftiBall()], ['ball.nii.gz', niftiBallGz()]]) {
      const folder = await openBytes(t, page, name, bytes);
      await page.waitForFunction((n) => document.title.startsWith(n), name);
      await settled(page);
      await page.click('[data-preset="otsu"]');
      await settled(page);
      await assertSameBytes(page, folder, 'ply');
    }
  });

  test('a scan of half a millimetre has a size and a volume', async (t) => {
    const page = await openPage(t, browser, await served(t)), small = niftiBall();
    for (const at of [80, 84, 88, ...Array.from({ length: 12 }, (_, i) => 280 + 4 * i)]) small.writeFloatLE(small.readFloatLE(at) / 100, at);
    await openBytes(t, page, 'small.nii', small);
    await settled(page);
    const measures = await measuresOf(page);
    assert.match(measures['Size, mm'], /^0\.\d\d × 0\.\d\d × 0\.\d\d$/);
    assert.match(measures.Volume, /^0\.0+[1-9]\d mL$/);
  });

  test('a zip of a folder, and a file that is dropped', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = temporaryFolder(t);
    execFileSync('python3', ['-m', 'zipfile', '-c', join(folder, 'head.zip'), 'head'], { cwd: shared });
    await openFiles(page, [join(folder, 'head.zip')]);
    await settled(page);
    assert.match(await text(page, '#status'), /DICOM.*144 × 196 × 170/);

    await page.evaluate((bytes) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0))], 'dropped.nii'));
      dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }, niftiBall().toString('base64'));
    await page.waitForFunction(() => document.title.startsWith('dropped.nii'));
    await settled(page);
  });

  test('a truncated file is refused with the reason of the command line, and the scan before stays open', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const folder = await openBytes(t, page, 'cut.nii', niftiBall().subarray(0, 90_000));
    const shown = await errorText(page);
    const printed = spawnSync(marrow, ['cut.nii', '-o', 'cut.stl', '-q'], { cwd: folder, encoding: 'utf8' }).stderr;
    assert.ok(printed.includes(shown.replace(/^.*?cut\.nii/, 'cut.nii').trim()), `page: ${shown}\ncommand line: ${printed}`);
    assert.match(await text(page, '#status'), /^head/);
    await assertSameBytes(page, shared, 'stl');
  });

  test('a warning about the scan stays until it is closed', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.clock.install();
    const unoriented = niftiBall();
    unoriented.writeInt16LE(0, 254); // sform
    await openBytes(t, page, 'ball.nii', unoriented);
    await page.waitForSelector('.banner.warning');
    await page.clock.fastForward(60_000);
    assert.match(await text(page, '.banner.warning'), /position and orientation are unknown/);
    await page.click('.banner.warning button');
    assert.equal(await page.locator('.banner').count(), 0);
  });

  test('a folder that holds no scan', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = temporaryFolder(t);
    mkdirSync(join(folder, 'notes'));
    writeFileSync(join(folder, 'notes', 'readme.txt'), 'nothing here');
    await page.setInputFiles('#folder-input', join(folder, 'notes'));
    assert.match(await errorText(page), /notes/);
  });

  test('several series are listed, and those that cannot be read have the reason of marrow info', async (t) => {
    const folder = temporaryFolder(t), both = join(folder, 'both');
    mkdirSync(both);
    for (let k = 1; k <= 40; ++k) {
      const bytes = readFileSync(join(head, `${String(k).padStart(3, '0')}.dcm`));
      writeFileSync(join(both, `a${k}.dcm`), bytes);
      if (k === 20 || k === 21) continue; // the second series lacks two slices
      const other = Buffer.from(bytes.toString('latin1').replaceAll('2.25.246813579', '2.25.246813570').replace('Head, computed', 'With a gap    '), 'latin1');
      writeFileSync(join(both, `b${k}.dcm`), other);
    }
    const page = await openPage(t, browser, await served(t));
    await page.setInputFiles('#folder-input', both);
    await page.waitForSelector('dialog .series');
    assert.equal(await page.locator('dialog .series').count(), 2);
    const info = JSON.parse(execFileSync(marrow, ['info', 'both', '--json'], { cwd: folder, encoding: 'utf8' }));
    assert.equal(await text(page, 'dialog .reason'), info.series.find((series) => series.refused).refused.replace('; --resample makes them even', ''));
    assert.match(await text(page, 'dialog'), /3\.6 mm between 'b19\.dcm' and 'b22\.dcm'.*interpolates the slices/s);
    await page.locator('dialog label.series', { has: page.locator('b', { hasText: 'Head, computed' }) }).click();
    await page.click('dialog button[value="open"]');
    await settled(page);
    assert.match(await assertSameBytes(page, folder, 'stl'), /--series/);
  });

  test('a scan that is opened while another one is reduced takes its place', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    await page.fill('#field-keep', '40');
    await page.press('#field-keep', 'Enter');
    await settled(page);
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name !== 'keepComponents' || window.goOn) return postMessage.call(this, message, ...more);
        window.goOn = () => postMessage.call(this, message, ...more);
      };
    });
    await page.getByLabel('Largest component only').check();
    await page.waitForFunction(() => window.goOn);
    const folder = await openBytes(t, page, 'next.nii', niftiBall());
    await page.waitForFunction(() => document.title.startsWith('next.nii'));
    await page.evaluate(() => window.goOn());
    await settled(page);
    assert.equal(await page.locator('.banner.error').count(), 0);
    await assertSameBytes(page, folder, 'stl');
  });

  test('the headers are looked at once, however often the surface changes', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      window.inspections = 0;
      Worker.prototype.postMessage = function (message, ...more) {
        window.inspections += message.name === 'inspect';
        postMessage.call(this, message, ...more);
      };
    });
    await openFolder(page, head);
    for (const value of [300.5, 400.5, 500.5]) await setIsovalue(page, value);
    assert.equal(await page.evaluate(() => window.inspections), 1);
  });

  test('a scan of several volumes asks for one of them', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = await openBytes(t, page, 'two.nii', niftiVolumes());
    await page.selectOption('dialog [aria-label="Volume"]', '1');
    await page.click('dialog button[value="open"]');
    await settled(page);
    assert.match(await assertSameBytes(page, folder, 'ply'), /--volume 1/);
  });

  test('a scan of very many volumes has a list that ends', async (t) => {
    const page = await openPage(t, browser, await served(t)), header = niftiBall().subarray(0, 352);
    [4, 2, 2, 2, 20_000].forEach((d, i) => header.writeInt16LE(d, 40 + 2 * i));
    header.writeInt16LE(2, 70); // uint8
    header.writeInt16LE(8, 72);
    await openBytes(t, page, 'many.nii', Buffer.concat([header, Buffer.alloc(8 * 20_000)]));
    await page.waitForSelector('dialog [aria-label="Volume"]');
    assert.equal(await page.locator('dialog option').count(), 10_000);
  });

  test('compressed DICOM, whose codecs are loaded only then, without a network too', { skip: lacksDcmtk() }, async (t) => {
    const folder = temporaryFolder(t), packed = join(folder, 'packed');
    mkdirSync(packed);
    for (let k = 1; k <= 40; ++k) {
      const name = `${String(k).padStart(3, '0')}.dcm`;
      execFileSync(k % 2 ? 'dcmcjpeg' : 'dcmcjpls', [k % 2 ? '+e1' : '+el', join(head, name), join(packed, name)]);
    }
    for (const isolated of [true, false]) {
      const page = await openPage(t, browser, await served(t, { isolated }), isolated ? {} : { serviceWorkers: 'allow' });
      const loaded = [];
      page.context().on('request', (request) => { if (/marrow-.*codecs.*wasm/.test(request.url())) loaded.push(request.url()); });
      if (!isolated) { // the service worker has the codecs
        await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
        await page.waitForSelector('body[data-threads]', { state: 'attached' });
        await page.context().setOffline(true);
      }
      await openFolder(page, head);
      assert.deepEqual(loaded, []);
      await page.setInputFiles('#folder-input', packed);
      await page.waitForFunction(() => document.title.startsWith('packed'));
      await settled(page);
      await assertSameBytes(page, folder, 'stl');
      if (isolated) assert.ok(loaded.length > 0);
    }
  });

  test('a label map takes names and colours from a table', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = temporaryFolder(t);
    writeFileSync(join(folder, 'halves.nrrd'), labelNrrd());
    writeFileSync(join(folder, 'names.txt'), '1 left half 255 0 0\n2 right 0 255 0\n');
    await openFiles(page, [join(folder, 'halves.nrrd'), join(folder, 'names.txt')]);
    await page.waitForFunction(() => document.querySelector('.label-list .name')?.textContent === 'left half');
    await settled(page);
    assert.match(await assertSameBytes(page, folder, '3mf'), /--labels names\.txt/);

    writeFileSync(join(folder, 'others.ctbl'), '1 liver 10 20 30 255\n');
    await page.setInputFiles('#table-input', join(folder, 'others.ctbl'));
    await page.waitForFunction(() => document.querySelector('.label-list .name').textContent === 'liver');
    assert.deepEqual(await page.locator('.label-list .name').allTextContents(), ['liver', 'label-2']);
    assert.match(await assertSameBytes(page, folder, 'glb'), /--labels others\.ctbl/);
    writeFileSync(join(folder, 'wrong.txt'), '7 spleen\n');
    await openFiles(page, [join(folder, 'wrong.txt')]);
    assert.match(await errorText(page), /wrong\.txt.*none of the map's labels/);
  });

  test('a label map has a surface for each label', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = await openBytes(t, page, 'halves.nrrd', labelNrrd());
    await settled(page);
    assert.deepEqual(await page.locator('.label-list .name').allTextContents(), ['label-1', 'label-2']);
    assert.match(await assertSameBytes(page, folder, '3mf'), /--labels/);
    await page.focus('[aria-label="Show label-2"]');
    await page.keyboard.press('Space');
    assert.equal(await page.getAttribute(':focus', 'aria-label'), 'Show label-2');
    assert.equal(await page.getAttribute(':focus', 'aria-pressed'), 'false');
    assert.match(await assertSameBytes(page, folder, 'stl'), /--only 1/);
    await page.getByText('Hide all').click();
    assert.ok(!(await page.isVisible('#isovalue .command')));
    await page.click('#export');
    assert.match(await text(page, '.banner'), /show a label/);
  });

  test('a label map that is shown as such again is not reduced any more', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const { postMessage, terminate } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name === 'smooth') window.smoothing = this;
        else postMessage.call(this, message, ...more);
      };
      Worker.prototype.terminate = function () {
        if (window.smoothing === this) window.ended = true;
        terminate.call(this);
      };
    });
    await openBytes(t, page, 'halves.nrrd', labelNrrd());
    await settled(page);
    const separate = page.getByLabel('Each label has its own surface');
    await separate.uncheck();
    await settled(page);
    await page.fill('#field-smooth', '10');
    await page.press('#field-smooth', 'Enter');
    await page.waitForFunction(() => window.smoothing);
    await separate.check();
    await page.waitForFunction(() => window.ended, null, { timeout: 10_000 });
    await settled(page);
    assert.equal(await text(page, '#light'), 'closed');
  });

  test('a label map is not exported before its surfaces follow the controls', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const folder = await openBytes(t, page, 'halves.nrrd', labelNrrd());
    await settled(page);
    await page.evaluate(() => {
      const smoothing = document.querySelector('#field-relax');
      smoothing.value = '0';
      smoothing.dispatchEvent(new Event('change'));
      document.querySelector('#export').click();
    });
    assert.match(await text(page, '.banner'), /still being made/);
    await settled(page);
    assert.match(await assertSameBytes(page, folder, '3mf'), /--relax 0/);
  });
});

describe('the views', () => {
  for (const [type, Samples, inside, isovalue] of [['double', Float64Array, 0.7, 0.7], ['int32', Int32Array, 16777217, 16777216.5]]) {
    test(`show the outline of samples of ${inside} (${type}) at ${isovalue}`, async (t) => {
      const page = await openPage(t, browser, await served(t));
      await openBytes(t, page, 'cube.nrrd', cubeNrrd(type, Samples, -5, inside)); // neither labels nor HU
      await settled(page);
      await setIsovalue(page, isovalue);
      const view = await page.locator('[data-view="axial"] canvas').boundingBox();
      // Along the sides of 8 of 16 samples.
      assert.ok((await outlinePixels(page, 'axial')) > Math.min(view.width, view.height));
    });
  }

  test('show whole numbers in full, and others with six digits', async (t) => {
    const page = await openPage(t, browser, await served(t));
    for (const [type, Samples, inside, shown] of [['int32', Int32Array, 312782546, '312782546'], ['double', Float64Array, 312782546.5, '312783000']]) {
      await openBytes(t, page, `${type}.nrrd`, cubeNrrd(type, Samples, -5, inside)); // neither labels nor HU
      await page.waitForFunction((name) => document.title.startsWith(name), type);
      await settled(page);
      await page.waitForFunction((n) => document.querySelector('[data-view="axial"] .bl').textContent === n, shown, { timeout: 30_000 });
    }
  });

  test('show the outline of an open surface on the first and the last slice', async (t) => {
    const page = await openPage(t, browser, await served(t)), n = 16;
    const column = Int16Array.from({ length: n ** 3 }, (_, i) => 1000 - 100 * Math.hypot(i % n - 7.5, Math.floor(i / n) % n - 7.5));
    await openBytes(t, page, 'column.nrrd', nrrd('short', [n, n, n], column));
    await settled(page);
    await setIsovalue(page, 500.5);
    await page.getByLabel('Open at the border of the scan').check();
    await page.getByLabel('Largest component only').check();
    await settled(page);
    await page.focus('[data-view="axial"]');
    const lengths = [];
    for (const [key, number] of [['Home', '1 / 16'], ['PageUp', '11 / 16'], ['End', '16 / 16']]) {
      await page.keyboard.press(key);
      await page.locator('[data-view="axial"] .br', { hasText: number }).waitFor();
      lengths.push(await outlinePixels(page, 'axial'));
    }
    assert.ok(Math.max(...lengths) < 1.05 * Math.min(...lengths), lengths.join(', ')); // they are the same circle
  });

  test('a distance between two clicks on a slice is that in the patient', async (t) => {
    const page = await openPage(t, browser, await served(t), { viewport: { width: 1400, height: 900 } });
    await openFolder(page, head);
    await page.dblclick('[data-view="axial"]', { position: { x: 30, y: 30 } });
    await page.keyboard.press('d');
    const box = await page.locator('[data-view="axial"] canvas').boundingBox();
    // The slice fits the view, so the scale is known: 196 samples of 1.2 mm fill its height but for 4 pixels.
    const scale = (196 * 1.2) / (box.height - 4);
    await page.mouse.click(box.x + box.width / 2 - 100, box.y + box.height / 2);
    await page.mouse.click(box.x + box.width / 2 + 60, box.y + box.height / 2 + 40);
    const shown = parseFloat(await text(page, '[aria-label="Distances"] .value'));
    assert.ok(Math.abs(shown - Math.hypot(160, 40) * scale) < 0.2, `${shown} mm, not ${Math.hypot(160, 40) * scale}`);
    // The keyboard's focus stays in the list, and goes back to the tool at its end.
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.click(box.x + box.width / 2 + 60, box.y + box.height / 2);
    await page.focus('[aria-label="Remove distance 2"]');
    await page.keyboard.press('Enter');
    assert.equal(await page.getAttribute(':focus', 'aria-label'), 'Remove distance 1');
    await page.keyboard.press('Enter');
    assert.equal(await page.getAttribute(':focus', 'data-tool'), 'distance');
  });

  test('a slice is measured where it is, although the crosshair is between it and the next', async (t) => {
    const page = await openPage(t, browser, await served(t), { viewport: { width: 1400, height: 900 } });
    await openFolder(page, head);
    const place = async () => {
      const position = (await text(page, '[data-view="axial"] .tr')).split(' '), number = await text(page, '[data-view="axial"] .br');
      return { z: (position[0] === 'S' ? 1 : -1) * Number(position[1]), number: parseInt(number, 10) };
    };
    const first = await place();
    // The slice of 144 x 170 samples fits its view; the click is 10.9 samples below its middle, between the samples 84 and 85.
    const coronal = await page.locator('[data-view="coronal"] canvas').boundingBox();
    const sample = Math.min((coronal.width - 4) / 144, (coronal.height - 4) / 170);
    await page.mouse.click(coronal.x + coronal.width / 2, coronal.y + coronal.height / 2 + 10.9 * sample);
    await page.waitForFunction((n) => parseInt(document.querySelector('[data-view="axial"] .br').textContent, 10) !== n, first.number);
    const second = await place();
    assert.ok(Math.abs(second.z - first.z - 1.2 * (second.number - first.number)) < 0.11, JSON.stringify([first, second]));

    await page.keyboard.press('d');
    const axial = await page.locator('[data-view="axial"] canvas').boundingBox();
    await page.mouse.click(axial.x + axial.width / 2, axial.y + axial.height / 2);
    await page.focus('[data-view="axial"]');
    await page.keyboard.press('ArrowUp');
    await page.waitForFunction((n) => parseInt(document.querySelector('[data-view="axial"] .br').textContent, 10) === n + 1, second.number);
    await page.mouse.click(axial.x + axial.width / 2, axial.y + axial.height / 2);
    assert.equal(await text(page, '[aria-label="Distances"] .value'), '1.2 mm');
  });

  test('keys move slices and the camera, and choose tools', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    assert.equal(await text(page, '[data-view="axial"] .br'), '85 / 170');
    await page.focus('[data-view="axial"]');
    await page.keyboard.press('ArrowUp');
    await page.keyboard.press('PageUp');
    await page.waitForFunction(() => document.querySelector('[data-view="axial"] .br').textContent === '96 / 170');
    await page.keyboard.press('k');
    assert.equal(await page.getAttribute('[data-tool="crop"]', 'aria-pressed'), 'true');
    const surface = page.locator('[data-view="surface"] canvas'), before = await surface.screenshot();
    await page.keyboard.press('4');
    // A processor draws, which may take long.
    for (let attempt = 0; before.equals(await surface.screenshot()); ++attempt) {
      assert.ok(attempt < 600, 'the surface is seen from elsewhere');
      await page.waitForTimeout(100);
    }
  });

  test('draw a preview of the same surface while the camera moves', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await page.evaluate(() => {
      const { drawElements, bufferData } = WebGL2RenderingContext.prototype;
      window.drawn = []; // triangles
      WebGL2RenderingContext.prototype.drawElements = function (mode, count, ...more) {
        window.drawn.push(count / 3);
        drawElements.call(this, mode, count, ...more);
      };
      WebGL2RenderingContext.prototype.bufferData = function (target, data, ...more) {
        window.uploadedNothing ||= target === this.ELEMENT_ARRAY_BUFFER && data.byteLength === 0;
        bufferData.call(this, target, data, ...more);
      };
    });
    const shown = async () => Number((await measuresOf(page)).Triangles.replace(/\D/g, ''));
    const drawnWhileTurning = async () => {
      const { x, y, width, height } = await page.locator('[data-view="surface"] canvas').boundingBox();
      await page.mouse.move(x + width / 2, y + height / 2);
      await page.mouse.down();
      await page.evaluate(() => { window.drawn = []; });
      await page.mouse.move(x + width / 2 + 40, y + height / 2);
      const most = await page.waitForFunction(() => window.drawn.find((n) => n > 1000), null, { timeout: 60_000 });
      await page.mouse.up();
      return most.jsonValue();
    };
    // While only a slice is shown, the previews and surfaces that come are not drawn.
    await page.dblclick('[data-view="axial"]', { position: { x: 30, y: 30 } });
    await page.waitForFunction(() => document.querySelector('[data-view="surface"]').clientWidth === 0);
    await page.evaluate(() => { let now = 0; performance.now = () => (now += 100); }); // an extraction takes long
    for (const value of [400.5, 300.5]) await setIsovalue(page, value);
    await page.keyboard.press('Escape');
    await page.waitForFunction((n) => window.drawn.includes(n), await shown(), { timeout: 60_000 });
    const preview = await drawnWhileTurning();
    assert.ok(preview < (await shown()) / 2, `${preview} of ${await shown()} triangles`);
    assert.ok(!(await page.evaluate(() => window.uploadedNothing)));

    await page.evaluate(() => { performance.now = () => 0; }); // takes no time
    for (const value of [400.5, 500.5]) await setIsovalue(page, value);
    assert.equal(await drawnWhileTurning(), await shown());
  });

  test('the wheel moves slices, but not sideways', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    assert.equal(await text(page, '[data-view="axial"] .br'), '24 / 48');
    const box = await page.locator('[data-view="axial"] canvas').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.wheel(100, 0);
    await page.mouse.wheel(0, -100);
    await page.waitForFunction(() => document.querySelector('[data-view="axial"] .br').textContent === '25 / 48');
    await page.mouse.wheel(-100, 0);
    await page.mouse.wheel(0, 100);
    await page.waitForFunction(() => document.querySelector('[data-view="axial"] .br').textContent === '24 / 48');
  });

  test('show the slices of a second scan, even if one of the first was not answered', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name !== 'slice') postMessage.call(this, message, ...more);
        else Worker.prototype.postMessage = postMessage;
      };
    });
    await page.focus('[data-view="axial"]');
    await page.keyboard.press('ArrowUp');
    await openBytes(t, page, 'ball.nii', niftiBall());
    const number = page.locator('[data-view="axial"] .br', { hasText: '24 / 48' });
    await number.waitFor();
  });

  test('a picture is saved as PNG', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#picture')]);
    const png = readFileSync(await download.path());
    assert.equal(png.subarray(1, 4).toString(), 'PNG');
    assert.ok(png.length > 50_000, `${png.length} bytes show a surface`);
  });

  test('a picture needs a surface that is shown', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openFolder(page, head);
    await page.dblclick('[data-view="axial"]', { position: { x: 30, y: 30 } });
    await page.waitForFunction(() => document.querySelector('[data-view="surface"]').clientWidth === 0);
    await page.click('#picture');
    assert.match(await errorText(page), /show it first/);
  });

  test('fit a screen of 360 pixels, and touch moves the isovalue', async (t) => {
    const page = await openPage(t, browser, await served(t), { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });
    await openFolder(page, head);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 360);
    assert.equal(await page.locator('.view:visible').count(), 1);
    await page.tap('.tabs button:nth-child(2)');
    assert.ok(await page.isVisible('[data-view="axial"]'));
    const box = await page.locator('.histogram').boundingBox();
    await page.touchscreen.tap(box.x + box.width * 0.6, box.y + 40);
    await settled(page);
    assert.ok((await numberOf(page)) > 500);
  });

  test('without WebGL the page says so, and everything else works', async (t) => {
    const plain = await launch(['--disable-3d-apis']);
    t.after(() => plain.close());
    const page = await openPage(t, plain, await served(t));
    await openFolder(page, head);
    assert.match(await text(page, '.missing'), /no WebGL 2.*Slices, numbers and export work/);
    await assertSameBytes(page, shared, 'stl');
  });
});

describe('the page', () => {
  test('copies the command line, or selects it where the browser has no clipboard', async (t) => {
    const page = await openPage(t, browser, await served(t), { permissions: ['clipboard-read', 'clipboard-write'] });
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    const line = await text(page, '#isovalue code'), copy = page.locator('#isovalue .command button');
    await copy.click();
    await page.waitForFunction(() => document.querySelector('#isovalue .command button').textContent === 'Copied');
    assert.equal(await page.evaluate(() => navigator.clipboard.readText()), line);
    await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined }));
    await copy.click();
    assert.match(await text(page, '.banner.note p'), /command line is selected/);
    assert.equal(await page.evaluate(() => getSelection().toString()), line);
  });

  test('works without a network after the first visit', async (t) => {
    const page = await openPage(t, browser, await served(t), { serviceWorkers: 'allow' });
    await page.evaluate(() => navigator.serviceWorker.ready);
    await page.context().setOffline(true);
    await page.reload();
    await page.waitForSelector('body[data-threads]', { state: 'attached' });
    await openFolder(page, head);
    await assertSameBytes(page, shared, 'stl');
  });

  test('isolates itself on a server that does not, to use threads', async (t) => {
    const page = await openPage(t, browser, await served(t, { isolated: false }), { serviceWorkers: 'allow' });
    await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
  });

  test('keeps its files while a newer version is served, until it is closed', async (t) => {
    const folder = join(temporaryFolder(t), 'page'), worker = join(folder, 'sw.js');
    cpSync(built, folder, { recursive: true });
    const server = await serve(folder);
    t.after(() => server.close());
    const page = await openPage(t, browser, server.url, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => navigator.serviceWorker.controller);

    // The newer version has other files.
    const script = readFileSync(worker, 'utf8').replace(/\["\.\/".*?\]/, '["./"]');
    writeFileSync(worker, script.replace(/marrow-\$\{.*?\}/, 'marrow-newer'));
    await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
    await page.waitForFunction(async () => !(await navigator.serviceWorker.getRegistration()).installing);
    rmSync(join(folder, 'assets'), { recursive: true });
    await page.click('#welcome-demo');
    await settled(page);

    const next = await page.context().newPage();
    await page.close();
    await next.goto(`${server.url}sw.js`);
    await next.waitForFunction(async () => (await caches.keys()).join() === 'marrow-newer');
  });

  test('does not load itself again while somebody chooses a series', async (t) => {
    const url = await served(t, { isolated: false });
    const page = await openPage(t, browser, url, { serviceWorkers: 'allow', startWorker: false });
    const folder = await openBytes(t, page, 'two.nii', niftiVolumes());
    await page.waitForSelector('dialog .series');
    await page.evaluate(() => window.startWorker());
    await page.waitForFunction(() => navigator.serviceWorker.controller);
    await page.waitForTimeout(500);
    await page.click('dialog button[value="open"]');
    await settled(page);
    await assertSameBytes(page, folder, 'stl');
  });

  for (const [isolated, place] of [[true, 'with the headers of its server'], [false, 'with those of the service worker']]) {
    test(`may not connect to any other site, nor may its workers (${place})`, async (t) => {
      const others = createServer((_, response) => response.writeHead(200, { 'Cross-Origin-Resource-Policy': 'cross-origin' }).end());
      await new Promise((resolve) => { others.listen(0, 'localhost', resolve); });
      t.after(() => others.close());
      const other = `http://localhost:${others.address().port}/`;
      const page = await openPage(t, browser, await served(t, { isolated }),
        { expected: new RegExp(`${other}|Content Security Policy`), serviceWorkers: isolated ? 'block' : 'allow' });
      if (!isolated) {
        await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
        await page.waitForSelector('body[data-threads]', { state: 'attached' });
      }
      const policy = await page.getAttribute('meta[http-equiv="Content-Security-Policy"]', 'content');
      assert.doesNotMatch(policy, /https?:|\*|unsafe-inline|'unsafe-eval'/);
      // Threads of WebAssembly wait and cannot be asked.
      const workers = page.workers().filter((worker) => !worker.url().includes('marrow-mt'));
      assert.ok(workers.length > 0);
      for (const place of [page, ...workers])
        assert.ok(await place.evaluate((url) => fetch(url, { mode: 'no-cors' }).then(() => false, () => true), other), place.url());
    });
  }

  test('follows redirections of its server, with the service worker too', async (t) => {
    const url = await served(t);
    const server = createServer(async ({ url: path }, response) => {
      if (path === '/moved') return response.writeHead(302, { Location: './' }).end();
      const found = await fetch(new URL(path, url));
      response.writeHead(found.status, { 'Content-Type': found.headers.get('Content-Type') ?? '' }).end(Buffer.from(await found.arrayBuffer()));
    });
    await new Promise((resolve) => { server.listen(0, 'localhost', resolve); });
    t.after(() => { server.close(); server.closeAllConnections(); });
    const page = await openPage(t, browser, `http://localhost:${server.address().port}/`, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
    await page.goto(new URL('moved', page.url()).href);
    await page.waitForSelector('body[data-threads]', { state: 'attached' });
  });

  test('its server answers a bad request, and goes on', async (t) => {
    const url = await served(t), { hostname, port } = new URL(url);
    for (const path of ['/%', '//']) {
      const status = await new Promise((resolve, reject) => {
        request({ hostname, port, path }, (response) => { response.resume(); resolve(response.statusCode); }).on('error', reject).end();
      });
      assert.equal(status, 400, path);
    }
    assert.equal((await fetch(url)).status, 200);
  });

  test('shows the demo scan at one click', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.click('#welcome-demo');
    await settled(page);
    assert.equal(await text(page, '#light'), 'watertight');
  });

  test('does not compute the demo scan once another scan is opened', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.click('#welcome-demo');
    await page.waitForSelector('progress[aria-label^="Computing"]');
    await openBytes(t, page, 'ball.nii', niftiBall());
    await page.waitForSelector('#welcome-demo:not([disabled])', { state: 'attached' });
    await settled(page);
    assert.match(await page.title(), /^ball\.nii/);
  });

  for (const colorScheme of ['dark', 'light']) {
    test(`has no serious accessibility fault (${colorScheme})`, async (t) => {
      const page = await openPage(t, browser, await served(t), { colorScheme, bypassCSP: true });
      const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
      const faults = async () => (await page.evaluate(async (source) => {
        if (!window.axe) (0, eval)(source);
        return (await window.axe.run()).violations.filter((v) => ['serious', 'critical'].includes(v.impact))
          .map((v) => `${v.id}: ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`);
      }, axe));
      assert.deepEqual(await faults(), [], 'start');
      await openFolder(page, head);
      assert.deepEqual(await faults(), [], 'with a scan');
      await page.click('#export');
      assert.deepEqual(await faults(), [], 'export');
      await page.keyboard.press('Escape');
      await page.keyboard.press('?');
      assert.deepEqual(await faults(), [], 'help');
    });
  }
});

test('a file that is changed while it is read is an error, and the next one is read', async (t) => {
  const server = await serve(join(built, '..'));
  t.after(() => server.close());
  const folder = temporaryFolder(t), page = await browser.newPage();
  t.after(() => page.close());
  await page.goto(`${server.url}marrow-wasm/package.json`);
  await page.evaluate(() => document.body.append(Object.assign(document.createElement('input'), { type: 'file' })));
  for (const name of ['ball.nii', 'ball.nii.gz', 'ball.zip']) {
    writeFileSync(join(folder, name), niftiBall());
    await page.setInputFiles('input', join(folder, name));
    // The browser looks at the file some time after it was chosen, and takes it as it is then.
    await page.evaluate(() => document.querySelector('input').files[0].slice(0, 1).arrayBuffer());
    utimesSync(join(folder, name), 1e9, 1e9);
    const read = await page.evaluate(async (bytes) => {
      const { readScan } = await import('/marrow-wasm/index.mjs');
      const { code, message } = await readScan(document.querySelector('input').files).catch((error) => error);
      const scan = await readScan({ path: 'next.nii', data: Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0)) });
      return { code, message, dims: scan.dims };
    }, niftiBall().toString('base64'));
    assert.equal(read.code, 3, read.message);
    assert.ok(read.message.startsWith(`'${name}'`), read.message);
    assert.deepEqual(read.dims, [48, 48, 48]);
  }
});

// As in node, but with several threads, and with memory that a worker shares with the page.
test('a newer isovalue stops the extraction that runs in a worker', async (t) => {
  const server = await serve(join(built, '..'));
  t.after(() => server.close());
  const page = await browser.newPage();
  t.after(() => page.close());
  await page.goto(`${server.url}marrow-wasm/package.json`); // any page of the same origin
  const result = await page.evaluate(async () => {
    let stopped = 0;
    globalThis.Worker = class extends Worker {
      constructor(...options) {
        super(...options);
        this.addEventListener('message', ({ data }) => { stopped += data.error?.code === 130; });
      }
    };
    const { Extractor, scanOf, threads } = await import('/marrow-wasm/index.mjs');
    const dims = [160, 160, 160], noise = Uint8Array.from({ length: 160 ** 3 }, (_, i) => Math.imul(i ^ (i >>> 7), 0x9e3779b1) >>> 24);
    const scan = await scanOf(noise, { dims });
    const extractor = await Extractor.create(scan);
    let newest, attempt = 0;
    for (; stopped === 0 && attempt < 100; ++attempt) {
      const controller = new AbortController(), older = extractor.extract(100 + attempt, { signal: controller.signal }).catch(() => {});
      await new Promise((resolve) => { setTimeout(resolve, 5 * (attempt % 20)); });
      controller.abort();
      newest = await extractor.extract(253);
      await older;
    }
    const fresh = await (await Extractor.create(scan)).extract(253);
    const same = ['points', 'normals', 'triangles'].every((name) => newest[name].length > 1000 && newest[name].every((value, i) => value === fresh[name][i]));
    return { stopped, same, several: threads() > 1 === navigator.hardwareConcurrency > 1, isolated: crossOriginIsolated };
  });
  assert.deepEqual(result, { stopped: 1, same: true, several: true, isolated: true });
});
