// Shows the files of a scan to the WebAssembly, read-only.
import { MarrowError } from './errors.mjs';
import { unzip } from './zip.mjs';

let mounts = 0;

const safe = (path) => path.split(/[\\/]+/).filter((part) => part && part !== '.' && part !== '..').join('/');
const isHeader = (path) => /\.(nhdr|mhd|hdr|hdr\.gz)$/i.test(path);
const isData = (path) => /\.(raw|zraw|img|bin|dat|gz|bz2|hex|txt)$/i.test(path) && !/\.nii\.gz$/i.test(path);
const isHidden = (path) => /(^|\/)(\.[^/]*|Thumbs\.db|desktop\.ini)$/i.test(path);  // systems put them beside files

async function expand(files) {
  const out = await unpacked(files), paths = new Set();
  for (const { path } of out) {
    if (paths.has(path)) throw new MarrowError(`there are two files '${path}': rename one, or its folder`, 2);
    paths.add(path);
  }
  return out;
}

// The files, and those in archives, as { path, blob }.
async function unpacked(files) {
  const out = [];
  for (const { path, data } of files) {
    const blob = data instanceof Uint8Array ? new Blob([data]) : data;
    if (!/\.zip$/i.test(path)) {
      out.push({ path: safe(path), blob });
      continue;
    }
    try {
      for (const entry of await unzip(blob)) out.push({ path: `${safe(path)}/${safe(entry.path)}`, blob: entry.data });
    } catch (error) {
      const reason = error instanceof DOMException ? `cannot be read: ${error.message}` : error.message;
      throw new MarrowError(`'${path}' ${reason}`, 3);
    }
  }
  return out;
}

// What to read: the only file, the only header of a header and its data, or the folder.
function chosen(paths) {
  const visible = paths.filter((path) => !isHidden(path)), headers = visible.filter(isHeader);
  if (visible.length === 1) return { path: visible[0], name: visible[0].split('/').pop() };
  if (headers.length === 1 && (visible.length === 2 || visible.every((path) => path === headers[0] || isData(path))))
    return { path: headers[0], name: headers[0].split('/').pop() };
  const top = paths[0].split('/')[0];
  const oneFolder = paths.every((path) => path.startsWith(`${top}/`));
  return oneFolder ? { path: top, name: top.replace(/\.zip$/i, '') } : { path: '', name: 'folder with these files' };
}

const kAhead = 1 << 18, kMostKept = 1 << 27;  // bytes
const kInputOutputError = 29;  // EIO of WebAssembly's system interface

// Reads files of browsers in pieces of at least 256 KiB, and keeps the last piece of each file. A piece takes a browser
// about a millisecond, and there may be thousands of files, each of which is looked at several times.
function readerAhead(FS) {
  const reader = new FileReaderSync(), kept = new Map();
  let size = 0;
  // A file may have been changed or removed meanwhile. C++ expects only errors of its own kind.
  const bytesOf = (blob) => {
    try {
      return new Uint8Array(reader.readAsArrayBuffer(blob));
    } catch {
      throw new FS.ErrnoError(kInputOutputError);
    }
  };
  return ({ node }, buffer, offset, length, position) => {
    const end = Math.min(position + length, node.size);
    if (position >= end) return 0;
    let piece = kept.get(node);
    if (!piece || position < piece.begin || end > piece.begin + piece.bytes.length) {
      const last = Math.max(end, Math.min(position + kAhead, node.size));
      piece = { begin: position, bytes: bytesOf(node.contents.slice(position, last)) };
      if (size > kMostKept) {
        kept.clear();
        size = 0;
      }
      kept.set(node, piece);
      size += piece.bytes.length;
    }
    buffer.set(piece.bytes.subarray(position - piece.begin, end - piece.begin), offset);
    return end - position;
  };
}

/** Mounts files: a path in node, or [{ path, data: Blob | Uint8Array }]. Returns where they are; end it by unmount(). */
export async function mount(module, files, inNode) {
  const { FS, NODEFS, WORKERFS } = module;
  const root = `/scan${++mounts}`;
  FS.mkdir(root);
  if (typeof files === 'string') {
    if (!inNode) throw new MarrowError('only node reads paths: give File objects or { path, data }', 2);
    const [{ statSync }, { basename, dirname, resolve }] = [await import('node:fs'), await import('node:path')];
    const full = resolve(files);
    const isFolder = statSync(full, { throwIfNoEntry: false })?.isDirectory() ?? false;
    const top = isFolder ? full : dirname(full);
    FS.mount(NODEFS, { root: top }, root);
    const name = basename(full);
    return { root, path: isFolder ? root : `${root}/${name}`, name };
  }
  const expanded = await expand(files);
  if (expanded.length === 0) throw new MarrowError('there are no files', 2);
  if (inNode) {
    for (const { path, blob } of expanded) {
      FS.mkdirTree(`${root}/${path}`.replace(/\/[^/]*$/, ''));
      FS.writeFile(`${root}/${path}`, new Uint8Array(await blob.arrayBuffer()));
    }
  } else {
    WORKERFS.stream_ops.read = readerAhead(FS);
    FS.mount(WORKERFS, { blobs: expanded.map(({ path, blob }) => ({ name: path, data: blob })) }, root);
  }
  const { path, name } = chosen(expanded.map((file) => file.path));
  return { root, path: path ? `${root}/${path}` : root, name };
}

function remove(FS, path) {
  for (const name of FS.readdir(path)) {
    if (name === '.' || name === '..') continue;
    const entry = `${path}/${name}`;
    if (FS.isDir(FS.lstat(entry).mode)) remove(FS, entry);
    else FS.unlink(entry);
  }
  FS.rmdir(path);
}

export function unmount({ FS, WORKERFS }, { root }) {
  delete WORKERFS.stream_ops.read;  // with what it kept
  if (FS.lookupPath(root).node.mount.mountpoint === root) {
    FS.unmount(root);
    FS.rmdir(root);
  } else {
    remove(FS, root);
  }
}
