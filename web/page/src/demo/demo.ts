// The demo scan: computed by a worker, as the DICOM files of a folder.
import type { ScanFile } from 'marrow-wasm';

/** The files of the demo scan. */
export function demoScan(): Promise<ScanFile[]> {
  const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
  return new Promise<ScanFile[]>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<Uint8Array<ArrayBuffer>[]>) =>
      resolve(data.map((file, k) => ({ path: `demo-head/${String(k + 1).padStart(3, '0')}.dcm`, data: new Blob([file]) })));
    worker.onerror = (event) => reject(new Error(`The demo scan could not be computed: ${event.message}`));
    worker.postMessage('start');
  }).finally(() => worker.terminate());
}
