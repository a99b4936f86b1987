// Mouse, touch and keys on a slice.
import type { Crop } from 'marrow-wasm';
import type { Vec3 } from '../scan/geometry';
import { clampIndex, toPhysical } from '../scan/geometry';
import type { Point } from './slice_geometry';
import type { SliceView } from './slice_view';

type Drag = 'crosshair' | 'window' | 'pan' | { axis: number; upper: boolean }[];

export function listenToSlice(view: SliceView, canvas: HTMLCanvasElement): void {
  const { element, store, zoom } = view;
  const pointers = new Map<number, Point>();
  let drag: Drag | undefined;
  let moved = false;

  const at = (e: { clientX: number; clientY: number }): Point => {
    const r = canvas.getBoundingClientRect();
    return [e.clientX - r.left, e.clientY - r.top];
  };
  const setCrosshair = (p: Point) => store.set({ crosshair: clampIndex(store.state.geometry!, view.indexAt(p)) });

  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('pointerdown', (e) => {
    if (!store.state.geometry || !view.geometry) return;
    const p = at(e);
    pointers.set(e.pointerId, p);
    canvas.setPointerCapture(e.pointerId);
    element.focus({ preventScroll: true });
    moved = false;
    if (pointers.size > 1) drag = undefined; // two fingers zoom and pan
    else if (e.button === 2) drag = 'window';
    else if (e.button === 1 || e.shiftKey) drag = 'pan';
    else if (store.state.tool === 'crop') drag = sidesAt(view, p, e.pointerType === 'touch' ? 24 : 12);
    else if (store.state.tool === 'navigate') { drag = 'crosshair'; setCrosshair(p); }
  });
  canvas.addEventListener('pointermove', (e) => {
    const p = at(e), last = pointers.get(e.pointerId);
    if (!last) return view.setPointer(p);
    const dx = p[0] - last[0], dy = p[1] - last[1];
    if (Math.hypot(dx, dy) > 3) moved = true;
    if (pointers.size > 1) pinch(view, pointers, e.pointerId, p);
    else if (drag === 'crosshair') setCrosshair(p);
    else if (drag === 'pan') { view.pan = [view.pan[0] + dx, view.pan[1] + dy]; view.draw(); }
    else if (drag === 'window') changeWindow(view, dx, dy);
    else if (Array.isArray(drag)) moveSides(view, drag, view.indexAt(p));
    if (drag !== undefined || pointers.size > 1) pointers.set(e.pointerId, p);
  });
  const end = (e: PointerEvent) => {
    if (pointers.delete(e.pointerId) && !moved && e.type === 'pointerup' && e.button === 0 && store.state.tool === 'distance')
      pick(view, toPhysical(store.state.geometry!, view.onSlice(clampIndex(store.state.geometry!, view.indexAt(at(e))))));
    if (pointers.size === 0) drag = undefined;
  };
  canvas.addEventListener('pointerup', end);
  canvas.addEventListener('pointercancel', end);
  canvas.addEventListener('pointerleave', () => view.setPointer(undefined));
  canvas.addEventListener('wheel', (e) => {
    e.preventDefault();
    if (e.ctrlKey) zoom.set(zoom.factor * Math.exp(-e.deltaY / 300));
    else view.step(-Math.sign(e.deltaY) * direction(view));
  }, { passive: false });
  element.addEventListener('keydown', (e) => {
    if (e.altKey || e.metaKey || e.ctrlKey) return;
    const steps: Record<string, number> = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 };
    if (e.key === 'Home' || e.key === 'End') view.step((e.key === 'End' ? 1 : -1) * direction(view) * 1e6);
    else if (e.key in steps) view.step(steps[e.key]! * direction(view));
    else if (e.key === '+' || e.key === '=') zoom.set(zoom.factor * 1.25);
    else if (e.key === '-') zoom.set(zoom.factor / 1.25);
    else return;
    e.preventDefault();
  });
}

// +1 where the index grows to the left, posterior or superior, so that keys do the same in every scan.
function direction(view: SliceView): 1 | -1 {
  const g = view.store.state.geometry!, axis = view.geometry!.through;
  const patient = view.plane === 'axial' ? 2 : view.plane === 'coronal' ? 1 : 0;
  return g.direction[patient]![axis]! < 0 ? -1 : 1;
}

function changeWindow(view: SliceView, dx: number, dy: number): void {
  const { window: { lower, upper }, scan } = view.store.state;
  const all = scan!.histogram.upper - scan!.histogram.lower || 1, step = all / 1000;
  const width = Math.max(upper - lower + dx * step, all / 500), level = (lower + upper) / 2 - dy * step;
  view.store.set({ window: { lower: level - width / 2, upper: level + width / 2 } });
}

function pinch(view: SliceView, pointers: Map<number, Point>, id: number, p: Point): void {
  const [, other] = [...pointers].find(([key]) => key !== id)!;
  const last = pointers.get(id)!;
  const before = Math.hypot(last[0] - other[0], last[1] - other[1]), after = Math.hypot(p[0] - other[0], p[1] - other[1]);
  view.pan = [view.pan[0] + (p[0] - last[0]) / 2, view.pan[1] + (p[1] - last[1]) / 2];
  view.zoom.set(view.zoom.factor * (before > 0 ? after / before : 1));
}

function pick(view: SliceView, position: Vec3): void {
  const { picked, distances } = view.store.state;
  if (!picked) view.store.set({ picked: position });
  else view.store.set({ picked: undefined, distances: [...distances, { from: picked, to: position }] });
}

/** The crop box, or the whole scan without one. */
export function cropOf(dims: Vec3, crop: Crop | undefined): Crop {
  return crop ?? { first: [0, 0, 0], last: dims.map((n) => n - 1) as Vec3 };
}

/** Moves a side so that `sample` is its outer sample; it stays in the scan and off the opposite side. */
export function movedCrop(dims: Vec3, crop: Crop | undefined, axis: number, upper: boolean, sample: number): Crop | undefined {
  const box = cropOf(dims, crop), first: Vec3 = [...box.first], last: Vec3 = [...box.last], end = dims[axis]! - 1;
  const clamp = (low: number, high: number) => Math.min(Math.max(Math.round(sample), low), Math.max(low, high));
  if (upper) last[axis] = clamp(Math.min(first[axis]! + 1, end), end);
  else first[axis] = clamp(0, last[axis]! - 1);
  const whole = first.every((v) => v === 0) && last.every((v, a) => v === dims[a]! - 1);
  return whole ? undefined : { first, last };
}

// The sides of the box near a point of the slice: none, one, or the two of a corner.
function sidesAt(view: SliceView, p: Point, reach: number): { axis: number; upper: boolean }[] {
  const { crop, geometry } = view.store.state, box = cropOf(geometry!.dims, crop), here = view.indexAt(p);
  const sides: { axis: number; upper: boolean }[] = [];
  for (const axis of [view.geometry!.across, view.geometry!.down]) {
    const away = (border: number) => {
      const index: Vec3 = [...here];
      index[axis] = border;
      const q = view.toScreen(index);
      return Math.hypot(q[0] - p[0], q[1] - p[1]);
    };
    const low = away(box.first[axis]! - 0.5), high = away(box.last[axis]! + 0.5);
    if (Math.min(low, high) <= reach) sides.push({ axis, upper: high < low });
  }
  return sides;
}

function moveSides(view: SliceView, sides: { axis: number; upper: boolean }[], index: Vec3): void {
  const { geometry } = view.store.state;
  let crop = view.store.state.crop;
  for (const { axis, upper } of sides) crop = movedCrop(geometry!.dims, crop, axis, upper, index[axis]! + (upper ? -0.5 : 0.5));
  if (JSON.stringify(crop) !== JSON.stringify(view.store.state.crop)) view.store.set({ crop });
}
