// The command line that makes what the page shows, and the meshes that it would write.
import type { Mesh, Recipe, Space } from 'marrow-wasm';
import { commandLine } from 'marrow-wasm';
import type { State } from './state';
import { currentPreset } from './state';

export const FORMATS = [
  { extension: 'stl', name: 'STL', about: 'any slicer', several: false },
  { extension: '3mf', name: '3MF', about: 'slicers; names, mm', several: true },
  { extension: 'glb', name: 'GLB', about: 'web and 3D apps', several: true },
  { extension: 'ply', name: 'PLY', about: 'points with normals', several: false },
] as const;
export type Extension = (typeof FORMATS)[number]['extension'];

/** The surfaces of the labels that are not hidden. */
const shownLabels = (s: Readonly<State>) => s.labelSurfaces.filter((l) => !s.hidden.has(l.label));

/** Whether all labels are hidden, so that no command line makes what is shown. */
export const hidesAll = (s: Readonly<State>): boolean =>
  s.asLabels && s.hidden.size > 0 && shownLabels(s).length === 0;

/** Whether a format can hold what is shown. */
export function canHold(s: Readonly<State>, extension: Extension): boolean {
  return !s.asLabels || shownLabels(s).length === 1 || FORMATS.some((f) => f.extension === extension && f.several);
}

/** The name of the surface without an extension, for files. */
export function surfaceName(s: Readonly<State>): string {
  const labels = shownLabels(s);
  if (s.asLabels) return labels.length === 1 ? labels[0]!.name.replace(/[^\p{L}\p{N}._-]+/gu, '-').replace(/^[.-]+/, '') || 'label' : 'labels';
  return currentPreset(s)?.name ?? (s.scan?.otsu === s.isovalue ? 'otsu' : 'surface');
}

/** What was done to make the surfaces. */
export function recipeOf(s: Readonly<State>, output: string, space: Space): Recipe {
  const scan = s.scan!, crop = s.crop && { crop: s.crop };
  if (s.asLabels) {
    const only = s.hidden.size > 0 ? { only: shownLabels(s).map((l) => l.label) } : {};
    return { scan, labels: { relax: s.relax, ...(s.table && { table: s.table }), ...only, ...crop }, output, space };
  }
  return {
    scan, output, space,
    surfaces: [currentPreset(s)?.name ?? s.isovalue],
    extractor: { closed: s.closed, topology: s.topology, ...crop },
    ...(s.largest && { components: { largest: true } }),
    ...(s.smooth > 0 && { smooth: { iterations: s.smooth } }),
    ...(s.keep < 100 && { simplify: { keep: s.keep / 100 } }),
  };
}

export const commandOf = (s: Readonly<State>, output: string, space: Space = 'LPS'): string => commandLine(recipeOf(s, output, space));

/**
 * The meshes to write, with the names and colours that the command line gives them. Undefined while what is
 * on the screen does not match the controls, and if no label is shown.
 */
export function meshesOf(s: Readonly<State>): Mesh[] | undefined {
  if (!s.exact) return undefined;
  const labels = shownLabels(s);
  if (s.asLabels) return labels.length > 0 ? labels : undefined;
  if (!s.surface) return undefined;
  const { points, normals, triangles } = s.surface.mesh, preset = currentPreset(s);
  return [{ points, normals, triangles, name: preset?.name ?? String(s.isovalue), ...(preset && { colour: preset.colour }) }];
}
