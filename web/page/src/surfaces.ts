// Keeps the surface up to date with the controls: a preview first, then full resolution, then what is done to it.
import type { Crop, Mesh, Scan, StepResult } from 'marrow-wasm';
import { Extractor, MarrowError, check, keepComponents, labels, measure, simplify, smooth } from 'marrow-wasm';
import { named } from './scan/label_table';
import type { State, Store, Surface } from './state';

/** Previews have at most this many samples, so that they are ready within a frame or two. */
const PREVIEW_SAMPLES = 1.5e6;
/** A full extraction that takes less, ms, needs no preview. */
const SHORT = 50;

interface Request {
  isovalue: number; closed: boolean; topology: boolean; largest: boolean; smooth: number; keep: number; crop: Crop | undefined;
}

const requestOf = (s: Readonly<State>): Request =>
  ({ isovalue: s.isovalue, closed: s.closed, topology: s.topology, largest: s.largest, smooth: s.smooth, keep: s.keep, crop: s.crop });

const isCancelled = (error: unknown): boolean => error instanceof MarrowError && error.code === 130;

export class Surfaces {
  private extractor: Extractor | undefined;
  private previewLevel = 0;
  private fullMs = Infinity; // of the last extraction in full resolution
  private wanted: Request | undefined;
  private running = false;
  private full = new AbortController(); // cancels an extraction in full resolution of which there is a preview
  private steps = new AbortController(); // cancels smoothing, reduction and checks, which may take long
  private labelWork = new AbortController();

  /** `slow()` says whether the screen cannot draw full resolution while the isovalue moves. */
  constructor(private readonly store: Store, private readonly slow: () => boolean, private readonly moving: () => boolean,
              private readonly fail: (error: unknown) => void) {
    store.on(['scan', 'asLabels', 'isovalue', 'closed', 'topology', 'largest', 'smooth', 'keep', 'crop'], () => this.update());
    store.on(['scan', 'asLabels', 'relax', 'crop'], () => void this.updateLabels());
    store.on(['scan'], () => this.forget());
  }

  /** Requests what is missing, for instance full resolution at the end of a drag. */
  update(): void {
    const s = this.store.state;
    this.full.abort();
    this.steps.abort();
    this.wanted = undefined;
    if (!s.scan || s.asLabels) return;
    this.wanted = requestOf(s);
    this.store.set({ exact: false, light: { state: 'busy', text: '' } });
    if (!this.running) void this.run();
  }

  private forget(): void {
    this.extractor?.dispose();
    this.extractor = undefined;
    this.fullMs = Infinity;
    this.store.set({ surface: undefined, measures: undefined, labelSurfaces: [], note: '' });
  }

  // One request after another; of those that came meanwhile, only the newest.
  private async run(): Promise<void> {
    this.running = true;
    while (this.wanted) {
      const request = this.wanted;
      this.wanted = undefined;
      try {
        await this.answer(request);
      } catch (error) {
        if (!isCancelled(error)) this.report(error);
      }
    }
    this.running = false;
  }

  // What is on the screen stays there, and does not match the controls.
  private report(error: unknown): void {
    if (!this.wanted) this.store.set({ light: { state: 'bad', text: 'failed' } });
    this.fail(error);
  }

  private async answer(request: Request): Promise<void> {
    const extractor = await this.extractorFor(request);
    let preview: Mesh | undefined;
    if (this.previewLevel > 0 && (this.fullMs > SHORT || (this.slow() && this.moving()))) {
      const level = this.previewLevel;
      const coarse = await extractor.extract(request.isovalue, { level });
      preview = request.largest ? (await keepComponents(coarse, { largest: true })).mesh : coarse;
      this.show({ mesh: preview, isovalue: request.isovalue, level, refined: request.largest });
      if (this.wanted || (this.slow() && this.moving())) return;
    }
    const started = performance.now();
    // What is short is drawn in any case; else a steady drag would show nothing.
    this.full = new AbortController();
    const full = await extractor.extract(request.isovalue, preview ? { signal: this.full.signal } : {});
    this.fullMs = performance.now() - started;
    this.store.set({ extractMs: full.stats.extractMs });
    await this.refine(full, this.slow() ? preview : undefined, request, extractor.scan);
  }

  private async refine(full: Mesh, preview: Mesh | undefined, request: Request, scan: Scan): Promise<void> {
    const { isovalue } = request, long = request.smooth > 0 || request.keep < 100;
    const { signal } = (this.steps = new AbortController());
    const notes: string[] = [];
    let mesh = full;
    const step = async (text: string, work: Promise<StepResult>) => {
      if (long && !signal.aborted) this.store.set({ light: { state: 'busy', text } });
      const result = await work;
      mesh = result.mesh;
      if (result.note) notes.push(result.note);
    };
    if (request.largest) await step('components', keepComponents(mesh, { largest: true }));
    if (long) this.show({ mesh, isovalue, level: 0, refined: true, preview });
    if (request.smooth > 0) await step('smoothing', smooth(mesh, { iterations: request.smooth, signal }));
    if (request.keep < 100)
      await step('reducing', simplify(mesh, { keep: request.keep / 100, scan, signal }));
    if (this.wanted && long) return;
    const refined = request.largest || long;
    this.show({ mesh, isovalue, level: 0, refined, preview }, !this.wanted);
    this.store.set({ note: notes.join('; ') });
    if (!this.wanted) await this.measure(mesh, long, signal);
  }

  private async measure(mesh: Mesh, mayIntersect: boolean, signal: AbortSignal): Promise<void> {
    const measures = await measure(mesh);
    const current = () => this.store.state.surface?.mesh === mesh && this.store.state.exact && !this.wanted;
    if (!current()) return;
    const open = measures.boundaryEdges > 0, manifold = measures.nonmanifoldEdges === 0;
    const none = measures.triangles === 0;
    this.store.set({ measures: { ...measures, mesh } });
    if (none || open || !manifold || !mayIntersect) {
      const text = none ? 'no surface' : open ? 'open at the border' : manifold ? 'watertight' : 'not manifold';
      this.store.set({ light: { state: none || open || !manifold ? 'bad' : 'good', text } });
      return;
    }
    this.store.set({ light: { state: 'busy', text: 'checking' } });
    const result = await check(mesh, { signal });
    if (!current()) return;
    this.store.set({ light: result.sound ? { state: 'good', text: 'watertight' } :
      { state: 'bad', text: result.selfIntersections > 0 ? 'intersects itself' : 'not sound' } });
  }

  private show(surface: Surface, exact = false): void {
    if (this.store.state.asLabels || this.extractor?.scan !== this.store.state.scan) return;
    const old = this.store.state.surface;
    this.store.set({ surface, exact });
    for (const mesh of [old?.mesh, old?.preview]) {
      const stays = mesh === surface.mesh || mesh === surface.preview;
      if (mesh && !stays && mesh.points.length > 0) this.extractor?.recycle(mesh);
    }
  }

  private async extractorFor(request: Request): Promise<Extractor> {
    const scan = this.store.state.scan!;
    const e = this.extractor;
    const { closed, topology, crop } = request;
    if (e?.scan === scan && e.options.closed === closed && e.options.topology === topology && e.options.crop === crop) return e;
    e?.dispose();
    this.extractor = undefined;
    const made = await Extractor.create(scan, { closed, topology, ...(crop && { crop }) });
    this.extractor = made;
    this.previewLevel = 0;
    const samples = (level: number) => made.dims(level).reduce((a, b) => a * b, 1);
    while (samples(this.previewLevel) > PREVIEW_SAMPLES && Math.min(...made.dims(this.previewLevel + 1)) >= 8) ++this.previewLevel;
    return made;
  }

  private async updateLabels(): Promise<void> {
    const s = this.store.state;
    this.labelWork.abort();
    if (!s.scan || !s.asLabels) return;
    const { signal } = (this.labelWork = new AbortController());
    const light = { state: 'busy', text: 'extracting' } as const;
    this.store.set({ exact: false, light, measures: undefined, surface: undefined });
    try {
      const found = await labels(s.scan, { relax: s.relax, ...(s.crop && { crop: s.crop }), signal,
        onProgress: (f) => { if (!signal.aborted) this.store.set({ light: { state: 'busy', text: `extracting ${Math.round(f * 100)} %` } }); } });
      if (signal.aborted || this.store.state.scan !== s.scan) return;
      const labelSurfaces = named(found, this.store.state.table);
      this.store.set({ labelSurfaces, exact: true, light: { state: 'good', text: 'closed' } });
    } catch (error) {
      if (!isCancelled(error)) this.report(error);
    }
  }
}
