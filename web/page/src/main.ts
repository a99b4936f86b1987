// Puts the page together.
import './style.css';
import { prepare, threads } from 'marrow-wasm';
import { messageOf, showBanner } from './banners';
import { Histogram, makeIsovalueRow } from './controls/histogram';
import { makePanel } from './controls/panel';
import { makeStatus } from './controls/status';
import { exportSurface } from './dialogs/export';
import { showHelp } from './dialogs/help';
import { byId, elementOf, save } from './dom';
import icons from './icons.svg?raw';
import { startOffline } from './offline';
import { commandOf, hidesAll, surfaceName } from './recipe';
import { filesOfDrop, filesOfInput } from './scan/collect_files';
import { openDemo, openScan } from './scan/open';
import { listenToKeys } from './keys';
import { Store } from './state';
import { Surfaces } from './surfaces';
import { startTheme, toggleTheme } from './theme';
import { makeViews } from './views/views';

document.body.prepend(new DOMParser().parseFromString(icons, 'image/svg+xml').documentElement);
document.body.firstElementChild!.setAttribute('hidden', '');

const store = new Store();
const fail = (error: unknown) => showBanner('error', messageOf(error));
const views = makeViews(store, () => histogram.dragging, fail);
const histogram = new Histogram(elementOf('div'), store, () => { surfaces.update(); views.surface?.draw(); });
const surfaces = new Surfaces(store, () => views.surface?.slow ?? false, () => histogram.dragging, fail);
makePanel(store);
makeIsovalue();
makeStatus(store);
startTheme(() => histogram.draw());

store.on(['scan'], () => {
  byId('welcome').hidden = store.state.scan !== undefined;
  byId('workspace').hidden = store.state.scan === undefined;
  document.title = store.state.scan ? `${store.state.scan.name} – Marrow` : 'Marrow';
});

function makeIsovalue(): void {
  const row = elementOf('div', { class: 'isovalue-row' });
  makeIsovalueRow(row, store);
  const line = elementOf('code', { tabindex: 0, 'aria-label': 'The command line that writes the same bytes' });
  const copy = elementOf('button', { class: 'text', type: 'button' }, 'Copy');
  copy.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(line.textContent ?? ''); // there is no clipboard without https
      copy.textContent = 'Copied';
      setTimeout(() => { copy.textContent = 'Copy'; }, 1500);
    } catch {
      getSelection()?.selectAllChildren(line);
      showBanner('note',
        'The browser does not let this page copy. The command line is selected: copy it with the keyboard.');
    }
  });
  const title = 'This command line writes the same bytes';
  const command = elementOf('div', { class: 'command', title }, line, copy);
  byId('isovalue').append(row, histogram.element, command);
  store.on(['scan', 'isovalue', 'closed', 'topology', 'largest', 'smooth', 'keep', 'crop', 'relax', 'hidden', 'table', 'labelSurfaces', 'asLabels'], () => {
    const s = store.state;
    row.hidden = histogram.element.hidden = s.asLabels;
    command.hidden = hidesAll(s);
    if (s.scan) line.textContent = commandOf(s, `${surfaceName(s)}.${s.asLabels ? '3mf' : 'stl'}`);
  });
}

// ------------------------------------------------------------------------------------------------ opening

const folderInput = byId<HTMLInputElement>('folder-input'), fileInput = byId<HTMLInputElement>('file-input');
const openFolder = () => folderInput.click(), openFile = () => fileInput.click();
for (const id of ['open-folder', 'welcome-folder']) byId(id).addEventListener('click', openFolder);
for (const id of ['open-file', 'welcome-file']) byId(id).addEventListener('click', openFile);
for (const input of [folderInput, fileInput]) {
  input.addEventListener('change', () => {
    const files = filesOfInput(input);
    input.value = ''; // so that the same choice is noticed again
    void openScan(store, files);
  });
}
byId('welcome-demo').addEventListener('click', ({ currentTarget }) => {
  const button = currentTarget as HTMLButtonElement;
  button.disabled = true;
  void openDemo(store).finally(() => { button.disabled = false; });
});

const veil = byId('drop-veil');
const hasFiles = (e: DragEvent) => e.dataTransfer?.types.includes('Files'); // and not a text
addEventListener('dragenter', (e) => { if (hasFiles(e)) veil.hidden = false; });
addEventListener('dragover', (e) => e.preventDefault());
addEventListener('dragleave', (e) => { if (e.relatedTarget === null) veil.hidden = true; });
addEventListener('drop', (e) => {
  e.preventDefault();
  veil.hidden = true;
  if (e.dataTransfer && hasFiles(e)) void openScan(store, filesOfDrop(e.dataTransfer));
});

// ------------------------------------------------------------------------------------------------ buttons and keys

const savePicture = () => {
  if (!views.surface) return showBanner('note', 'There is no picture without WebGL.');
  views.surface.picture().then((blob) => save(blob, `${surfaceName(store.state)}.png`), fail);
};
const actions = {
  openFolder, openFile, savePicture,
  export: () => void exportSurface(store),
  help: () => void showHelp(),
  theme: toggleTheme,
  reset: () => views.reset(),
  lookFrom: (direction: string) => views.surface?.lookFrom(direction),
};
byId('picture').addEventListener('click', savePicture);
byId('export').addEventListener('click', actions.export);
byId('help').addEventListener('click', actions.help);
byId('theme').addEventListener('click', actions.theme);
byId('reset').addEventListener('click', actions.reset);
for (const button of document.querySelectorAll<HTMLElement>('[data-from]')) button.addEventListener('click', () => actions.lookFrom(button.dataset['from']!));
for (const button of document.querySelectorAll<HTMLElement>('[data-tool]')) {
  button.addEventListener('click', () => store.set({ tool: button.dataset['tool'] as 'navigate', picked: undefined }));
  store.on(['tool'], () => button.setAttribute('aria-pressed', String(store.state.tool === button.dataset['tool'])));
}
listenToKeys(store, actions);

void startOffline();
if (typeof WebAssembly === 'undefined') showBanner('error', 'This browser has no WebAssembly, which reads and meshes the scan: use a newer browser, or allow it in the settings.');
else prepare().then(() => document.body.setAttribute('data-threads', String(threads())), fail);
