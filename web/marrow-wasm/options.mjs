// What arguments may be. The library refuses values that are out of range. Checked here is what would get lost on the way to it,
// because JSON has no NaN, and C++ drops fractions and high bits, and what the library could not tell from a fault of the scan.
import { MarrowError } from './errors.mjs';

const number = { is: 'a finite number', fits: Number.isFinite };
const positive = { is: 'a positive number', fits: (value) => Number.isFinite(value) && value > 0 };
const whole = { is: 'a whole number', fits: Number.isSafeInteger };
const int = { is: 'a whole number of 32 bits', fits: (value) => Number.isInteger(value) && (value | 0) === value };
const text = { is: 'text', fits: (value) => typeof value === 'string' };
const flag = { is: 'true or false', fits: (value) => typeof value === 'boolean' };
const list = (count, of, is) => ({
  is, fits: (value) => Array.isArray(value) && (count === undefined || value.length === count) && value.every(of.fits),
});
const position = list(3, number, 'three finite numbers'), index = list(3, whole, 'three whole numbers');
const needed = (rule) => ({ ...rule, needed: true });

function isUrl(value) {
  try {
    return Boolean(new URL(value, globalThis.location?.href));
  } catch {
    return false;
  }
}

const rules = {
  threads: { is: 'a whole number from 1', fits: (threads) => whole.fits(threads) && threads >= 1 },
  baseUrl: { is: 'a URL', fits: isUrl },
  onProgress: { is: 'a function', fits: (onProgress) => typeof onProgress === 'function' },
  signal: { is: 'an AbortSignal', fits: (signal) => typeof signal?.addEventListener === 'function' },
  spacing: list(3, positive, 'three positive numbers'), resample: flag, volume: whole,
  dims: needed(index), origin: position, direction: list(9, number, 'nine finite numbers'),
  axis: needed({ is: '0, 1 or 2', fits: (axis) => [0, 1, 2].includes(axis) }), index: needed(whole),
  closed: flag, snap: number, topology: flag, normals: flag,
  crop: { is: 'first and last, of three whole numbers each', fits: (crop) => index.fits(crop?.first) && index.fits(crop.last) },
  isovalue: needed(number), level: int,
  relax: { is: 'a whole number from 0', fits: (relax) => int.fits(relax) && relax >= 0 },
  only: list(undefined, whole, 'whole numbers'),
  table: { is: 'what readLabelTable() resolves to', fits: (table) => Array.isArray(table?.labels) },
  largest: flag, count: whole, minVolume: number, cavities: flag,
  iterations: int, bound: { is: 'a finite number or a scan', fits: (bound) => number.fits(bound) || bound?.indexToPhysical !== undefined },
  keep: { is: 'above 0 and at most 1', fits: (keep) => positive.fits(keep) && keep <= 1 },
  triangles: whole, maxError: number,
  scan: { is: 'a scan', fits: (scan) => position.fits(scan?.spacing) },
  minWall: number,
  name: text, colour: position,
  space: { is: "'LPS' or 'RAS'", fits: (space) => space === 'LPS' || space === 'RAS' },
};

const shown = (value) => (typeof value === 'object' && !Array.isArray(value) ? JSON.stringify(value) : String(value));

/** Returns arguments. Throws a MarrowError with code 2 if one of them is missing, or not what its name stands for. */
export function checked(options) {
  for (const [name, value] of Object.entries(options)) {
    const { is, fits, needed } = rules[name];
    if (value === undefined ? needed : !fits(value)) throw new MarrowError(`${name} must be ${is}, not ${shown(value)}`, 2);
  }
  return options;
}
