// Keeps the files of the page, and adds the headers that isolate it and its workers, so that threads work on any server.
export {}; // a module, so that its names are its own

const worker = self as unknown as ServiceWorkerGlobalScope;

// The build puts the policy, the names of the files to keep, and a version that changes with them here. The modules for one thread are
// not among them: pages that this worker answers are isolated, and use those for several.
declare const POLICY: string;
declare const FILES: string[];
declare const VERSION: string;
// Another folder of the site may have a page and a worker of its own. A scope has no space, so its names are not those of another.
const MINE = `marrow ${worker.registration.scope} `;
const CACHE = `${MINE}${VERSION}`;

// A newer worker waits until all pages of this one are closed: they load some of its files only when needed.
worker.addEventListener('install', (event) => {
  // The browser's own cache may still have the page of the version before. The other names change with what is in the files.
  const newest = FILES.map((file) => new Request(file, { cache: file.startsWith('assets/') ? 'default' : 'reload' }));
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(newest)));
});

worker.addEventListener('activate', (event) => {
  const forgetOlder = caches.keys().then((names) => Promise.all(names.filter((n) => n.startsWith(MINE) && n !== CACHE).map((n) => caches.delete(n))));
  // The page of the first visit has no worker yet.
  event.waitUntil(forgetOlder.then(() => worker.clients.claim()));
});

worker.addEventListener('fetch', (event) => {
  const { request } = event;
  if (request.method !== 'GET' || new URL(request.url).origin !== location.origin) return;
  event.respondWith(answer(request));
});

async function answer(request: Request): Promise<Response> {
  const cache = await caches.open(CACHE);
  const response = (await cache.match(request, { ignoreSearch: true })) ?? (await fetch(request));
  if (response.type === 'opaqueredirect') return response; // the browser follows it
  const headers = new Headers(response.headers);
  headers.set('Cross-Origin-Opener-Policy', 'same-origin');
  headers.set('Cross-Origin-Embedder-Policy', 'require-corp');
  headers.set('Cross-Origin-Resource-Policy', 'same-origin');
  headers.set('Content-Security-Policy', POLICY);
  return new Response(response.body, { status: response.status, statusText: response.statusText, headers });
}
