// Unpacks ZIP archives entry by entry, by the browser's own decompression.

const inNode = typeof process === 'object' && process.versions?.node !== undefined;
const kEnd = 0x06054b50, kEntry = 0x02014b50, kLocal = 0x04034b50;
const kDamaged = 'is a damaged or unsupported ZIP archive; unpack it first';

// Names that are not UTF-8 may be in any encoding. One of bytes keeps them apart.
function nameOf(bytes) {
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('latin1').decode(bytes);
  }
}

async function view(blob, begin, end) {
  return new DataView(await blob.slice(begin, end).arrayBuffer());
}

// The CRC-32 of each byte.
const kCrcs = Int32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; ++bit) byte = byte & 1 ? byte >>> 1 ^ 0xedb88320 : byte >>> 1;
  return byte;
});

// Reads data piece by piece, because it may be large.
async function isIntact(data, crc, size) {
  let found = -1;
  for (const reader = data.stream().getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) break;
    for (let i = 0; i < value.length; ++i) found = kCrcs[(found ^ value[i]) & 255] ^ found >>> 8;
  }
  return data.size === size && (~found >>> 0) === crc;
}

async function inflate(data) {
  // The streams of node 18 know no bare deflate.
  if (inNode) return new Blob([(await import('node:zlib')).inflateRawSync(await data.arrayBuffer())]);
  return new Response(data.stream().pipeThrough(new DecompressionStream('deflate-raw'))).blob();
}

async function content(archive, method, { crc, packed, size, offset }) {
  const local = await view(archive, offset, offset + 30);
  if (local.byteLength < 30 || local.getUint32(0, true) !== kLocal) throw new Error(kDamaged);
  const begin = offset + 30 + local.getUint16(26, true) + local.getUint16(28, true);
  const stored = archive.slice(begin, begin + packed);
  if (method !== 0 && method !== 8) throw new Error(kDamaged);
  const data = method === 0 ? stored : await inflate(stored).catch(() => undefined);
  if (!data || !(await isIntact(data, crc, size))) throw new Error(kDamaged);
  return data;
}

/** The files of an archive, as { path, data: Blob }. Throws an Error whose message continues the archive's name. */
export async function unzip(archive) {
  // The end record has a comment of up to 64 KiB after it.
  const tailBegin = Math.max(0, archive.size - 22 - 65535);
  const tail = await view(archive, tailBegin, archive.size);
  let end = tail.byteLength - 22;
  while (end >= 0 && tail.getUint32(end, true) !== kEnd) --end;
  if (end < 0) throw new Error(kDamaged);
  const count = tail.getUint16(end + 10, true), size = tail.getUint32(end + 12, true), begin = tail.getUint32(end + 16, true);
  if (count === 0xffff || begin === 0xffffffff) throw new Error('is a ZIP archive beyond 4 GiB or 65535 files; unpack it first');
  const list = await view(archive, begin, begin + size);
  const files = [];
  for (let i = 0, at = 0; i < count; ++i) {
    if (at + 46 > list.byteLength || list.getUint32(at, true) !== kEntry) throw new Error(kDamaged);
    const [name, extra, comment] = [28, 30, 32].map((offset) => list.getUint16(at + offset, true));
    const encrypted = list.getUint16(at + 8, true) & 1;
    const path = nameOf(new Uint8Array(list.buffer, at + 46, name));
    if (encrypted) throw new Error('is an encrypted ZIP archive; unpack it first');
    if (!path.endsWith('/') && !path.startsWith('__MACOSX/')) {
      const [crc, packed, size, offset] = [16, 20, 24, 42].map((field) => list.getUint32(at + field, true));
      const method = list.getUint16(at + 10, true);
      files.push({ path, data: await content(archive, method, { crc, packed, size, offset }) });
    }
    at += 46 + name + extra + comment;
  }
  return files;
}
