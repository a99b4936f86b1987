// Names and colours of labels from a table, which is a text file beside the map.
import type { Label, LabelSurface, LabelTable, ScanFile } from 'marrow-wasm';
import { readLabelTable } from 'marrow-wasm';
import type { State, Store } from '../state';
import { pathOf } from './collect_files';

/** Whether a file may be a table of labels, by its name. */
export const isTable = (file: ScanFile): boolean => /\.(txt|ctbl|csv|tsv|lut|label)$/i.test(pathOf(file));

/** Gives the labels of the open map the names and colours of a table. */
export async function openTable(store: Store, file: ScanFile): Promise<void> {
  const { scan } = store.state;
  if (!scan) return;
  const table = await readLabelTable(scan, file);
  if (store.state.scan === scan) store.set({ table, labelSurfaces: named(store.state.labelSurfaces, table) });
}

/** The labels of the map, as the table names them if there is one. */
export const labelsOf = ({ table, scan }: Readonly<State>): readonly Label[] => (table ?? scan)?.labels ?? [];

/** Surfaces with the names and colours of a table. */
export function named(surfaces: readonly LabelSurface[], table: LabelTable | undefined): readonly LabelSurface[] {
  const known = new Map(table?.labels.map((label) => [label.label, label]));
  return surfaces.map((surface) => {
    const { name, colour } = known.get(surface.label) ?? surface;
    return { ...surface, name, colour };
  });
}
