// The page in a real browser: without a network, without help of its server, and for everybody.
import assert from 'node:assert/strict';
import { subscribe, unsubscribe } from 'node:diagnostics_channel';
import { cpSync, readFileSync, rmSync, utimesSync, writeFileSync } from 'node:fs';
import { createServer, request } from 'node:http';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { built, serve } from '../serve.mjs';
import { assertSameBytes, openBytes, openFiles, openFolder, openPage, served, settled, setUp, temporaryFolder, text } from './browser.mjs';
import { niftiBall, niftiVolumes } from './scans.mjs';

const { browser, shared, head } = await setUp();

/** Waits for what a page has to be asked for asynchronously: waitForFunction() takes a promise for a yes. */
async function until(page, condition, argument) {
  for (let attempt = 0; !(await page.evaluate(condition, argument)); ++attempt) {
    assert.ok(attempt < 300, String(condition));
    await page.waitForTimeout(100);
  }
}

/** Whether a service worker was installed and waits for the pages of the one before to be closed. */
const newerWaits = async () => Boolean((await navigator.serviceWorker.getRegistration()).waiting);

/** The service worker of another version. */
const newer = (script) => script.replace(/"[0-9a-f]{12}"/, '"newer"');

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
    const site = temporaryFolder(t), names = ['marrow', 'marrow-next'];
    for (const name of names) cpSync(built, join(site, name), { recursive: true });
    const server = await serve(site, { isolated: false });
    t.after(() => server.close());
    const page = await openPage(t, browser, `${server.url}marrow/`, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
    await page.goto(`${server.url}marrow-next/`); // another copy, in the same tab
    await page.waitForFunction(() => crossOriginIsolated, null, { timeout: 30_000 });
  });

  test('downloads no file of the first visit again to keep it', async (t) => {
    const server = await serve(built, { caching: 'max-age=600' }), asked = [];
    t.after(() => server.close());
    const note = ({ request: { url } }) => asked.push(url);
    subscribe('http.server.request.start', note);
    t.after(() => unsubscribe('http.server.request.start', note));
    const page = await openPage(t, browser, server.url, { serviceWorkers: 'allow', startWorker: false });
    await openBytes(t, page, 'ball.nii', niftiBall());
    await settled(page);
    await page.evaluate(() => window.startWorker());
    await page.waitForFunction(() => navigator.serviceWorker.controller);
    const assets = asked.filter((path) => path.startsWith('/assets/'));
    assert.ok(assets.length > 5);
    assert.deepEqual(assets.filter((path, i) => assets.indexOf(path) !== i), []);
  });

  test('keeps its files while a newer version is served, until it is closed', async (t) => {
    const site = temporaryFolder(t), folder = join(site, 'page'), worker = join(folder, 'sw.js');
    cpSync(built, folder, { recursive: true });
    const server = await serve(site);
    t.after(() => server.close());
    const page = await openPage(t, browser, `${server.url}page/`, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => navigator.serviceWorker.controller);

    // The newer version has other files.
    writeFileSync(worker, newer(readFileSync(worker, 'utf8')).replace(/\["\.\/".*?\]/, '["./"]'));
    await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
    await until(page, newerWaits);
    rmSync(join(folder, 'assets'), { recursive: true });
    await page.click('#welcome-demo');
    await settled(page);

    const next = await page.context().newPage();
    await page.close();
    await next.goto(server.url); // which is not found, and not of the page
    await until(next, async (name) => (await caches.keys()).join() === name, `marrow ${server.url}page/ newer`);
  });

  test('takes a newer version from its server, although the browser may still keep the files before', async (t) => {
    const folder = join(temporaryFolder(t), 'page');
    cpSync(built, folder, { recursive: true });
    const server = await serve(folder, { caching: 'max-age=600' });
    t.after(() => server.close());
    const page = await openPage(t, browser, server.url, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => navigator.serviceWorker.controller);

    for (const [name, change] of [['sw.js', newer], ['index.html', (html) => html.replace('<title>', '<title>Newer ')]])
      writeFileSync(join(folder, name), change(readFileSync(join(folder, name), 'utf8')));
    await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
    await until(page, newerWaits);
    const kept = await page.evaluate(async (name) => (await (await caches.open(name)).match('./')).text(), `marrow ${server.url} newer`);
    assert.match(kept, /<title>Newer /);
  });

  test('leaves the files of another copy on the same site alone', async (t) => {
    const site = temporaryFolder(t), names = ['marrow', 'marrow-next'];
    for (const name of names) cpSync(built, join(site, name), { recursive: true });
    const worker = join(site, 'marrow-next', 'sw.js');
    writeFileSync(worker, newer(readFileSync(worker, 'utf8')));
    const server = await serve(site);
    t.after(() => server.close());
    const page = await openPage(t, browser, `${server.url}marrow/`, { serviceWorkers: 'allow' });
    await page.waitForFunction(() => navigator.serviceWorker.controller);
    const other = await page.context().newPage();
    await other.goto(`${server.url}marrow-next/`);
    await other.waitForFunction(() => navigator.serviceWorker.controller);
    await page.context().setOffline(true);
    for (const copy of [page, other]) {
      await copy.reload();
      await copy.waitForSelector('body[data-threads]', { state: 'attached' });
    }
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
      await page.keyboard.press('Escape');
      await openFiles(page, [1, 2, 4, 5].map((k) => join(head, `00${k}.dcm`)));
      await page.waitForSelector('dialog .series:has(:checked) .reason');
      assert.deepEqual(await faults(), [], 'uneven slices');
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
