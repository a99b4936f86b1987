// The demo scan: computed by workers, as the DICOM files of a folder.
import type { ScanFile } from 'marrow-wasm';
import { DIMS } from './head';

export interface Range { first: number; step: number }
export interface DemoSlice { k: number; file: Uint8Array<ArrayBuffer> }

/** The files of the demo scan. */
export async function demoScan(
  onProgress: (fraction: number) => void, signal: AbortSignal): Promise<ScanFile[]> {
  const files: ScanFile[] = new Array(DIMS[2]), workers = Math.min(navigator.hardwareConcurrency || 1, 4);
  let done = 0;
  const compute = (range: Range) => new Promise<void>((resolve, reject) => {
    signal.throwIfAborted();
    const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    signal.addEventListener('abort', () => {
      worker.terminate();
      reject(signal.reason);
    });
    worker.onmessage = ({ data }: MessageEvent<DemoSlice | 'done'>) => {
      if (data === 'done') {
        worker.terminate();
        resolve();
        return;
      }
      files[data.k] = { path: `demo-head/${String(data.k + 1).padStart(3, '0')}.dcm`, data: new Blob([data.file]) };
      onProgress(++done / files.length);
    };
    worker.onerror = ({ message = 'its script cannot be loaded; reload the page' }) =>
      reject(new Error(`The demo scan could not be computed: ${message}`));
    worker.postMessage(range);
  });
  await Promise.all(Array.from({ length: workers }, (_, first) => compute({ first, step: workers })));
  return files;
}
