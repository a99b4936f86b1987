// The histogram is the control of the isovalue: drag the line, click, or use the keys.
import { presets } from 'marrow-wasm';
import { elementOf, showNumber } from '../dom';
import { currentPreset, isovalueStep, onGrid, roundStep, toHex } from '../state';
import type { Store } from '../state';

const MARGIN = 10, TOP = 18, AXIS = 18; // pixels

export class Histogram {
  private readonly canvas = document.createElement('canvas');
  private lower = 0;
  private upper = 1;
  private frame = 0;
  dragging = false;

  /** `released()` is called at the end of a drag. */
  constructor(readonly element: HTMLElement, private readonly store: Store, private readonly released: () => void) {
    element.append(this.canvas);
    element.className = 'histogram';
    element.tabIndex = 0;
    element.setAttribute('role', 'slider');
    element.setAttribute('aria-label', 'Isovalue');
    element.title = 'How often each value occurs, on a logarithmic scale.\nDrag the line, or use the arrow and page keys. Scroll to zoom.';
    store.on(['scan'], () => this.start());
    store.on(['isovalue', 'colour', 'scan'], () => { this.describe(); this.draw(); });
    new ResizeObserver(() => this.draw()).observe(element);
    this.listen();
  }

  /** Draws again, for instance in another theme. */
  draw(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.render());
  }

  private start(): void {
    const { scan, isovalue } = this.store.state;
    if (!scan) return;
    [this.lower, this.upper] = usualRange(scan.histogram.counts, scan.histogram.lower, scan.histogram.upper);
    this.lower = Math.min(this.lower, isovalue);
    this.upper = Math.max(this.upper, isovalue);
  }

  private describe(): void {
    const { scan, isovalue } = this.store.state;
    if (!scan) return;
    const set = (name: string, value: string | number) => this.element.setAttribute(name, String(value));
    set('aria-valuemin', scan.histogram.lower);
    set('aria-valuemax', scan.histogram.upper);
    set('aria-valuenow', isovalue);
    set('aria-valuetext', `${isovalue}${scan.unit === 'HU' ? ' HU' : ''}`);
  }

  private get width(): number { return Math.max(this.element.clientWidth - 2 * MARGIN, 1); }
  private xOf(value: number): number { return MARGIN + ((value - this.lower) / (this.upper - this.lower)) * this.width; }
  private valueAt(x: number): number { return this.lower + ((x - MARGIN) / this.width) * (this.upper - this.lower); }

  private render(): void {
    this.frame = 0;
    const { scan, isovalue, colour } = this.store.state;
    const { clientWidth: w, clientHeight: h } = this.element, ratio = devicePixelRatio;
    if (!scan || w === 0 || h === 0) return;
    this.canvas.width = Math.round(w * ratio);
    this.canvas.height = Math.round(h * ratio);
    const context = this.canvas.getContext('2d')!;
    context.scale(ratio, ratio);
    const style = getComputedStyle(this.element), text = style.getPropertyValue('--text').trim();
    const bottom = h - AXIS, x = this.xOf(isovalue);

    const bins = this.outline(bottom);
    context.fillStyle = text;
    context.globalAlpha = 0.2;
    context.fill(bins);
    // The values inside the surface have its colour.
    context.save();
    context.beginPath();
    context.rect(x, 0, w, bottom);
    context.clip();
    const light = style.colorScheme.includes('light');
    const strong = light ? `color-mix(in srgb, ${colour} 62%, #3a2a10)` : colour;
    context.globalAlpha = light ? 0.75 : 0.8;
    context.fillStyle = strong;
    context.fill(bins);
    context.restore();
    context.globalAlpha = 1;
    this.drawAxis(context, bottom, text);
    this.drawFlag(context, x, bottom, style);
  }

  private outline(bottom: number): Path2D {
    const { counts, lower, upper } = this.store.state.scan!.histogram;
    const bin = (upper - lower) / Math.max(counts.length, 1), path = new Path2D();
    const clamped = (value: number) => Math.min(Math.max(this.xOf(value), MARGIN), MARGIN + this.width);
    let highest = 1;
    const first = Math.max(Math.floor((this.lower - lower) / bin), 0), last = Math.min(Math.ceil((this.upper - lower) / bin), counts.length);
    for (let i = first; i < last; ++i) highest = Math.max(highest, counts[i]!);
    path.moveTo(clamped(this.lower), bottom);
    for (let i = first; i < last; ++i) {
      const top = bottom - (Math.log1p(counts[i]!) / Math.log1p(highest)) * (bottom - TOP - 2);
      path.lineTo(clamped(lower + i * bin), top);
      path.lineTo(clamped(lower + (i + 1) * bin), top);
    }
    path.lineTo(clamped(this.upper), bottom);
    path.closePath();
    return path;
  }

  private drawAxis(context: CanvasRenderingContext2D, bottom: number, text: string): void {
    context.fillStyle = text;
    context.font = '11px Inter, system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'top';
    context.globalAlpha = 0.3;
    context.fillRect(MARGIN, bottom, this.width, 1);
    const tick = roundStep((this.upper - this.lower) / Math.max(2, this.width / 90));
    const first = Math.ceil(this.lower / tick);
    // Counts them, because first + i may be rounded to first.
    for (let i = 0; i <= (this.upper - this.lower) / tick; ++i) {
      const value = (first + i) * tick;
      if (value > this.upper) break;
      const x = this.xOf(value), label = String(Number(value.toPrecision(6))).replace('-', '\u2212');
      context.globalAlpha = 0.4;
      context.fillRect(Math.round(x), bottom, 1, 4);
      context.globalAlpha = 0.8;
      const half = context.measureText(label).width / 2;
      context.fillText(label, Math.min(Math.max(x, half), this.element.clientWidth - half), bottom + 5);
    }
    context.globalAlpha = 1;
  }

  private drawFlag(context: CanvasRenderingContext2D, x: number, bottom: number, style: CSSStyleDeclaration): void {
    if (x < MARGIN - 1 || x > MARGIN + this.width + 1) return;
    const amber = style.getPropertyValue('--amber').trim();
    context.fillStyle = amber;
    context.fillRect(x - 1, TOP - 4, 2, bottom - TOP + 4);
    const text = String(this.store.state.isovalue).replace('-', '\u2212');
    context.font = '700 11.5px Inter, system-ui, sans-serif';
    const width = context.measureText(text).width + 14;
    const left = Math.min(Math.max(x - width / 2, 0), this.element.clientWidth - width);
    context.beginPath();
    context.roundRect(left, 0, width, 17, 5);
    context.fill();
    context.fillStyle = '#1b1405';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(text, left + width / 2, 9);
  }

  private setAt(clientX: number): void {
    const { scan } = this.store.state;
    const x = clientX - this.element.getBoundingClientRect().left;
    if (scan) this.store.set({ isovalue: onGrid(scan, this.valueAt(x)) });
  }

  private listen(): void {
    const { element } = this;
    element.addEventListener('pointerdown', (e) => {
      if (e.button !== 0 || !e.isPrimary) return;
      element.setPointerCapture(e.pointerId);
      this.dragging = true;
      this.setAt(e.clientX);
    });
    element.addEventListener('pointermove', (e) => { if (this.dragging && e.isPrimary) this.setAt(e.clientX); });
    const end = () => { if (this.dragging) { this.dragging = false; this.released(); } };
    element.addEventListener('pointerup', end);
    element.addEventListener('pointercancel', end);
    element.addEventListener('keydown', (e) => {
      const { scan, isovalue } = this.store.state;
      const steps: Record<string, number> = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
      if (!scan || !(e.key in steps) || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      this.store.set({ isovalue: onGrid(scan, isovalue, steps[e.key]!) });
    });
    element.addEventListener('wheel', (e) => { e.preventDefault(); this.zoom(e.clientX, Math.exp(e.deltaY / 600)); }, { passive: false });
  }

  private zoom(clientX: number, factor: number): void {
    const { scan } = this.store.state;
    if (!scan || !(scan.histogram.upper > scan.histogram.lower)) return;
    const { lower, upper } = scan.histogram;
    const centre = this.valueAt(clientX - this.element.getBoundingClientRect().left);
    // In a shorter range, there are fewer numbers than pixels.
    const finest = 1e3 * Number.EPSILON * Math.max(Math.abs(lower), Math.abs(upper));
    const range = Math.min(Math.max((this.upper - this.lower) * factor, (upper - lower) / 100, finest), upper - lower);
    const fraction = (centre - this.lower) / (this.upper - this.lower);
    this.lower = Math.min(Math.max(centre - fraction * range, lower), upper - range);
    this.upper = this.lower + range;
    this.draw();
  }
}

// From the 0.1 to the 99.9 percentile with a margin, if outliers such as metal and padding stretch the range to far
// more; else all values.
function usualRange(counts: Float64Array, lower: number, upper: number): [number, number] {
  if (counts.length === 0 || !(upper > lower)) return [lower, lower + 1];
  const all = counts.reduce((a, b) => a + b, 0), bin = (upper - lower) / counts.length;
  const tail = (values: Float64Array) => {
    let sum = 0;
    return values.findIndex((n) => (sum += n) > all / 1000);
  };
  const low = lower + bin * tail(counts), high = upper - bin * tail(counts.slice().reverse());
  if (high - low > 0.7 * (upper - lower)) return [lower, upper];
  const margin = 0.1 * (high - low);
  return [Math.max(low - margin, lower), Math.min(high + margin, upper)];
}

/** The row above the histogram: the number and the presets. */
export function makeIsovalueRow(row: HTMLElement, store: Store): void {
  const input = elementOf('input', { type: 'number', id: 'isovalue-number', step: 'any' });
  const unit = elementOf('span', { class: 'faint' });
  const chips = elementOf('div', { class: 'chips', role: 'group', 'aria-label': 'Presets' });
  const show = () => showNumber(input, store.state.isovalue);
  row.append(elementOf('label', { for: 'isovalue-number' }, 'Isovalue'), input, unit, chips);
  input.addEventListener('change', () => {
    if (Number.isFinite(input.valueAsNumber)) store.set({ isovalue: input.valueAsNumber });
    show();
  });
  store.on(['scan'], () => {
    const { scan } = store.state;
    if (!scan) return;
    unit.textContent = scan.unit === 'HU' ? 'HU' : '';
    input.step = String(isovalueStep(scan));
    const chip = (name: string, title: string, choose: () => void) => {
      const button = elementOf('button', { class: 'chip', type: 'button', 'data-preset': name, title }, name);
      button.addEventListener('click', choose);
      return button;
    };
    const tissues = scan.unit === 'HU' ? presets.map((p) =>
      chip(p.name, `Samples of at least ${p.lowest} HU`, () => store.set({ isovalue: p.isovalue, colour: toHex(p.colour) }))) : [];
    const otsu = scan.otsu;
    chips.replaceChildren(...tissues, ...(otsu === undefined ? [] : [chip('otsu', "The value that separates dark from bright best (Otsu's method)", () => store.set({ isovalue: otsu }))]));
  });
  store.on(['scan', 'isovalue'], () => {
    const { scan, isovalue } = store.state, preset = currentPreset(store.state);
    show();
    for (const chip of chips.querySelectorAll<HTMLElement>('.chip'))
      chip.setAttribute('aria-pressed', String(chip.dataset['preset'] === (preset?.name ?? (scan?.otsu === isovalue ? 'otsu' : ''))));
  });
}
