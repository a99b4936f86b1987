// The page in a real browser: scans in all forms, and label maps, compared with the command line.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { assertSameBytes, errorText, marrow, measuresOf, openBytes, openFiles, openFolder, openPage, served, setIsovalue, settled, setUp, temporaryFolder, text } from './browser.mjs';
import { cubeNrrd, labelNrrd, niftiBall, niftiBallGz, niftiVolumes } from './scans.mjs';

const { browser, shared, head } = await setUp();

/** The reason to skip a test that compresses DICOM. */
const lacksDcmtk = () => (spawnSync('dcmcjpeg', ['--version']).status === 0 ? false : "dcmcjpeg is missing: install Debian's package dcmtk");

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

  test('a text that is dropped is none, and a file that cannot be read is named', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const transfer = new DataTransfer();
      transfer.setData('text/plain', 'a text');
      dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
    });
    assert.equal(await page.locator('.banner').count(), 0);
    await page.evaluate(() => {
      const fail = (_, reject) => reject(new DOMException('it is gone', 'NotFoundError'));
      const entry = { isFile: true, fullPath: '/series/007.dcm', file: fail };
      const transfer = { types: ['Files'], items: [{ webkitGetAsEntry: () => entry }], files: [] };
      dispatchEvent(Object.defineProperty(new Event('drop'), 'dataTransfer', { value: transfer }));
    });
    assert.equal(await errorText(page), "'series/007.dcm' cannot be read: it is gone");
  });

  test('files of no common folder are exported by a command line that reads them from one', async (t) => {
    const page = await openPage(t, browser, await served(t)), folder = temporaryFolder(t), name = 'folder with these files';
    mkdirSync(join(folder, name));
    const files = Array.from({ length: 20 }, (_, k) => `0${k + 70}.dcm`);
    for (const file of files) writeFileSync(join(folder, name, file), readFileSync(join(head, file)));
    await openFiles(page, files.map((file) => join(head, file)));
    await settled(page);
    assert.match(await text(page, '#status'), new RegExp(`^${name}`));
    assert.match(await assertSameBytes(page, folder, 'stl'), new RegExp(`^marrow '${name}' `));
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

  test('a text in the folder of a label map is a table, or is ignored', async (t) => {
    const page = await openPage(t, browser, await served(t)), folder = temporaryFolder(t);
    for (const [name, content] of [['named', '1 left\n2 right\n'], ['described', 'Segmented by hand, version 2\n']]) {
      mkdirSync(join(folder, name));
      writeFileSync(join(folder, name, `${name}.nrrd`), labelNrrd());
      writeFileSync(join(folder, name, 'README.txt'), content);
      await page.setInputFiles('#folder-input', join(folder, name));
      await page.waitForFunction((start) => document.title.startsWith(start), name);
      if (name === 'named') await page.waitForFunction(() => document.querySelector('.label-list .name').textContent === 'left');
      await settled(page);
    }
    assert.deepEqual(await page.locator('.label-list .name').allTextContents(), ['label-1', 'label-2']);
    assert.match(await text(page, '.banner.note p'), /is ignored: .*README\.txt.*line 1/);
    assert.equal(await page.locator('.banner.error').count(), 0);
    await openFiles(page, ['described.nrrd', 'README.txt'].map((file) => join(folder, 'described', file)));
    assert.match(await errorText(page), /README\.txt/);
  });

  test('a table of some labels leaves the others the names and colours of their segments', async (t) => {
    const page = await openPage(t, browser, await served(t));
    const segments = [['liver', '1 0 0'], ['spleen', '0 0 1']].map(([name, colour], i) =>
      `Segment${i}_LabelValue:=${i + 1}\nSegment${i}_Name:=${name}\nSegment${i}_Color:=${colour}\n`).join('');
    const folder = await openBytes(t, page, 'halves.seg.nrrd', labelNrrd(segments));
    await settled(page);
    writeFileSync(join(folder, 'names.txt'), '1 hepar\n');
    await page.setInputFiles('#table-input', join(folder, 'names.txt'));
    await page.waitForFunction(() => document.querySelector('.label-list .name').textContent === 'hepar');
    assert.deepEqual(await page.locator('.label-list .name').allTextContents(), ['hepar', 'spleen']);
    assert.match(await assertSameBytes(page, folder, 'glb'), /--labels names\.txt/);
  });

  test('a lack of memory is an error, also while the table beside a map is read', async (t) => {
    const page = await openPage(t, browser, await served(t)), folder = temporaryFolder(t);
    await page.evaluate(() => {
      const { postMessage } = Worker.prototype;
      Worker.prototype.postMessage = function (message, ...more) {
        if (message.name === 'labelTable') this.onmessage({ data: { id: message.id, error: { message: 'not enough memory for this input', code: 3 } } });
        else postMessage.call(this, message, ...more);
      };
    });
    writeFileSync(join(folder, 'map.nrrd'), labelNrrd());
    writeFileSync(join(folder, 'README.txt'), '1 left\n');
    await page.setInputFiles('#folder-input', folder);
    assert.match(await errorText(page), /not enough memory/);
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
