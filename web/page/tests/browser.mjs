// What the tests share: Debian's Chromium, the built page, and actions on it.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { after } from 'node:test';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';
import { built, serve } from '../serve.mjs';
import { writeHead } from './scans.mjs';

const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
const SOFTWARE_GL = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

/** The command line, to compare with. */
export const marrow = resolve(process.env.MARROW ?? fileURLToPath(new URL('../../../build/release/bin/marrow', import.meta.url)));

export function launch(flags = SOFTWARE_GL) {
  assert.ok(existsSync(CHROMIUM), `${CHROMIUM} is missing: install Debian's package chromium`);
  assert.ok(existsSync(join(built, 'index.html')), `${built} is missing: run 'make web'`);
  return chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', ...flags] });
}

/** What the tests of a file share: a browser, and a folder with the demo's head, a folder of DICOM files. */
export async function setUp() {
  const browser = await launch(), shared = temporaryFolder({ after });
  after(() => browser.close());
  return { browser, shared, head: await writeHead(shared) };
}

/** Serves the page for the time of a test. */
export async function served(t, options) {
  const server = await serve(built, options);
  t.after(() => server.close());
  return server.url;
}

/**
 * Opens the page. When the test ends, it fails if the page reported an error other than `expected`, or asked for anything
 * but its own files. With `startWorker` false, the service worker waits until the page calls startWorker().
 */
export async function openPage(t, browser, url, { expected, startWorker = true, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 800 }, serviceWorkers: 'block', acceptDownloads: true, ...options });
  const faults = [], foreign = [];
  context.on('request', (request) => {
    const { protocol, origin } = new URL(request.url());
    if (origin !== new URL(url).origin && protocol !== 'blob:' && protocol !== 'data:') foreign.push(request.url());
  });
  const page = await context.newPage();
  if (!startWorker) {
    await page.addInitScript(() => {
      const { register } = ServiceWorkerContainer.prototype;
      const started = new Promise((resolve) => { window.startWorker = resolve; });
      ServiceWorkerContainer.prototype.register = async function (...more) {
        await started;
        return register.apply(this, more);
      };
    });
  }
  page.on('pageerror', (error) => faults.push(error.stack ?? error.message));
  page.on('console', (message) => { if (message.type() === 'error') faults.push(message.text()); });
  t.after(async () => {
    await context.close();
    const unexpected = (text) => !expected?.test(text);
    assert.deepEqual(foreign.filter(unexpected), [], 'the page asked for something beyond its own files');
    assert.deepEqual(faults.filter(unexpected), [], 'the page reported errors');
  });
  await page.goto(url);
  await page.waitForSelector('body[data-threads]', { state: 'attached' });
  return page;
}

/** A folder for files, until the end of the test. */
export function temporaryFolder(t) {
  const folder = mkdtempSync(join(tmpdir(), 'marrow-page-'));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/** Waits until the surface matches the controls in full resolution and is measured. */
export async function settled(page) {
  await page.waitForSelector('#light[data-state="good"], #light[data-state="bad"]', { timeout: 120_000 });
}

/** Notes what the page does until mainThreadTasks(). */
export function startTrace(page) {
  return page.context().browser().startTracing(page, { categories: ['disabled-by-default-devtools.timeline'] });
}

/**
 * The tasks of the page's main thread since startTrace(), ms: how long they took, and how long the thread worked in them.
 * The rest is waiting, as for a processor that draws in place of a graphics card.
 */
export async function mainThreadTasks(page) {
  const { traceEvents } = JSON.parse(await page.context().browser().stopTracing());
  const threadOf = ({ pid, tid }) => `${pid} ${tid}`;
  const main = new Set(traceEvents.filter((e) => e.name === 'thread_name' && e.args.name === 'CrRendererMain').map(threadOf));
  const tasks = traceEvents.filter((e) => e.name === 'RunTask' && e.ph === 'X' && main.has(threadOf(e)));
  return { took: tasks.map((e) => e.dur / 1000), worked: tasks.map((e) => (e.tdur ?? e.dur) / 1000) };
}

export async function openFolder(page, folder) {
  await page.setInputFiles('#folder-input', folder);
  await settled(page);
}

export async function openFiles(page, files) {
  await page.setInputFiles('#file-input', files);
}

/** Opens one file of a scan that the test made. */
export async function openBytes(t, page, name, bytes) {
  const folder = temporaryFolder(t);
  writeFileSync(join(folder, name), bytes);
  await openFiles(page, [join(folder, name)]);
  return folder;
}

/** The error that the page shows. */
export async function errorText(page) {
  return (await page.waitForSelector('.banner.error p', { timeout: 60_000 })).textContent();
}

/** The text of an element. */
export const text = (page, selector) => page.locator(selector).textContent();

/** The isovalue in its field. */
export const numberOf = (page) => page.inputValue('#isovalue-number').then(Number);

/** The measures of the surface, by their names. */
export async function measuresOf(page) {
  const names = await page.locator('#measures dt').allTextContents(), values = await page.locator('#measures dd').allTextContents();
  return Object.fromEntries(names.map((name, i) => [name, values[i]]));
}

export async function setIsovalue(page, value) {
  await page.fill('#isovalue-number', String(value));
  await page.press('#isovalue-number', 'Enter');
  await settled(page);
}

/** Exports, runs the command line that the dialog shows, and returns the bytes of both. */
export async function exportBoth(page, folder, format, { space = 'LPS' } = {}) {
  await page.click('#export');
  await page.check(`input[name="format"][value="${format}"]`, { force: true });
  if (space !== 'LPS') await page.selectOption('#export-space', space);
  const command = await page.textContent('dialog code');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('dialog button[value="save"]')]);
  const fromPage = readFileSync(await download.path());
  const name = download.suggestedFilename();
  execFileSync('sh', ['-c', `"$MARROW" ${command.replace(/^marrow /, '')} -q`], { cwd: folder, env: { ...process.env, MARROW: marrow }, stdio: 'pipe' });
  return { command, name, fromPage, fromCommand: readFileSync(join(folder, name)) };
}

/** Fails unless the page and the command line wrote the same bytes. */
export async function assertSameBytes(page, folder, format, options) {
  const { command, fromPage, fromCommand } = await exportBoth(page, folder, format, options);
  assert.ok(fromPage.length > 500, `${format}: ${fromPage.length} bytes`);
  assert.ok(fromPage.equals(fromCommand), `${command}: the bytes differ (${fromPage.length} and ${fromCommand.length})`);
  return command;
}
