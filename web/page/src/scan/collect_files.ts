// The files that the user chose or dropped, with their paths.
import type { ScanFile } from 'marrow-wasm';

export function filesOfInput(input: HTMLInputElement): ScanFile[] {
  return [...(input.files ?? [])];
}

/** The path of a file in what the user chose; its name alone if that is the file itself. */
export const pathOf = (file: ScanFile): string => ('path' in file ? file.path : file.webkitRelativePath || file.name);

/** The files of a drop, folders included. Must be called before the event's handler returns for the first time. */
export async function filesOfDrop(transfer: DataTransfer): Promise<ScanFile[]> {
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  if (entries.length === 0) return [...transfer.files];
  const files: ScanFile[] = [];
  await Promise.all(entries.map((entry) => collect(entry, files)));
  // Entries arrive in any order; the command line sees them sorted.
  return files.sort((a, b) => (pathOf(a) < pathOf(b) ? -1 : 1));
}

async function collect(entry: FileSystemEntry, files: ScanFile[]): Promise<void> {
  const path = entry.fullPath.replace(/^\//, '');
  // The browser's error does not name the file.
  const refuse = (reject: (error: Error) => void) => ({ message }: DOMException) => reject(new Error(`'${path}' cannot be read: ${message}`));
  if (entry.isFile) {
    const data = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, refuse(reject)));
    files.push({ path, data });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    // A reader hands out at most 100 entries at a time.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, refuse(reject)));
    if (some.length === 0) return;
    await Promise.all(some.map((child) => collect(child, files)));
  }
}
