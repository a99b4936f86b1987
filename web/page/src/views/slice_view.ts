// One slice: its samples, the contours of the surfaces, the crosshair, distances and the crop box.
import type { Crop, Mesh, Slice } from 'marrow-wasm';
import { MarrowError, contour } from 'marrow-wasm';
import { distanceText } from '../distances';
import type { Vec3 } from '../scan/geometry';
import { clampIndex, toIndexSpace, toPhysical } from '../scan/geometry';
import { labelsOf } from '../scan/label_table';
import type { Store } from '../state';
import { isInteger } from '../state';
import { croppedContour, meshContour } from './contours';
import type { Plane, Point, SliceGeometry } from './slice_geometry';
import { PLANES, applyInverse, applyLinear, sliceGeometry, toIndex, toSlice } from './slice_geometry';
import { cropOf, listenToSlice } from './slice_input';

/** Which part of the slices is seen; all slices zoom together. */
export class SliceZoom {
  factor = 1;
  readonly listeners: (() => void)[] = [];
  set(factor: number): void {
    this.factor = Math.min(Math.max(factor, 1), 40);
    for (const listener of this.listeners) listener();
  }
}

const CONTOUR = '#ffb02e'; // as the line in the histogram: a surface of the colour of bone would not show on bone

interface Outline { lines: Float32Array; colour: string; inData: boolean }

export class SliceView {
  private readonly canvas = document.createElement('canvas');
  private readonly image = document.createElement('canvas'); // the samples as greys
  private readonly corners: Record<string, HTMLElement> = {};
  private slice: Slice | undefined;
  private loadedFrom: unknown; // the scan
  private outlines: Outline[] = [];
  private loading = false;
  private frame = 0;
  private imageIsStale = true;
  private outlinesAreStale = true;
  geometry: SliceGeometry | undefined;
  pan: Point = [0, 0]; // pixels
  private pointer: Vec3 | undefined; // the index under it

  constructor(readonly element: HTMLElement, readonly plane: Plane, readonly store: Store, readonly zoom: SliceZoom,
              private readonly fail: (error: unknown) => void) {
    element.prepend(this.canvas);
    this.canvas.setAttribute('aria-hidden', 'true');
    for (const place of ['tl', 'tr', 'bl', 'br', 'n', 's', 'w', 'e']) {
      const corner = document.createElement('div');
      corner.className = `corner ${place}`;
      element.append(corner);
      this.corners[place] = corner;
    }
    this.corners['tl']!.textContent = plane[0]!.toUpperCase() + plane.slice(1);
    store.on(['scan'], () => this.start());
    store.on(['crosshair'], () => void this.load());
    store.on(['window', 'asLabels', 'table'], () => { this.imageIsStale = true; this.draw(); });
    store.on([
      'isovalue', 'surface', 'exact', 'labelSurfaces', 'hidden', 'crop', 'closed', 'topology', 'asLabels',
    ], () => { this.outlinesAreStale = true; this.draw(); });
    store.on(['distances', 'picked', 'tool'], () => this.draw());
    zoom.listeners.push(() => { if (zoom.factor === 1) this.pan = [0, 0]; this.draw(); });
    new ResizeObserver(() => this.draw()).observe(element);
    listenToSlice(this, this.canvas);
  }

  private start(): void {
    const g = this.store.state.geometry;
    this.slice = undefined;
    this.outlines = [];
    this.pan = [0, 0];
    this.geometry = g && sliceGeometry(g, this.plane);
    if (!this.geometry) return;
    this.corners['w']!.textContent = this.geometry.left;
    this.corners['e']!.textContent = this.geometry.right;
    this.corners['n']!.textContent = this.geometry.top;
    this.corners['s']!.textContent = this.geometry.bottom;
    void this.load();
  }

  // Loads the slice through the crosshair; of several requests, the newest.
  private async load(): Promise<void> {
    if (this.loading) return this.draw();
    this.loading = true;
    try {
      for (;;) {
        const { scan, crosshair } = this.store.state, axis = this.geometry?.through as 0 | 1 | 2 | undefined;
        if (!scan || axis === undefined) break;
        const index = Math.round(crosshair[axis]!);
        if (this.slice?.axis === axis && this.slice.index === index && this.loadedFrom === scan) break;
        const replaced = () => this.store.state.scan !== scan;
        // A scan that was replaced rejects what it has not answered.
        const slice = await scan.slice(axis, index).catch((error) => { if (!replaced()) throw error; });
        if (!slice || replaced()) continue;
        this.slice = slice;
        this.loadedFrom = scan;
        this.imageIsStale = this.outlinesAreStale = true;
      }
    } catch (error) {
      if (!(error instanceof MarrowError && error.code === 130)) this.fail(error);
    }
    this.loading = false;
    this.draw();
  }
  draw(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.render());
  }

  /** The index axes of the columns and rows of the slice's samples. */
  private dataAxes(): [number, number] {
    const axis = this.geometry!.through;
    return axis === 0 ? [1, 2] : axis === 1 ? [0, 2] : [0, 1];
  }

  /** Where an index is on the screen, in pixels of CSS. */
  toScreen(index: Vec3): Point {
    const { middle, factor } = this.placement();
    const [x, y] = applyLinear(this.geometry!.toMm, toSlice(this.geometry!, index));
    return [(x - middle[0]) * factor + this.canvas.clientWidth / 2 + this.pan[0], (y - middle[1]) * factor + this.canvas.clientHeight / 2 + this.pan[1]];
  }

  /** The index of a point on the screen, within this slice. */
  indexAt([px, py]: Point): Vec3 {
    const { middle, factor } = this.placement();
    const x = (px - this.canvas.clientWidth / 2 - this.pan[0]) / factor + middle[0];
    const y = (py - this.canvas.clientHeight / 2 - this.pan[1]) / factor + middle[1];
    return toIndex(this.geometry!, applyInverse(this.geometry!.toMm, [x, y]), this.store.state.crosshair);
  }

  /** An index moved to the slice that is shown: the crosshair may be between two. */
  onSlice(index: Vec3): Vec3 {
    const moved: Vec3 = [...index];
    if (this.slice) moved[this.slice.axis] = this.slice.index;
    return moved;
  }

  // The middle of the slice, mm, and pixels in a mm: the whole slice fits, with a margin for the letters.
  private placement(): { middle: Point; factor: number } {
    const s = this.geometry!, corners = [[-0.5, -0.5], [s.size[0] - 0.5, -0.5], [-0.5, s.size[1] - 0.5], [s.size[0] - 0.5, s.size[1] - 0.5]]
      .map((c) => applyLinear(s.toMm, c as Point));
    const range = (a: 0 | 1) => [Math.min(...corners.map((c) => c[a])), Math.max(...corners.map((c) => c[a]))] as const;
    const [x0, x1] = range(0), [y0, y1] = range(1);
    const fit = Math.min((this.canvas.clientWidth - 4) / (x1 - x0), (this.canvas.clientHeight - 4) / (y1 - y0));
    return { middle: [(x0 + x1) / 2, (y0 + y1) / 2], factor: Math.max(fit, 1e-6) * this.zoom.factor };
  }

  setPointer(at: Point | undefined): void {
    this.pointer = at && this.geometry ? this.indexAt(at) : undefined;
    this.showValue();
  }

  /** Shows the value under the pointer, or else at the crosshair. */
  private showValue(): void {
    const { scan, crosshair } = this.store.state, s = this.slice;
    if (!scan || !s || !this.geometry) return;
    const [c, r] = this.dataAxes(), at = this.pointer ?? crosshair;
    const column = Math.round(at[c]!), row = Math.round(at[r]!);
    const value = column >= 0 && row >= 0 && column < s.width && row < s.height ? s.samples[row * s.width + column] : undefined;
    const label = scan.unit === 'labels' ? labelsOf(this.store.state).find((l) => l.label === value)?.name : undefined;
    const number = value === undefined || isInteger(scan) ? value : Number(value.toPrecision(6));
    const unit = scan.unit === 'HU' ? ' HU' : '';
    this.corners['bl']!.textContent = number === undefined ? '' : label ?? `${number}${unit}`;
  }

  private render(): void {
    this.frame = 0;
    const { clientWidth: w, clientHeight: h } = this.canvas, ratio = devicePixelRatio;
    if (w === 0 || h === 0) return;
    if (this.canvas.width !== Math.round(w * ratio) || this.canvas.height !== Math.round(h * ratio)) {
      this.canvas.width = Math.round(w * ratio);
      this.canvas.height = Math.round(h * ratio);
    }
    const context = this.canvas.getContext('2d')!;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (!this.slice || !this.geometry) return;
    if (this.imageIsStale) this.paintImage();
    if (this.outlinesAreStale) this.trace();
    this.drawImage(context, ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawCrop(context);
    this.drawOutlines(context);
    this.drawCrosshair(context, w, h);
    this.drawDistances(context);
    this.describe();
  }

  // Greys, or the labels in their colours.
  private paintImage(): void {
    const s = this.slice!, { window: { lower, upper }, asLabels } = this.store.state;
    this.imageIsStale = false;
    this.image.width = s.width;
    this.image.height = s.height;
    const image = new ImageData(s.width, s.height), pixels = new Uint32Array(image.data.buffer);
    const factor = upper > lower ? 255 / (upper - lower) : 255;
    if (asLabels) {
      const colours = new Map(labelsOf(this.store.state).map((l) => {
        const [r, g, b] = l.colour.map((c) => Math.round(c * 150)) as Vec3;
        return [l.label, 0xff000000 | b << 16 | g << 8 | r];
      }));
      for (let i = 0; i < pixels.length; ++i) pixels[i] = colours.get(s.samples[i]!) ?? 0xff000000;
    } else {
      for (let i = 0; i < pixels.length; ++i) {
        const grey = Math.min(Math.max((s.samples[i]! - lower) * factor, 0), 255) & 255;
        pixels[i] = 0xff000000 | grey << 16 | grey << 8 | grey;
      }
    }
    this.image.getContext('2d')!.putImageData(image, 0, 0);
  }

  private indexInData(column: number, row: number): Vec3 {
    const index: Vec3 = [...this.store.state.crosshair], [c, r] = this.dataAxes();
    index[c] = column;
    index[r] = row;
    return index;
  }

  private drawImage(context: CanvasRenderingContext2D, ratio: number): void {
    // The corner of the first sample, and the steps along a row and a column.
    const origin = this.toScreen(this.indexInData(-0.5, -0.5)), right = this.toScreen(this.indexInData(0.5, -0.5)), down = this.toScreen(this.indexInData(-0.5, 0.5));
    context.setTransform((right[0] - origin[0]) * ratio, (right[1] - origin[1]) * ratio, (down[0] - origin[0]) * ratio, (down[1] - origin[1]) * ratio,
      origin[0] * ratio, origin[1] * ratio);
    context.imageSmoothingEnabled = !this.store.state.asLabels;
    context.drawImage(this.image, 0, 0);
  }

  // Where the surfaces meet the slice. The sample contours have full resolution even while the surface is a preview.
  private trace(): void {
    const { surface, exact, asLabels, labelSurfaces, hidden, isovalue, geometry } = this.store.state;
    const { crop, closed, topology } = this.store.state;
    const s = this.slice!, box = cropOf(geometry!.dims, crop);
    const meshLines = (mesh: Mesh) => meshContour(mesh, geometry!, box, this.geometry!, s.index);
    this.outlinesAreStale = false;
    if (asLabels) {
      this.outlines = labelSurfaces.filter((l) => !hidden.has(l.label)).map((l) => ({
        lines: meshLines(l), inData: false,
        colour: `rgb(${l.colour.map((c) => Math.round(90 + c * 165)).join(',')})` }));
    } else if (surface?.refined && exact) {
      this.outlines = [{ lines: meshLines(surface.mesh), colour: CONTOUR, inData: false }];
    } else {
      const lines = crop || closed ? croppedContour(s, isovalue, { closed, topology }, crop && this.range(crop)) : contour(s, isovalue, { topology });
      this.outlines = [{ lines, colour: CONTOUR, inData: true }];
    }
  }

  // The columns and rows of the slice's samples that are inside the box; nothing if the slice is outside.
  private range(crop: Crop): { first: Point; last: Point } {
    const [c, r] = this.dataAxes(), a = this.geometry!.through, at = this.slice!.index;
    const outside = at < crop.first[a]! || at > crop.last[a]!;
    return outside ? { first: [0, 0], last: [-1, -1] } : { first: [crop.first[c]!, crop.first[r]!], last: [crop.last[c]!, crop.last[r]!] };
  }

  private drawOutlines(context: CanvasRenderingContext2D): void {
    const s = this.geometry!;
    // Two corners of the screen's frame of the data, from which all other points follow.
    const frame = (inData: boolean) => {
      const at = (u: number, v: number) => this.toScreen(inData ? this.indexInData(u, v) : toIndex(s, [u, v], this.store.state.crosshair));
      const o = at(0, 0), x = at(1, 0), y = at(0, 1);
      return { o, x: [x[0] - o[0], x[1] - o[1]] as Point, y: [y[0] - o[0], y[1] - o[1]] as Point };
    };
    context.lineWidth = 1.4;
    for (const { lines, colour, inData } of this.outlines) {
      const { o, x, y } = frame(inData);
      context.beginPath();
      for (let i = 0; i < lines.length; i += 4) {
        const u0 = lines[i]!, v0 = lines[i + 1]!, u1 = lines[i + 2]!, v1 = lines[i + 3]!;
        context.moveTo(o[0] + u0 * x[0] + v0 * y[0], o[1] + u0 * x[1] + v0 * y[1]);
        context.lineTo(o[0] + u1 * x[0] + v1 * y[0], o[1] + u1 * x[1] + v1 * y[1]);
      }
      context.strokeStyle = colour;
      context.stroke();
    }
  }

  private drawCrosshair(context: CanvasRenderingContext2D, w: number, h: number): void {
    const [x, y] = this.toScreen(this.store.state.crosshair);
    const style = getComputedStyle(this.element);
    const [vertical, horizontal] = this.plane === 'axial' ? ['sagittal', 'coronal'] : this.plane === 'coronal' ? ['sagittal', 'axial'] : ['coronal', 'axial'];
    context.lineWidth = 1;
    context.globalAlpha = 0.75;
    const line = (plane: string, x0: number, y0: number, x1: number, y1: number) => {
      context.strokeStyle = style.getPropertyValue(`--${plane}`);
      context.beginPath();
      context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
      context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
      context.stroke();
    };
    line(vertical!, x, 0, x, h);
    line(horizontal!, 0, y, w, y);
    context.globalAlpha = 1;
  }

  private drawCrop(context: CanvasRenderingContext2D): void {
    const { crop, tool, geometry: g } = this.store.state;
    if (!crop && tool !== 'crop') return;
    const range = this.range(cropOf(g!.dims, crop)), inside = range.last[0] >= range.first[0];
    const { first, last } = inside ? range : { first: [0, 0] as Point, last: [-1, -1] as Point };
    const corners = [[first[0] - 0.5, first[1] - 0.5], [last[0] + 0.5, first[1] - 0.5], [last[0] + 0.5, last[1] + 0.5], [first[0] - 0.5, last[1] + 0.5]]
      .map(([u, v]) => this.toScreen(this.indexInData(u!, v!)));
    const outline = () => corners.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.beginPath();
    context.rect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    if (inside) { outline(); context.closePath(); }
    context.fillStyle = 'rgb(0 0 0 / 55%)';
    context.fill('evenodd');
    if (!inside) return;
    context.beginPath();
    outline();
    context.closePath();
    context.strokeStyle = '#f0a830';
    context.lineWidth = tool === 'crop' ? 2 : 1;
    context.stroke();
  }

  // Bright in this slice, faint elsewhere.
  private drawDistances(context: CanvasRenderingContext2D): void {
    const { distances, picked, geometry } = this.store.state;
    const { axis, index } = this.slice!;
    const inSlice = (p: Vec3) => Math.abs(toIndexSpace(geometry!, p)[axis]! - index) < 0.75;
    context.strokeStyle = context.fillStyle = '#4fc3f7';
    const end = ([x, y]: Point) => { context.beginPath(); context.arc(x, y, 3.5, 0, 7); context.fill(); };
    for (const distance of distances) {
      const a = this.toScreen(toIndexSpace(geometry!, distance.from)), b = this.toScreen(toIndexSpace(geometry!, distance.to));
      context.globalAlpha = inSlice(distance.from) && inSlice(distance.to) ? 1 : 0.3;
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(...a);
      context.lineTo(...b);
      context.stroke();
      end(a);
      end(b);
      if (context.globalAlpha < 1) continue;
      context.font = '600 12px system-ui, sans-serif';
      context.lineWidth = 3;
      context.strokeStyle = '#000';
      const x = (a[0] + b[0]) / 2 + 6, y = (a[1] + b[1]) / 2 - 6;
      context.strokeText(distanceText(distance), x, y);
      context.fillText(distanceText(distance), x, y);
      context.strokeStyle = '#4fc3f7';
    }
    context.globalAlpha = 1;
    if (picked) end(this.toScreen(toIndexSpace(geometry!, picked)));
  }

  private describe(): void {
    const { geometry, crosshair } = this.store.state, s = this.geometry!;
    const index = this.onSlice(crosshair), coordinate = toPhysical(geometry!, index)[2 - PLANES.indexOf(this.plane)]!;
    // Neighbouring slices have different positions.
    const digits = Math.max(1, -Math.floor(Math.log10(geometry!.spacing[s.through]!)));
    const position = `${coordinate >= 0 ? s.forward : s.backward} ${Math.abs(coordinate).toFixed(digits)} mm`;
    const number = `${index[s.through]! + 1} / ${geometry!.dims[s.through]}`;
    this.corners['tr']!.textContent = position;
    this.corners['br']!.textContent = number;
    this.element.setAttribute('aria-label', `${this.corners['tl']!.textContent} slice ${number}, ${position}`);
    this.showValue();
  }

  /** Moves the crosshair by some slices. */
  step(slices: number): void {
    const { geometry, crosshair } = this.store.state;
    if (!geometry || !this.geometry) return;
    const index: Vec3 = [...crosshair], a = this.geometry.through;
    index[a] = Math.round(index[a]!) + slices;
    this.store.set({ crosshair: clampIndex(geometry, index) });
  }
}
