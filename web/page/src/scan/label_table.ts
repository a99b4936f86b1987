// Names and colours of labels from a table, which is a text file beside the map.
import type { Label, LabelTable, ScanFile } from 'marrow-wasm';
import { readLabelTable } from 'marrow-wasm';
import type { State, Store } from '../state';

const nameOf = (file: ScanFile): string => ('path' in file ? file.path : file.name);

/** Whether a file may be a table of labels, by its name. */
export const isTable = (file: ScanFile): boolean => /\.(txt|ctbl|csv|tsv|lut|label)$/i.test(nameOf(file));

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
export function named<Surface extends { label: number }>(surfaces: readonly Surface[], table: LabelTable | undefined): readonly Surface[] {
  return table === undefined ? surfaces : surfaces.map((surface) => {
    const { name, colour } = table.labels.find((l) => l.label === surface.label)!;
    return { ...surface, name, colour };
  });
}
