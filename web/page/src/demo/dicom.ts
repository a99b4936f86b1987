// Writes DICOM files of a CT, one a slice: uncompressed, little-endian, with explicit value representations.

export interface CtSlice {
  samples: Int16Array; // row by row
  size: readonly [number, number]; // columns and rows
  spacing: readonly [number, number, number]; // mm: between columns, rows and slices
  position: readonly [number, number, number]; // of the first sample, LPS
  number: number; // in the series, from 1
  description: string;
  uid: string; // of the series; those of its slices begin with it
}

const CT_IMAGE = '1.2.840.10008.5.1.4.1.1.2', EXPLICIT_LITTLE_ENDIAN = '1.2.840.10008.1.2.1';
const LONG = new Set(['OB', 'OW']); // their length takes four bytes

type Value = string | Uint8Array;

function element(tag: number, vr: string, value: Value): Uint8Array {
  let bytes = typeof value === 'string' ? new TextEncoder().encode(value) : value;
  if (bytes.length % 2 === 1) {
    const even = new Uint8Array(bytes.length + 1).fill(vr === 'UI' || vr === 'OB' ? 0 : 0x20);
    even.set(bytes);
    bytes = even;
  }
  const head = LONG.has(vr) ? 12 : 8, out = new Uint8Array(head + bytes.length), view = new DataView(out.buffer);
  view.setUint16(0, tag >>> 16, true);
  view.setUint16(2, tag & 0xffff, true);
  out.set(new TextEncoder().encode(vr), 4);
  if (head === 12) view.setUint32(8, bytes.length, true);
  else view.setUint16(6, bytes.length, true);
  out.set(bytes, head);
  return out;
}

function number16(value: number): Uint8Array {
  return new Uint8Array([value & 255, value >> 8]);
}

function number32(value: number): Uint8Array {
  return new Uint8Array(new Uint32Array([value]).buffer);
}

function joined(parts: Uint8Array[]): Uint8Array {
  const out = new Uint8Array(parts.reduce((sum, p) => sum + p.length, 0));
  let at = 0;
  for (const p of parts) { out.set(p, at); at += p.length; }
  return out;
}

const decimal = (value: number): string => String(Number(value.toFixed(6)));

/** The file of a slice. */
export function dicomSlice(ct: CtSlice): Uint8Array<ArrayBuffer> {
  const [nx, ny] = ct.size, [sx, sy, sz] = ct.spacing, instance = `${ct.uid}.${ct.number}`;
  const meta = [
    element(0x00020001, 'OB', new Uint8Array([0, 1])),
    element(0x00020002, 'UI', CT_IMAGE),
    element(0x00020003, 'UI', instance),
    element(0x00020010, 'UI', EXPLICIT_LITTLE_ENDIAN),
    element(0x00020012, 'UI', '2.25.118718181'),
  ];
  const data = [
    element(0x00080008, 'CS', 'DERIVED\\SECONDARY\\AXIAL'),
    element(0x00080016, 'UI', CT_IMAGE),
    element(0x00080018, 'UI', instance),
    element(0x00080060, 'CS', 'CT'),
    element(0x0008103e, 'LO', ct.description),
    element(0x00100010, 'PN', 'Demo'),
    element(0x00180050, 'DS', decimal(sz)),
    element(0x0020000d, 'UI', `${ct.uid}.0.1`),
    element(0x0020000e, 'UI', ct.uid),
    element(0x00200011, 'IS', '1'),
    element(0x00200013, 'IS', String(ct.number)),
    element(0x00200032, 'DS', ct.position.map(decimal).join('\\')),
    element(0x00200037, 'DS', '1\\0\\0\\0\\1\\0'),
    element(0x00200052, 'UI', `${ct.uid}.0.2`),
    element(0x00280002, 'US', number16(1)),
    element(0x00280004, 'CS', 'MONOCHROME2'),
    element(0x00280010, 'US', number16(ny)),
    element(0x00280011, 'US', number16(nx)),
    element(0x00280030, 'DS', `${decimal(sy)}\\${decimal(sx)}`),
    element(0x00280100, 'US', number16(16)),
    element(0x00280101, 'US', number16(16)),
    element(0x00280102, 'US', number16(15)),
    element(0x00280103, 'US', number16(1)),
    element(0x00281052, 'DS', '0'),
    element(0x00281053, 'DS', '1'),
    element(0x7fe00010, 'OW', new Uint8Array(ct.samples.buffer, ct.samples.byteOffset, ct.samples.byteLength)),
  ];
  const length = meta.reduce((sum, p) => sum + p.length, 0);
  const preamble = new Uint8Array(132);
  preamble.set(new TextEncoder().encode('DICM'), 128);
  return joined([preamble, element(0x00020000, 'UL', number32(length)), ...meta, ...data]) as Uint8Array<ArrayBuffer>;
}
