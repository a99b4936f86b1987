// Keeps the page for the next visit without a network, and makes it isolated, which threads need.
import { isOpening } from './scan/open';

/** Starts the service worker. A page from disk has none. */
export async function startOffline(): Promise<void> {
  if (import.meta.env.DEV || !('serviceWorker' in navigator) || !location.protocol.startsWith('http')) return;
  const registration = await navigator.serviceWorker.register(new URL('sw.js', document.baseURI), { updateViaCache: 'none' }).catch(() => undefined);
  if (!registration || crossOriginIsolated) return;
  // A server that does not send the two headers leaves the page with one thread. The worker adds them, so load the page
  // once more as soon as the worker has taken over, unless a scan is open or on its way.
  await navigator.serviceWorker.ready;
  if (navigator.serviceWorker.controller === null) await new Promise((resolve) => navigator.serviceWorker.addEventListener('controllerchange', resolve, { once: true }));
  const again = `marrow-isolated ${registration.scope}`; // another folder of the site may have a page of its own
  const isUsed = isOpening() || document.body.classList.contains('open') || document.querySelector('.banner');
  if (isUsed || sessionStorage.getItem(again)) return;
  sessionStorage.setItem(again, 'tried');
  location.reload();
}
