// The page in a real browser: slices, the surface from all sides, and tools.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { describe, test } from 'node:test';
import { assertSameBytes, errorText, launch, measuresOf, numberOf, openBytes, openFolder, openPage, served, setIsovalue, settled, setUp, text } from './browser.mjs';
import { cubeNrrd, labelNrrd, niftiBall, nrrd } from './scans.mjs';

const { browser, shared, head } = await setUp();

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

  test('show the surface again after the browser lost the graphics card', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    const picture = async () => {
      const [download] = await Promise.all([page.waitForEvent('download'), page.click('#picture')]);
      return readFileSync(await download.path());
    };
    const before = await picture();
    await page.evaluate(() => {
      const { drawElements } = WebGL2RenderingContext.prototype;
      WebGL2RenderingContext.prototype.drawElements = function (mode, count, ...more) {
        window.drawn ||= window.restored && count > 3000;
        drawElements.call(this, mode, count, ...more);
      };
      window.loss = document.querySelector('[data-view="surface"] canvas').getContext('webgl2').getExtension('WEBGL_lose_context');
      window.loss.loseContext();
    });
    assert.match(await page.waitForSelector('.missing').then((missing) => missing.textContent()), /lost the graphics card/);
    await page.click('[data-view="surface"] .enlarge', { trial: true }); // which nothing may cover
    await page.click('#picture');
    assert.match(await errorText(page), /lost the graphics card/);
    await page.click('.banner.error button');
    await page.evaluate(() => {
      document.querySelector('[data-view="surface"] canvas').addEventListener('webglcontextrestored', () => { window.restored = true; });
      window.loss.restoreContext();
    });
    await page.waitForFunction(() => window.drawn, null, { timeout: 60_000 });
    assert.equal(await page.locator('.missing').count(), 0);
    assert.ok(before.equals(await picture()));
  });

  test('hide a label and show it again without sending its surface to the graphics card again', async (t) => {
    const page = await openPage(t, browser, await served(t));
    await page.evaluate(() => {
      const { drawElements, bufferData, clear } = WebGL2RenderingContext.prototype;
      window.frames = [];
      window.uploads = 0;
      Object.assign(WebGL2RenderingContext.prototype, {
        clear(mask) { if (mask & this.COLOR_BUFFER_BIT) window.frames.push(0); clear.call(this, mask); },
        drawElements(mode, count, ...more) { if (count > 3000) ++window.frames[window.frames.length - 1]; drawElements.call(this, mode, count, ...more); },
        bufferData(target, ...more) { window.uploads += target === this.ELEMENT_ARRAY_BUFFER; bufferData.call(this, target, ...more); },
      });
    });
    await openBytes(t, page, 'halves.nrrd', labelNrrd());
    await settled(page);
    const drawn = (surfaces) => page.waitForFunction((n) => window.frames.at(-1) === n, surfaces, { timeout: 60_000 });
    await drawn(2);
    await page.evaluate(() => { window.uploads = 0; });
    for (const surfaces of [1, 2]) {
      await page.click('[aria-label="Show label-2"]');
      await drawn(surfaces);
    }
    assert.equal(await page.evaluate(() => window.uploads), 0);
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
