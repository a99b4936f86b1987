// Saves the surface as a file, and shows the command line that writes the same bytes.
import type { Space } from 'marrow-wasm';
import { MarrowError, writeMesh } from 'marrow-wasm';
import { ProgressBanner, messageOf, showBanner } from '../banners';
import { elementOf, save } from '../dom';
import type { Extension } from '../recipe';
import { FORMATS, canHold, commandOf, meshesOf, surfaceName } from '../recipe';
import type { Store } from '../state';
import { cancelButton, makeDialog, show } from './dialog';

let lastFormat: Extension = 'stl';

export async function exportSurface(store: Store): Promise<void> {
  const state = store.state;
  if (!meshesOf(state)) {
    return showBanner('note', state.light.state === 'busy' ?
      'The surface is still being made; export when its numbers are shown.' :
      'There is no surface of these settings; change them, or show a label, then export.');
  }
  const dialog = makeDialog('Export the surface');
  if (!canHold(state, lastFormat)) lastFormat = '3mf';
  const formats = elementOf('div', { class: 'formats', role: 'radiogroup', 'aria-label': 'Format' }, ...FORMATS.map((f) => {
    const input = elementOf('input', { type: 'radio', name: 'format', value: f.extension, checked: f.extension === lastFormat, disabled: !canHold(state, f.extension) });
    return elementOf('label', {}, input, elementOf('b', {}, f.name), elementOf('span', {}, f.about));
  }));
  const name = elementOf('input', { type: 'text', id: 'export-name', value: surfaceName(state), required: true, pattern: '[^\\/\\\\\\{\\}]+', title: 'Without / \\ { }', spellcheck: 'false' });
  const space = elementOf('select', { id: 'export-space' }, elementOf('option', { value: 'LPS' }, 'LPS (DICOM, ITK)'), elementOf('option', { value: 'RAS' }, 'RAS (3D Slicer, NIfTI)'));
  const spaceField = elementOf('div', { class: 'field' }, elementOf('label', { for: 'export-space' }, 'Axes'), space);
  const command = elementOf('code', { tabindex: 0, 'aria-label': 'Command line' });
  dialog.body.append(formats, elementOf('div', { class: 'field' }, elementOf('label', { for: 'export-name' }, 'Name'), name), spaceField,
    elementOf('p', { class: 'faint' }, 'The same bytes on the command line:'), elementOf('div', { class: 'command' }, command));
  dialog.foot.append(cancelButton(), elementOf('button', { class: 'primary', type: 'submit', value: 'save' }, 'Save'));

  const chosen = () => new FormData(dialog.form).get('format') as Extension;
  const axes = (): Space => (chosen() === 'glb' ? 'LPS' : (space.value as Space));
  const file = () => `${name.value.trim() || surfaceName(state)}.${chosen()}`;
  const update = () => {
    spaceField.hidden = chosen() === 'glb'; // glTF has axes of its own
    command.textContent = name.validity.patternMismatch ? '' : commandOf(state, file(), axes());
  };
  dialog.form.addEventListener('input', update);
  update();
  if ((await show(dialog)) !== 'save') return;
  lastFormat = chosen();
  await write(store, file(), axes(), state);
}

async function write(store: Store, file: string, space: Space, state: Store['state']): Promise<void> {
  // A newer surface takes back the arrays of the one before, so take those of the moment, if they are what
  // the dialog described.
  const now = store.state;
  const described = now.scan === state.scan && commandOf(now, file, space) === commandOf(state, file, space);
  const meshes = described ? meshesOf(now) : undefined;
  if (!meshes) return showBanner('error', 'The surface changed meanwhile: export again.');
  const cancel = new AbortController();
  const progress = new ProgressBanner(`Writing ${file}…`, () => cancel.abort());
  try {
    save(await writeMesh(meshes.length === 1 ? meshes[0]! : meshes, file, { space, signal: cancel.signal, onProgress: (f) => progress.set(f) }), file);
  } catch (error) {
    if (!(error instanceof MarrowError && error.code === 130)) showBanner('error', messageOf(error));
  } finally {
    progress.remove();
  }
}
