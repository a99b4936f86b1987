// The surface and the three slices, all together or one alone.
import { byId, elementOf, icon } from '../dom';
import type { Store, ViewName } from '../state';
import { PLANES } from './slice_geometry';
import { SliceView, SliceZoom } from './slice_view';
import { SurfaceView, cannotDraw } from './surface_view';

const NAMES: readonly ViewName[] = ['surface', ...PLANES];
const TITLES: Readonly<Record<ViewName, string>> = { surface: 'Surface', axial: 'Axial', coronal: 'Coronal', sagittal: 'Sagittal' };

export interface Views {
  surface: SurfaceView | undefined; // undefined without WebGL
  reset(): void;
}

/** `moving()` says whether the isovalue is being dragged. */
export function makeViews(store: Store, moving: () => boolean, fail: (error: unknown) => void): Views {
  const parent = byId('views'), zoom = new SliceZoom();
  const elements = Object.fromEntries(NAMES.map((name) => [name, makeView(store, name)])) as Record<ViewName, HTMLElement>;
  parent.append(...Object.values(elements));
  parent.before(makeTabs(store));

  let surface: SurfaceView | undefined;
  try {
    surface = new SurfaceView(elements.surface, store, moving);
  } catch {
    elements.surface.append(cannotDraw('This browser has no WebGL 2, or it is switched off.'));
  }
  const slices = PLANES.map((plane) => new SliceView(elements[plane], plane, store, zoom, fail));

  // On a narrow screen there is room for one view at a time.
  const narrow = matchMedia('(max-width: 700px)');
  const arrange = () => {
    const { layout } = store.state;
    parent.dataset['layout'] = narrow.matches && layout === 'all' ? 'surface' : layout;
  };
  narrow.addEventListener('change', arrange);
  store.on(['layout', 'scan'], arrange);
  arrange();
  addHint(store, elements.surface);
  return {
    surface,
    reset() {
      surface?.lookFrom();
      for (const slice of slices) slice.pan = [0, 0];
      zoom.set(1);
    },
  };
}

function makeView(store: Store, name: ViewName): HTMLElement {
  const enlarge = elementOf('button', { class: 'enlarge', type: 'button', 'aria-label': `Show only ${TITLES[name]}, or all views`, title: 'Only this view, or all' }, icon('enlarge'));
  const view = elementOf('div', { class: 'view', 'data-view': name, tabindex: 0, role: 'group', 'aria-label': TITLES[name] }, enlarge);
  const toggle = () => store.set({ layout: store.state.layout === 'all' ? name : 'all' });
  enlarge.addEventListener('click', toggle);
  view.addEventListener('dblclick', (e) => {
    // While measuring, two quick clicks are the two ends.
    if (!enlarge.contains(e.target as Node) && innerWidth > 700 && store.state.tool !== 'distance') toggle();
  });
  return view;
}

function makeTabs(store: Store): HTMLElement {
  const tabs = elementOf('div', { class: 'tabs', role: 'group', 'aria-label': 'View' }, ...NAMES.map((name) => {
    const tab = elementOf('button', { type: 'button', 'aria-pressed': 'false' }, TITLES[name]);
    tab.addEventListener('click', () => store.set({ layout: name }));
    store.on(['layout', 'scan'], () => tab.setAttribute('aria-pressed', String((store.state.layout === 'all' ? 'surface' : store.state.layout) === name)));
    return tab;
  }));
  return tabs;
}

function addHint(store: Store, view: HTMLElement): void {
  const hint = elementOf('div', { class: 'hint' });
  view.append(hint);
  const update = () => {
    const { tool, picked } = store.state;
    hint.hidden = tool === 'navigate';
    hint.textContent = tool === 'crop' ? 'Drag the sides of the box on a slice' : picked ? 'Click the other end' : 'Click two points on the surface or a slice';
  };
  store.on(['tool', 'picked'], update);
  update();
}
