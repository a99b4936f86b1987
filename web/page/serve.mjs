#!/usr/bin/env node
// Serves the built page on this computer, with the headers that isolate it, which threads need.
// usage: node serve.mjs [--port N] [--plain]      (--plain: without these headers)
import { createReadStream } from 'node:fs';
import { stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { pipeline } from 'node:stream';
import { fileURLToPath } from 'node:url';
import { POLICY } from './policy.mjs';

const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.mjs': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml', '.wasm': 'application/wasm', '.json': 'application/json' };
const ISOLATION = { 'Content-Security-Policy': POLICY, 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp', 'Cross-Origin-Resource-Policy': 'same-origin' };

/** Serves a folder; resolves when the server listens. `caching` is what the browser is told about keeping the files. */
export async function serve(folder, { port = 0, isolated = true, caching = 'no-cache' } = {}) {
  const server = createServer(async (request, response) => {
    let path;
    try {
      path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    } catch {
      response.writeHead(400).end('not an address');
      return;
    }
    if (path.endsWith('/')) path += 'index.html';
    const file = join(folder, path);
    const found = await stat(file).catch(() => undefined);
    if (!found?.isFile()) {
      response.writeHead(404).end('not found');
      return;
    }
    response.writeHead(200, { 'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream', 'Cache-Control': caching, ...(isolated && ISOLATION) });
    pipeline(createReadStream(file), response, () => {}); // a request may end early
  });
  await new Promise((resolve, reject) => server.once('error', reject).listen(port, 'localhost', resolve));
  return { url: `http://localhost:${server.address().port}/`, close: () => new Promise((resolve) => { server.close(resolve); server.closeAllConnections(); }) };
}

export const built = fileURLToPath(new URL('../../build/web/page', import.meta.url));

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const at = process.argv.indexOf('--port');
  const { url } = await serve(built, { port: at > 0 ? Number(process.argv[at + 1]) : 8080, isolated: !process.argv.includes('--plain') });
  console.log(url);
}
