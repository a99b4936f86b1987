#!/usr/bin/env node
// Takes the pictures of docs/browser.md, and others to look at.
// usage: node tests/screenshots.mjs FOLDER [LABEL_MAP]      (`npm run build` first)
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { launch, openFiles, openPage, served, settled } from './browser.mjs';

const [folder, labelMap] = process.argv.slice(2);
if (!folder) {
  console.error('usage: node tests/screenshots.mjs FOLDER [LABEL_MAP]');
  process.exit(2);
}
mkdirSync(folder, { recursive: true });
const cleanUps = [], t = { after: (f) => cleanUps.unshift(f) };
const browser = await launch(), url = await served(t);

async function picture(name, [width, height], colorScheme, act = async () => {}) {
  const page = await openPage(t, browser, url, { viewport: { width, height }, colorScheme, ...(width < 700 && { hasTouch: true, isMobile: true, deviceScaleFactor: 2 }) });
  await act(page);
  await page.evaluate(() => scrollTo(0, 0));
  await page.waitForTimeout(3000); // drawn by a processor
  await page.screenshot({ path: join(folder, `${name}.png`) });
  await page.context().close();
}

const demo = async (page) => {
  await page.click('#welcome-demo');
  await settled(page);
  await page.getByLabel('Largest component only').check();
  await settled(page);
  for (const close of await page.locator('.banner button').all()) await close.click();
};
const skin = async (page) => { await demo(page); await page.click('[data-preset="skin"]'); await settled(page); };
const measured = async (page) => {
  await demo(page);
  await page.keyboard.press('1');
  await page.waitForTimeout(2500);
  await page.keyboard.press('d');
  const { x, y, width, height } = await page.locator('[data-view="surface"] canvas').boundingBox();
  for (const [u, v] of [[0.405, 0.56], [0.6, 0.56], [0.5, 0.2], [0.5, 0.88]]) await page.mouse.click(x + u * width, y + v * height);
};
const cropped = async (page) => {
  await demo(page);
  await page.getByLabel('Last sample along x').fill('71');
  await page.press('[aria-label="Last sample along x"]', 'Enter');
  await settled(page);
  await page.keyboard.press('k');
};
const exported = async (page) => { await demo(page); await page.click('#export'); };
const labels = async (page) => { await openFiles(page, [labelMap]); await settled(page); };

const wide = [1440, 900], small = [800, 600], phone = [360, 740];
await picture('welcome', wide, 'dark');
await picture('page', wide, 'dark', demo);
await picture('light', wide, 'light', skin);
await picture('measure', wide, 'dark', measured);
await picture('page-crop', wide, 'light', cropped);
await picture('page-export', wide, 'dark', exported);
if (labelMap) await picture('page-labels', wide, 'dark', labels);
await picture('small', small, 'dark', demo);
await picture('small-light', small, 'light', demo);
await picture('page-phone', phone, 'dark', demo);
await picture('page-phone-light', phone, 'light', skin);
await picture('page-phone-welcome', phone, 'light');
for (const cleanUp of cleanUps) await cleanUp();
await browser.close();
