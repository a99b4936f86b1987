// Talks to a worker that runs the WebAssembly.
import { MarrowError, cancelled } from './errors.mjs';
import { checked } from './options.mjs';

const inNode = typeof process === 'object' && process.versions?.node !== undefined && typeof window === 'undefined' &&
  typeof importScripts === 'undefined';

let setup = {};
let idle;  // a worker that waits for work, if there is one

/** Options of prepare(). */
export function configure(given) {
  setup = { ...setup, ...given };
}

export function canUseThreads() {
  return globalThis.crossOriginIsolated === true;  // node does not state it, and gets one thread
}

/** Whether a worker can look at memory of the caller while it is busy. */
export const canShareMemory = () => inNode || canUseThreads();

export function chosenThreads() {
  if (!canUseThreads()) return 1;
  return Math.max(1, setup.threads ?? Math.min(8, globalThis.navigator?.hardwareConcurrency ?? 1));
}

const NodeWorker = inNode ? (await import('node:worker_threads')).Worker : undefined;

function startWorker() {
  if (inNode) {
    const worker = new NodeWorker(new URL('./worker.mjs', import.meta.url));
    return {
      post: (message, transfer) => worker.postMessage(message, transfer),
      listen: (onMessage, onFailure) => worker.on('message', onMessage).on('error', onFailure),
      end: () => worker.terminate(),
      // Only work under way keeps the process alive.
      keepAlive: (wanted) => (wanted ? worker.ref() : worker.unref()),
    };
  }
  const worker = new Worker(new URL('./worker.mjs', import.meta.url), { type: 'module' });
  return {
    post: (message, transfer) => worker.postMessage(message, transfer),
    listen: (onMessage, onFailure) => {
      worker.onmessage = (event) => onMessage(event.data);
      worker.onerror = (event) => {
        // There is no message if the script was not loaded, as after a newer page took its place.
        onFailure(new Error(event.message ?? 'its script cannot be loaded; reload the page'));
      };
    },
    end: () => worker.terminate(),
    keepAlive: () => {},
  };
}

/** A worker, and the calls that it has not answered yet. */
export class Engine {
  /** A worker that waits for work, or a new one. With `codecs`, one that decodes images. */
  static take({ codecs = false } = {}) {
    if (!idle || (codecs && !idle.codecs)) return new Engine({ codecs });
    const engine = idle;
    idle = undefined;
    return engine;
  }

  #worker = startWorker();
  #calls = new Map();
  #last = 0;
  #end;  // why the worker ended, once it has

  constructor({ codecs = false } = {}) {
    this.codecs = codecs;
    this.#worker.listen((message) => this.#receive(message), (error) => this.#fail(error));
    this.#worker.keepAlive(false);
    this.ready = this.call('start', {
      threads: chosenThreads(),
      shared: canUseThreads(),
      stoppable: canShareMemory(),
      codecs,
      baseUrl: setup.baseUrl === undefined ? undefined : new URL(setup.baseUrl, globalThis.location?.href).href,
    });
    // A worker that did not start is of no use again. The calls that wait for it reject with the same reason.
    this.ready.catch((error) => this.#finish(error));
  }

  /**
   * Asks the worker for something. `latest` names a kind of requests of which only the newest waits: it takes the place
   * of an older one, which rejects. With `abandon`, a signal does not end the worker. A busy worker hears of nothing, but where it
   * can look at memory of the caller, it stops this request; elsewhere it goes on to the request's end.
   */
  call(name, parameters = {}, { transfer = [], onProgress, signal, latest, abandon } = {}) {
    if (this.#end) return Promise.reject(this.#end);
    if (signal?.aborted) return Promise.reject(cancelled());
    return new Promise((resolve, reject) => {
      checked({ onProgress, signal });
      const id = ++this.#last;
      const stop = abandon && signal && canShareMemory() ? new Int32Array(new SharedArrayBuffer(4)) : undefined;
      const abort = () => {
        if (!abandon) return this.cancel();
        if (stop) Atomics.store(stop, 0, 1);
        this.tell('forget', { call: id });
        this.#receive({ id, error: { message: 'cancelled', code: 130 } });
      };
      signal?.addEventListener('abort', abort, { once: true });
      this.#calls.set(id, { resolve, reject, onProgress, unlisten: () => signal?.removeEventListener('abort', abort) });
      if (this.#calls.size === 1) this.#worker.keepAlive(true);
      this.#worker.post({ id, name, parameters, latest, stop, progress: onProgress !== undefined }, transfer);
    });
  }

  /** Tells the worker something that needs no answer. */
  tell(name, parameters, transfer = []) {
    if (!this.#end) this.#worker.post({ name, parameters }, transfer);
  }

  /** Ends the worker at once. What it did not answer rejects with code 130. */
  cancel() {
    this.#finish(cancelled());
  }

  /** Keeps the worker for the next task, if no other one waits already. */
  giveBack() {
    if (this.#end || this.#calls.size > 0 || idle) this.cancel();
    else idle = this;
  }

  get ended() {
    return this.#end !== undefined;
  }

  #receive({ id, result, error, progress }) {
    const call = this.#calls.get(id);
    if (!call) return;
    if (progress !== undefined) {
      call.onProgress?.(progress);
      return;
    }
    this.#calls.delete(id);
    if (this.#calls.size === 0) this.#worker.keepAlive(false);
    call.unlisten();
    if (error) call.reject(Object.assign(new MarrowError(error.message, error.code), error.needsCodecs && { needsCodecs: true }));
    else call.resolve(result);
    if (error?.broken) this.#fail(error);
  }

  // The worker itself failed, as by running out of memory. Later calls are about the scan that it had.
  #fail(error) {
    const message = `the worker stopped: ${error.message}`;
    this.#finish(new MarrowError(message, 3), new MarrowError(`${message}; open the scan again`, 3));
  }

  #finish(error, later = error) {
    if (this.#end) return;
    this.#end = later;
    if (idle === this) idle = undefined;
    this.#worker.end();
    for (const call of this.#calls.values()) {
      call.unlisten();
      call.reject(error);
    }
    this.#calls.clear();
  }
}

/** Starts a worker ahead of its first use. */
export async function prepareEngine() {
  idle ??= new Engine();
  await idle.ready;
}
