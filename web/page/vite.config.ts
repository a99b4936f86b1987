// Builds the page as static files: with a Content-Security-Policy, and with a service worker that knows all of them.
import { createHash } from 'node:crypto';
import { fileURLToPath } from 'node:url';
import type { Plugin } from 'vite';
import { defineConfig } from 'vite';
import { POLICY } from './policy.mjs';

function securityPolicy(): Plugin {
  return {
    name: 'security-policy', apply: 'build',
    transformIndexHtml: () => [{ tag: 'meta', attrs: { 'http-equiv': 'Content-Security-Policy', content: POLICY }, injectTo: 'head-prepend' }],
  };
}

// The modules for one thread. Where the service worker works, pages are isolated and load the others.
const ONE_THREAD = /\/marrow(-codecs)?-[\w-]{8}\.(mjs|wasm)$/;

// Tells the service worker the policy, the names of the files to keep, and a version that changes when one of them does.
function fileList(): Plugin {
  return {
    name: 'file-list', apply: 'build', enforce: 'post',
    generateBundle(_options, bundle) {
      const worker = bundle['sw.js'];
      if (worker?.type !== 'chunk') return;
      const names = Object.keys(bundle).filter((name) => name !== 'sw.js').sort(), hash = createHash('sha256');
      for (const name of names) {
        const file = bundle[name]!;
        hash.update(name).update(file.type === 'chunk' ? file.code : file.source);
      }
      const kept = names.filter((name) => !ONE_THREAD.test(name));
      worker.code = worker.code.replaceAll(/\bFILES\b/g, JSON.stringify(['./', ...kept])).replaceAll(/\bVERSION\b/g, JSON.stringify(hash.digest('hex').slice(0, 12)))
        .replaceAll(/\bPOLICY\b/g, JSON.stringify(POLICY));
    },
  };
}

export default defineConfig({
  base: './',
  // The package as `make web` builds it, with the WebAssembly; its sources have only the types.
  resolve: { alias: { 'marrow-wasm': fileURLToPath(new URL('../../build/web/marrow-wasm/index.mjs', import.meta.url)) } },
  plugins: [securityPolicy(), fileList()],
  worker: { format: 'es' },
  build: {
    outDir: '../../build/web/page',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      input: { page: 'index.html', sw: 'src/service_worker.ts' },
      output: { entryFileNames: (chunk) => (chunk.name === 'sw' ? 'sw.js' : 'assets/[name]-[hash].js') },
    },
  },
  server: { headers: { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' }, fs: { allow: ['../..'] } },
});
