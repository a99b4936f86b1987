// The panel beside the views: the surface, its measures, the crop box and the distances, or the labels.
import type { Label } from 'marrow-wasm';
import { messageOf, showBanner } from '../banners';
import { distanceText } from '../distances';
import { byId, elementOf, grouped, icon, rounded, showNumber } from '../dom';
import type { Vec3 } from '../scan/geometry';
import { labelsOf, openTable } from '../scan/label_table';
import type { State, Store } from '../state';
import { currentPreset, toHex } from '../state';
import { cropOf, movedCrop } from '../views/slice_input';

type Keys = readonly (keyof State)[];

export function makePanel(store: Store): void {
  byId('panel').append(
    modeSection(store), surfaceSection(store), labelSection(store), measureSection(store), cropSection(store), windowSection(store), distanceSection(store));
}

/** Calls now and whenever one of the members changes. */
function follow(store: Store, keys: Keys, update: (s: Readonly<State>) => void): void {
  store.on(keys, () => update(store.state));
  update(store.state);
}

function section(title: string, ...side: HTMLElement[]): HTMLElement {
  return elementOf('section', { 'aria-label': title }, elementOf('header', {}, elementOf('h2', {}, title), ...side));
}

function checkBox(store: Store, text: string, title: string, get: (s: Readonly<State>) => boolean, set: (on: boolean) => Partial<State>, keys: Keys): HTMLElement {
  const input = elementOf('input', { type: 'checkbox' });
  input.addEventListener('change', () => store.set(set(input.checked)));
  follow(store, keys, (s) => { input.checked = get(s); });
  return elementOf('label', { class: 'check', title }, input, text);
}

interface NumberField { label: string; unit: string; title: string; min: number; max: number; step: number; key: 'smooth' | 'keep' | 'relax' }

function numberField(store: Store, f: NumberField): HTMLElement {
  const id = `field-${f.key}`;
  const input = elementOf('input', { type: 'number', id, min: f.min, max: f.max, step: f.step, inputmode: 'numeric' });
  input.addEventListener('change', () => {
    const value = Math.min(Math.max(Math.round(input.valueAsNumber), f.min), f.max);
    if (Number.isFinite(value)) store.set({ [f.key]: value });
    showNumber(input, store.state[f.key]);
  });
  follow(store, [f.key], (s) => showNumber(input, s[f.key]));
  return elementOf('div', { class: 'field', title: f.title }, elementOf('label', { for: id }, f.label),
    elementOf('div', { class: 'with-unit' }, input, elementOf('span', {}, f.unit)));
}

// A label map can also be taken as a scan, as the page may have taken a scan for a label map.
function modeSection(store: Store): HTMLElement {
  const box = checkBox(store, 'Each label has its own surface', 'Off: one surface at an isovalue', (s) => s.asLabels, (asLabels) => ({ asLabels }), ['asLabels']);
  const made = elementOf('section', { 'aria-label': 'Label map' }, box);
  follow(store, ['scan'], (s) => { made.hidden = s.scan?.unit !== 'labels'; });
  return made;
}

function surfaceSection(store: Store): HTMLElement {
  const made = section('Surface');
  const colour = elementOf('input', { type: 'color', 'aria-label': 'Colour of the surface', title: 'Colour on the screen' });
  colour.addEventListener('input', () => store.set({ colour: colour.value }));
  const name = elementOf('span', { class: 'name' }), value = elementOf('span', { class: 'faint' });
  const opacity = elementOf('input', { type: 'range', id: 'opacity', min: 5, max: 100 });
  opacity.addEventListener('input', () => store.set({ opacity: opacity.valueAsNumber / 100 }));
  follow(store, ['colour'], (s) => { colour.value = s.colour; });
  follow(store, ['opacity'], (s) => { opacity.value = String(Math.round(s.opacity * 100)); });
  follow(store, ['isovalue', 'scan'], (s) => {
    name.textContent = currentPreset(s)?.name ?? (s.scan?.otsu === s.isovalue ? 'otsu' : 'surface');
    value.textContent = String(s.isovalue).replace('-', '\u2212');
  });
  made.append(
    elementOf('div', { class: 'swatch-row' }, colour, name, value),
    elementOf('div', { class: 'field' }, elementOf('label', { for: 'opacity' }, 'Opacity'), opacity),
    checkBox(store, 'Largest component only', 'Without the table, the head rest, and cavities: --largest', (s) => s.largest, (largest) => ({ largest }), ['largest']),
    checkBox(store, 'Open at the border of the scan', 'Do not close the surface where the scan ends: --open', (s) => !s.closed, (open) => ({ closed: !open }), ['closed']),
    checkBox(store, 'Exact topology', 'The pieces and holes that the samples have; thin walls askew in the grid are not perforated: --topology', (s) => s.topology, (topology) => ({ topology }), ['topology']),
    numberField(store, { label: 'Smoothing', unit: '', title: 'Iterations of a filter that shrinks only thin parts; 20 is usual: --smooth', min: 0, max: 200, step: 5, key: 'smooth' }),
    numberField(store, { label: 'Keep triangles', unit: '%', title: 'Reduce the surface to this part of its triangles: --keep', min: 1, max: 100, step: 5, key: 'keep' }));
  const note = elementOf('p', { class: 'faint' });
  made.append(note);
  follow(store, ['note'], (s) => { note.textContent = s.note; note.hidden = !s.note; });
  follow(store, ['asLabels'], (s) => { made.hidden = s.asLabels; });
  return made;
}

function labelSection(store: Store): HTMLElement {
  const all = elementOf('button', { class: 'text', type: 'button' }, 'Show all');
  all.addEventListener('click', () => store.set({ hidden: new Set() }));
  const none = elementOf('button', { class: 'text', type: 'button' }, 'Hide all');
  none.addEventListener('click', () => store.set({ hidden: new Set(labelsOf(store.state).map((l) => l.label)) }));
  const file = elementOf('input', { type: 'file', id: 'table-input', hidden: true, 'aria-label': 'Table of labels' });
  file.addEventListener('change', () => {
    if (file.files?.[0]) openTable(store, file.files[0]).catch((error) => showBanner('error', messageOf(error)));
    file.value = ''; // so that the same choice is noticed again
  });
  const names = elementOf('button', { class: 'text', type: 'button', title: 'Names and colours from a text file: of 3D Slicer, FreeSurfer or ITK-SNAP, or one LABEL NAME a line' }, 'Names…');
  names.addEventListener('click', () => file.click());
  const list = elementOf('ul', { class: 'plain label-list', tabindex: 0, 'aria-label': 'Labels' });
  const made = section('Labels', all, none);
  made.append(file, list, elementOf('div', { class: 'row' }, names), numberField(store, { label: 'Smoothing', unit: '', title: 'Passes in which neighbouring labels are smoothed together; 40 is usual: --relax', min: 0, max: 500, step: 10, key: 'relax' }));
  let rows: LabelRow[] = [];
  follow(store, ['scan', 'table', 'asLabels'], (s) => {
    made.hidden = !s.asLabels;
    rows = s.asLabels ? labelsOf(s).map((label) => labelRow(store, label)) : [];
    list.replaceChildren(...rows.map((row) => row.element));
  });
  // The rows stay, so that the keyboard's focus does.
  follow(store, ['scan', 'table', 'asLabels', 'hidden'], ({ hidden }) => {
    for (const row of rows) row.showVisible(!hidden.has(row.label));
  });
  follow(store, ['scan', 'table', 'asLabels', 'labelSurfaces'], ({ labelSurfaces }) => {
    const volumes = new Map(labelSurfaces.map(({ label, volume }) => [label, volume]));
    for (const row of rows) row.showVolume(volumes.get(row.label));
  });
  return made;
}

interface LabelRow { label: number; element: HTMLElement; showVisible(visible: boolean): void; showVolume(volume: number | undefined): void }

function labelRow(store: Store, { label, name, colour }: Label): LabelRow {
  const eye = elementOf('button', { class: 'icon', type: 'button', 'aria-label': `Show ${name}` });
  eye.addEventListener('click', () => {
    const hidden = new Set(store.state.hidden);
    if (!hidden.delete(label)) hidden.add(label);
    store.set({ hidden });
  });
  const dot = elementOf('span', { class: 'dot' }), value = elementOf('span', { class: 'value' });
  dot.style.background = toHex(colour);
  return {
    label, element: elementOf('li', {}, eye, dot, elementOf('span', { class: 'name', title: name }, name), value),
    showVisible: (visible) => {
      if (eye.getAttribute('aria-pressed') === String(visible)) return; // as that of most rows, of which there may be thousands
      eye.setAttribute('aria-pressed', String(visible));
      eye.replaceChildren(icon(visible ? 'eye' : 'eye-off'));
    },
    showVolume: (volume) => { value.textContent = volume === undefined ? '' : `${rounded(volume / 1000)} mL`; },
  };
}

function measureSection(store: Store): HTMLElement {
  const light = elementOf('span', { class: 'light', id: 'light', role: 'status' });
  const list = elementOf('dl', { class: 'measures', id: 'measures' });
  const made = section('Measures', light);
  made.append(list);
  follow(store, ['light'], ({ light: l }) => { light.dataset['state'] = l.state; light.textContent = l.text || (l.state === 'busy' ? 'measuring' : ''); });
  follow(store, ['measures', 'surface', 'exact', 'extractMs', 'labelSurfaces', 'asLabels'], (s) => {
    const rows: [string, string][] = s.asLabels ? labelMeasures(s) : surfaceMeasures(s);
    list.replaceChildren(...rows.flatMap(([name, text]) => [elementOf('dt', {}, name), elementOf('dd', {}, text)]));
  });
  return made;
}

function surfaceMeasures(s: Readonly<State>): [string, string][] {
  const { measures: m, surface } = s;
  if (!m) return [['Volume', '–'], ['Area', '–'], ['Components', '–'], ['Triangles', '–']];
  // Until the surface is measured again, its triangles are known and the other numbers are those of the last one.
  const about = s.exact && surface?.mesh === m.mesh ? '' : '≈ ';
  const size = m.lower.map((low, a) => rounded(m.upper[a]! - low, 0)).join(' × ');
  const triangles = surface ? surface.mesh.triangles.length / 3 : m.triangles;
  return [
    ['Volume', m.boundaryEdges > 0 ? `${about}not closed` : `${about}${rounded(m.volume / 1000)} mL`],
    ['Area', `${about}${rounded(m.area / 100)} cm²`],
    ['Size, mm', m.triangles > 0 ? `${about}${size}` : '–'],
    ['Components', `${about}${grouped(m.components)}`],
    ['Triangles', `${s.exact ? '' : '≈ '}${grouped(triangles)}`],
    ['Extraction', s.extractMs === undefined ? '–' : `${s.extractMs.toFixed(0)} ms`],
  ];
}

function labelMeasures(s: Readonly<State>): [string, string][] {
  const visible = s.labelSurfaces.filter((l) => !s.hidden.has(l.label));
  const sum = (of: (l: (typeof visible)[number]) => number) => visible.reduce((total, l) => total + of(l), 0);
  return [['Surfaces', grouped(visible.length)], ['Volume', `${rounded(sum((l) => l.volume) / 1000)} mL`], ['Triangles', grouped(sum((l) => l.triangles.length / 3))]];
}

function cropSection(store: Store): HTMLElement {
  const reset = elementOf('button', { class: 'text', type: 'button' }, 'Reset');
  reset.addEventListener('click', () => store.set({ crop: undefined }));
  const made = section('Crop', reset);
  const names = ['x', 'y', 'z'];
  const inputs = names.map((name, axis) => [false, true].map((upper) => {
    const input = elementOf('input', { type: 'number', min: 0, step: 1, inputmode: 'numeric', 'aria-label': `${upper ? 'Last' : 'First'} sample along ${name}` });
    input.addEventListener('change', () => {
      const g = store.state.geometry;
      if (g && Number.isFinite(input.valueAsNumber)) store.set({ crop: movedCrop(g.dims, store.state.crop, axis, upper, input.valueAsNumber) });
      show(store.state);
    });
    return input;
  }));
  const labels = names.map((name) => elementOf('span', {}, name));
  inputs.forEach((pair, axis) => made.append(elementOf('div', { class: 'crop-row' }, labels[axis]!, ...pair)));
  const show = (s: Readonly<State>) => {
    const dims = s.geometry?.dims ?? ([1, 1, 1] as Vec3), box = cropOf(dims, s.crop);
    inputs.forEach(([first, last], a) => {
      showNumber(first!, box.first[a]!);
      showNumber(last!, box.last[a]!);
      first!.max = last!.max = String(dims[a]! - 1);
    });
    reset.disabled = !s.crop;
  };
  follow(store, ['crop', 'geometry'], show);
  follow(store, ['geometry'], (s) => s.geometry && labels.forEach((label, a) => { label.textContent = `${names[a]} ${axisName(s.geometry!.direction, a)}`; }));
  return made;
}

/** The usual windows of CT, as in the desktop viewer. */
const WINDOWS: readonly { name: string; width: number; level: number }[] = [
  { name: 'Bone', width: 1500, level: 300 }, { name: 'Soft tissue', width: 400, level: 40 },
  { name: 'Brain', width: 80, level: 40 }, { name: 'Lung', width: 1500, level: -600 },
];

// The greys of the slices: their width and level, by number or by name.
function windowSection(store: Store): HTMLElement {
  const usual = elementOf('select', { 'aria-label': 'Usual windows' }, ...WINDOWS.map((w, i) => elementOf('option', { value: i }, w.name)), elementOf('option', { value: '' }, 'Other'));
  const made = section('Window', usual);
  const set = (width: number, level: number) => {
    if (width > 0 && Number.isFinite(level)) store.set({ window: { lower: level - width / 2, upper: level + width / 2 } });
    show(store.state);
  };
  const [width, level] = ['Width', 'Level'].map((name) => elementOf('input', { type: 'number', step: 'any', 'aria-label': `${name} of the window`, title: name })) as [HTMLInputElement, HTMLInputElement];
  for (const input of [width, level]) input.addEventListener('change', () => set(width.valueAsNumber, level.valueAsNumber));
  usual.addEventListener('change', () => { const w = WINDOWS[Number(usual.value)]; if (usual.value && w) set(w.width, w.level); });
  made.append(elementOf('div', { class: 'crop-row' }, elementOf('span', {}, 'W  L'), width, level));
  const show = (s: Readonly<State>) => {
    const { lower, upper } = s.window, rounded = (v: number) => Number(upper - lower >= 20 ? v.toFixed(0) : v.toPrecision(4));
    showNumber(width, rounded(upper - lower));
    showNumber(level, rounded((lower + upper) / 2));
    const known = WINDOWS.findIndex((w) => w.width === upper - lower && w.level === (lower + upper) / 2);
    usual.value = known >= 0 ? String(known) : '';
    usual.hidden = s.scan?.unit !== 'HU';
    made.hidden = s.asLabels;
  };
  follow(store, ['window', 'scan', 'asLabels'], show);
  return made;
}

// From where to where an index axis runs in the patient, such as "R–L".
function axisName(direction: readonly Vec3[], axis: number): string {
  const along = direction.map((row) => row[axis]!), p = along.reduce((best, v, i) => (Math.abs(v) > Math.abs(along[best]!) ? i : best), 0);
  const [low, high] = [['R', 'L'], ['A', 'P'], ['I', 'S']][p]!;
  return along[p]! >= 0 ? `${low}–${high}` : `${high}–${low}`;
}

function distanceSection(store: Store): HTMLElement {
  const list = elementOf('ul', { class: 'plain' });
  const made = section('Distances');
  made.append(list);
  follow(store, ['distances', 'tool'], ({ distances, tool }) => {
    made.hidden = distances.length === 0 && tool !== 'distance';
  });
  follow(store, ['distances'], ({ distances }) => {
    if (distances.length === 0) {
      list.replaceChildren(elementOf('li', { class: 'faint' }, 'Click two points on the surface or a slice.'));
      return;
    }
    list.replaceChildren(...distances.map((distance, i) => {
      const remove = elementOf('button', { class: 'icon', type: 'button', 'aria-label': `Remove distance ${i + 1}` }, icon('close'));
      remove.addEventListener('click', () => {
        store.set({ distances: store.state.distances.filter((d) => d !== distance) });
        // The keyboard goes on with the next distance, or the last, or the tool.
        const others = list.querySelectorAll('button');
        const tool = byId('tools').querySelector<HTMLElement>('[data-tool="distance"]');
        (others[Math.min(i, others.length - 1)] ?? tool)?.focus();
      });
      return elementOf('li', {}, elementOf('span', { class: 'name' }, `Distance ${i + 1}`), elementOf('span', { class: 'value' }, distanceText(distance)), remove);
    }));
  });
  return made;
}
