// The files that the user chose or dropped, with their paths.
import type { ScanFile } from 'marrow-wasm';

export function filesOfInput(input: HTMLInputElement): ScanFile[] {
  return [...(input.files ?? [])];
}

/** The files of a drop, folders included. Must be called before the event's handler returns for the first time. */
export async function filesOfDrop(transfer: DataTransfer): Promise<ScanFile[]> {
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  if (entries.length === 0) return [...transfer.files];
  const files: ScanFile[] = [];
  await Promise.all(entries.map((entry) => collect(entry, files)));
  // Entries arrive in any order; the command line sees them sorted.
  const path = (file: ScanFile) => ('path' in file ? file.path : file.name);
  return files.sort((a, b) => (path(a) < path(b) ? -1 : 1));
}

async function collect(entry: FileSystemEntry, files: ScanFile[]): Promise<void> {
  if (entry.isFile) {
    const data = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    files.push({ path: entry.fullPath.replace(/^\//, ''), data });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    // A reader hands out at most 100 entries at a time.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    await Promise.all(some.map((child) => collect(child, files)));
  }
}
