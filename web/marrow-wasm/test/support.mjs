// What the tests share: the package, the native command line to compare with, and volumes.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { promisify } from 'node:util';

const root = new URL('../../../', import.meta.url);
const built = process.env.MARROW_WASM ?? fileURLToPath(new URL('build/web/marrow-wasm/', root));
export const marrow = await import(new URL('index.mjs', `file://${built}/`));
export const packageFolder = built;
export const repository = fileURLToPath(root);

/** The native program, or undefined: tests that compare with it are skipped then. */
export const native = [process.env.MARROW, fileURLToPath(new URL('build/release/bin/marrow', root))]
  .find((path) => path && existsSync(path));
export const withNative = { skip: native ? false : 'the native program is not built' };

/** A new folder, which is removed when the test ends. */
export function folder(test) {
  const path = mkdtempSync(join(tmpdir(), 'marrow-wasm-'));
  test.after(() => rmSync(path, { recursive: true }));
  return path;
}

/** Runs the native program. Returns its exit code and message. */
export async function runNative(args, cwd) {
  try {
    await promisify(execFile)(native, args, { cwd });
    return { code: 0, message: '' };
  } catch (error) {
    return { code: error.code, message: error.stderr.trim().replace(/^marrow: /, '') };
  }
}

/** The MarrowError that a promise rejects with. */
export async function rejection(promise) {
  try {
    await promise;
  } catch (error) {
    assert.ok(error instanceof marrow.MarrowError, String(error));
    return error;
  }
  assert.fail('it did not reject');
}

export async function bytesOf(blob) {
  return Buffer.from(await blob.arrayBuffer());
}

export const sampleTypes = {
  uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, int16: Int16Array, int32: Int32Array, float32: Float32Array,
  float64: Float64Array,
};

/** A lumpy solid that reaches the border, with noise. Its samples lie between 0 and 100. */
export function lumps(type, dims = [37, 29, 23]) {
  const [nx, ny, nz] = dims;
  const samples = new sampleTypes[type](nx * ny * nz);
  let random = 12345;
  for (let k = 0, i = 0; k < nz; ++k)
    for (let y = 0; y < ny; ++y)
      for (let x = 0; x < nx; ++x, ++i) {
        random = (Math.imul(random, 1103515245) + 12345) >>> 0;
        const value = 50 + 22 * (Math.sin(0.41 * x) + Math.sin(0.37 * y + 1) * Math.cos(0.53 * k)) + (random >>> 16) / 9000;
        samples[i] = type.startsWith('float') ? value : Math.round(value);
      }
  return samples;
}

export const geometry = {
  dims: [37, 29, 23], spacing: [0.7, 0.8, 1.1], origin: [-12.5, 4.25, 100], direction: [1, 0, 0, 0, 1, 0, 0, 0, 1],
};

const metaTypes = {
  uint8: 'UCHAR', int8: 'CHAR', uint16: 'USHORT', int16: 'SHORT', int32: 'INT', float32: 'FLOAT', float64: 'DOUBLE',
};

/** Writes a volume as MetaImage. Returns the path. */
export function writeVolume(path, type, samples, { dims, spacing, origin } = geometry) {
  const header = `ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1
Offset = ${origin.join(' ')}\nElementSpacing = ${spacing.join(' ')}\nDimSize = ${dims.join(' ')}
ElementType = MET_${metaTypes[type]}\nElementDataFile = LOCAL\n`;
  writeFileSync(path, Buffer.concat([Buffer.from(header), Buffer.from(samples.buffer)]));
  return path;
}

// An element of a DICOM data set, explicit and little-endian.
function element(group, number, vr, value) {
  let data = Buffer.isBuffer(value) ? value : Buffer.from(String(value), 'latin1');
  if (data.length % 2) data = Buffer.concat([data, Buffer.from(vr === 'UI' ? '\0' : ' ')]);
  const long = ['OB', 'OW', 'SQ', 'UN', 'UT'].includes(vr);
  const head = Buffer.alloc(long ? 12 : 8);
  head.writeUInt16LE(group, 0);
  head.writeUInt16LE(number, 2);
  head.write(vr, 4, 'latin1');
  if (long) head.writeUInt32LE(data.length, 8);
  else head.writeUInt16LE(data.length, 6);
  return Buffer.concat([head, data]);
}

const short = (value) => Buffer.from(Uint16Array.of(value).buffer);

// The pixels of one frame: as they are, or a compressed stream as the only fragment of a sequence.
function pixelData(frame, stream) {
  if (!stream) return element(0x7fe0, 0x10, 'OW', frame);
  const item = (tag, data) => Buffer.concat([Buffer.from([0xfe, 0xff, tag, 0xe0]), Buffer.from(Uint32Array.of(data.length).buffer), data]);
  const head = element(0x7fe0, 0x10, 'OB', Buffer.alloc(0));
  head.writeUInt32LE(0xffffffff, 8);
  const even = stream.length % 2 ? Buffer.concat([stream, Buffer.alloc(1)]) : stream;
  return Buffer.concat([head, item(0x00, Buffer.alloc(0)), item(0x00, even), item(0xdd, Buffer.alloc(0))]);
}

/**
 * The slices of a CT series as DICOM files: [{ path, data }]. Samples of up to `bits` bits are stored, signed if they have 16.
 * `streams` are compressed slices of the transfer syntax `syntax`.
 */
export function dicomSeries(samples, { dims: [nx, ny, nz], spacing, origin } = geometry,
  { description = 'lumps', characterSet = 'ISO_IR 100', uid = 1, bits = 16, syntax = '1.2.840.10008.1.2.1', streams = [] } = {}) {
  const Stored = bits > 8 ? Int16Array : Uint8Array;
  return Array.from({ length: nz }, (_, k) => {
    const pixels = Buffer.from(Stored.from(samples.subarray(k * nx * ny, (k + 1) * nx * ny)).buffer);
    const meta = Buffer.concat([
      element(2, 1, 'OB', Buffer.from([0, 1])),
      element(2, 2, 'UI', '1.2.840.10008.5.1.4.1.1.2'),
      element(2, 3, 'UI', `1.2.3.${uid}.${k + 1}`),
      element(2, 0x10, 'UI', syntax),
    ]);
    const data = Buffer.concat([
      Buffer.alloc(128), Buffer.from('DICM'), element(2, 0, 'UL', Buffer.from(Uint32Array.of(meta.length).buffer)), meta,
      element(8, 5, 'CS', characterSet),
      element(8, 0x16, 'UI', '1.2.840.10008.5.1.4.1.1.2'),
      element(8, 0x18, 'UI', `1.2.3.${uid}.${k + 1}`),
      element(8, 0x60, 'CS', 'CT'),
      element(8, 0x103e, 'LO', Buffer.from(description, 'latin1')),
      element(0x20, 0x0d, 'UI', '1.2.3'),
      element(0x20, 0x0e, 'UI', `1.2.3.${uid}`),
      element(0x20, 0x13, 'IS', k + 1),
      element(0x20, 0x32, 'DS', [origin[0], origin[1], +(origin[2] + k * spacing[2]).toFixed(6)].join('\\')),
      element(0x20, 0x37, 'DS', '1\\0\\0\\0\\1\\0'),
      element(0x20, 0x52, 'UI', '1.2.3.9'),
      element(0x28, 2, 'US', short(1)),
      element(0x28, 4, 'CS', 'MONOCHROME2'),
      element(0x28, 0x10, 'US', short(ny)),
      element(0x28, 0x11, 'US', short(nx)),
      element(0x28, 0x30, 'DS', `${spacing[1]}\\${spacing[0]}`),
      element(0x28, 0x100, 'US', short(bits > 8 ? 16 : 8)),
      element(0x28, 0x101, 'US', short(bits)),
      element(0x28, 0x102, 'US', short(bits - 1)),
      element(0x28, 0x103, 'US', short(bits === 16 ? 1 : 0)),
      element(0x28, 0x1052, 'DS', '0'),
      element(0x28, 0x1053, 'DS', '1'),
      pixelData(pixels, streams[k]),
    ]);
    return { path: `series/${String(k).padStart(3, '0')}.dcm`, data };
  });
}
