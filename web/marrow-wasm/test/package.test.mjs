// The package itself.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { Worker } from 'node:worker_threads';

import { geometry, lumps, marrow, packageFolder, rejection, repository } from './support.mjs';

const description = JSON.parse(readFileSync(join(packageFolder, 'package.json')));

test('the version is the library\'s', () => {
  const [, version] = /MARROW_VERSION "(.*)"/.exec(readFileSync(join(repository, 'include/marrow/version.h'), 'utf8'));
  assert.equal(marrow.version, version);
  assert.equal(description.version, version);
});

test('the archive holds all that is imported, and nothing else is needed', () => {
  const [{ files }] = JSON.parse(execFileSync('npm', ['pack', '--dry-run', '--json', '--offline'], { cwd: packageFolder }));
  const packed = new Set(files.map(({ path }) => path));
  for (const file of ['index.mjs', 'index.d.ts', 'README.md', 'LICENSE', 'marrow.wasm', 'marrow-mt.wasm']) assert.ok(packed.has(file), file);
  assert.equal(description.dependencies, undefined);
  for (const file of packed) {
    if (!file.endsWith('.mjs')) continue;
    const text = readFileSync(join(packageFolder, file), 'utf8');
    for (const [, name] of text.matchAll(/(?:from|new URL\() ?'(\.\/[^']+\.(?:mjs|wasm|js))'/g))
      assert.ok(packed.has(name.slice(2)), `${file} needs ${name}`);
  }
});

test('all that index.d.ts declares is there', () => {
  const text = readFileSync(join(packageFolder, 'index.d.ts'), 'utf8');
  for (const [, name] of text.matchAll(/^export (?:function|class|const) (\w+)/gm)) assert.ok(name in marrow, name);
});

test('a worker that cannot start is not used again', async () => {
  const { prepare, scanOf } = marrow, make = () => scanOf(new Uint8Array(8), { dims: [2, 2, 2] });
  const failed = await Promise.allSettled([prepare({ baseUrl: 'file:///nowhere/' }), make()]);
  for (const { reason } of failed) {
    assert.equal(reason?.code, 3);
    assert.match(reason.message, /nowhere\/marrow\.mjs/);
  }
  await prepare({ baseUrl: `file://${packageFolder}/` });
  (await make()).dispose();
});

test('a worker whose work an exception cut short is not used again', async (t) => {
  const scan = await marrow.scanOf(lumps('uint8'), geometry), extractor = await marrow.Extractor.create(scan);
  const { postMessage } = Worker.prototype;
  t.after(() => { Worker.prototype.postMessage = postMessage; });
  // Looking at this memory throws, in the middle of the extraction.
  Worker.prototype.postMessage = function (message, ...more) {
    if (message.name === 'extract') message.stop = {};
    postMessage.call(this, message, ...more);
  };
  assert.equal((await rejection(extractor.extract(50))).code, 3);
  const { code, message } = await rejection(scan.slice(2, 0));
  assert.equal(code, 3);
  assert.match(message, /the worker stopped.*; open the scan again$/);
});
