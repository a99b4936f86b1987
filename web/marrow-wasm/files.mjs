// Shows the files of a scan to the WebAssembly, read-only.
import { unzip } from './zip.mjs';

let mounts = 0;

const safe = (path) => path.split(/[\\/]+/).filter((part) => part && part !== '.' && part !== '..').join('/');
const isHeader = (path) => /\.(nhdr|mhd|hdr|hdr\.gz)$/i.test(path);

async function expand(files) {
  const out = [];
  for (const { path, data } of files) {
    const blob = data instanceof Uint8Array ? new Blob([data]) : data;
    if (!/\.zip$/i.test(path)) {
      out.push({ path: safe(path), blob });
      continue;
    }
    const folder = safe(path).replace(/\.zip$/i, '');
    try {
      for (const entry of await unzip(blob)) out.push({ path: `${folder}/${safe(entry.path)}`, blob: entry.data });
    } catch (error) {
      throw Object.assign(new Error(`'${path}' ${error.message}`), { code: 3 });
    }
  }
  return out;
}

// What to read: the only file, the only header of a header and its data, or the folder.
function chosen(paths) {
  if (paths.length === 1) return { path: paths[0], name: paths[0].split('/').pop() };
  const headers = paths.filter(isHeader);
  if (headers.length === 1 && paths.length === 2) return { path: headers[0], name: headers[0].split('/').pop() };
  const top = paths[0].split('/')[0];
  const oneFolder = paths.every((path) => path.startsWith(`${top}/`));
  return oneFolder ? { path: top, name: top } : { path: '', name: 'scan' };
}

const kAhead = 1 << 18, kMostKept = 1 << 27;  // bytes

// Reads files of browsers in pieces of at least 256 KiB, and keeps the last piece of each file. A piece takes a browser
// about a millisecond, and there may be thousands of files, each of which is looked at several times.
function readerAhead() {
  const reader = new FileReaderSync(), kept = new Map();
  let size = 0;
  return ({ node }, buffer, offset, length, position) => {
    const end = Math.min(position + length, node.size);
    if (position >= end) return 0;
    let piece = kept.get(node);
    if (!piece || position < piece.begin || end > piece.begin + piece.bytes.length) {
      const last = Math.max(end, Math.min(position + kAhead, node.size));
      piece = { begin: position, bytes: new Uint8Array(reader.readAsArrayBuffer(node.contents.slice(position, last))) };
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
    const [{ statSync }, { basename, dirname, resolve }] = [await import('node:fs'), await import('node:path')];
    const full = resolve(files);
    const isFolder = statSync(full, { throwIfNoEntry: false })?.isDirectory() ?? false;
    const top = isFolder ? full : dirname(full);
    FS.mount(NODEFS, { root: top }, root);
    const name = basename(full);
    return { root, path: isFolder ? root : `${root}/${name}`, name };
  }
  const expanded = await expand(files);
  if (expanded.length === 0) throw Object.assign(new Error('there are no files'), { code: 2 });
  if (inNode) {
    for (const { path, blob } of expanded) {
      FS.mkdirTree(`${root}/${path}`.replace(/\/[^/]*$/, ''));
      FS.writeFile(`${root}/${path}`, new Uint8Array(await blob.arrayBuffer()));
    }
  } else {
    WORKERFS.stream_ops.read = readerAhead();
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
