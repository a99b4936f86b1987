// What keys and pointers do, and where the scan goes: nowhere.
import { threads, version } from 'marrow-wasm';
import { elementOf } from '../dom';
import { cancelButton, makeDialog, show } from './dialog';

const KEYS: readonly (readonly [string[], string])[] = [
  [['N', 'D', 'K'], 'navigate, measure a distance, crop'],
  [['1', '…', '6'], 'look from anterior, posterior, left, right, superior, inferior'],
  [['R'], 'reset the views'],
  [['B'], 'light or dark'],
  [['←', '→'], 'on the histogram: isovalue; with Page keys ten steps. On a slice: next slice. On the surface: rotate'],
  [['+', '−'], 'zoom'],
  [['Ctrl+O'], 'open a file; with Shift a folder'],
  [['Ctrl+S'], 'export'],
  [['Ctrl+P'], 'save a picture'],
  [['Enter', 'Esc'], 'in a field: accept its value, restore it'],
  [['Esc'], 'forget the first end of a distance; navigate; show all views'],
];
const POINTERS: readonly (readonly [string, string])[] = [
  ['Surface', 'drag rotates, two fingers or the right button move, wheel or pinch zooms, a click puts the crosshair there'],
  ['Slice', 'drag moves the crosshair, wheel changes the slice, Ctrl and wheel or pinch zooms, the right button changes width and level of the window'],
  ['Any view', 'a double click shows it alone'],
];

export async function showHelp(): Promise<void> {
  const dialog = makeDialog('Marrow in the browser');
  const keys = KEYS.map(([names, text]) => elementOf('tr', {}, elementOf('td', {}, ...names.flatMap((n) => [n === '…' ? '… ' : elementOf('kbd', {}, n), ' '])), elementOf('td', {}, text)));
  const pointers = POINTERS.map(([name, text]) => elementOf('tr', {}, elementOf('td', {}, name), elementOf('td', {}, text)));
  const n = threads();
  dialog.body.append(
    elementOf('p', {}, 'Scans are read, meshed and written on this computer. The page is not allowed to connect to any other site, and it works without a network after the first visit.'),
    elementOf('table', { class: 'keys' }, elementOf('tbody', {}, ...keys, ...pointers)),
    elementOf('p', { class: 'faint' }, `Marrow ${version}, ${n === 1 ? 'one thread' : `${n} threads`}. Licence: Apache-2.0.`));
  dialog.foot.append(cancelButton('Close'));
  await show(dialog);
}
