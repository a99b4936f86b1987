// What options may be. The library refuses values that are out of range; this is what would get lost on the way to it, because
// JSON has no NaN, and C++ drops fractions.
import { MarrowError } from './errors.mjs';

const number = { is: 'a finite number', fits: Number.isFinite };
const whole = { is: 'a whole number', fits: Number.isSafeInteger };
const flag = { is: 'true or false', fits: (value) => typeof value === 'boolean' };
const list = (count, of, is) => ({
  is, fits: (value) => Array.isArray(value) && (count === undefined || value.length === count) && value.every(of.fits),
});
const position = list(3, number, 'three finite numbers'), index = list(3, whole, 'three whole numbers');

const rules = {
  spacing: position, resample: flag, volume: whole,
  dims: index, origin: position, direction: list(9, number, 'nine finite numbers'),
  axis: whole, index: whole,
  closed: flag, snap: number, topology: flag, normals: flag,
  crop: { is: 'first and last, of three whole numbers each', fits: (crop) => index.fits(crop?.first) && index.fits(crop.last) },
  isovalue: number, level: whole,
  relax: whole, only: list(undefined, whole, 'whole numbers'),
  largest: flag, count: whole, minVolume: number, cavities: flag,
  iterations: whole, bound: { is: 'a finite number or a scan', fits: (bound) => number.fits(bound) || bound?.indexToPhysical !== undefined },
  keep: number, triangles: whole, maxError: number,
  minWall: number,
  colour: position,
  space: { is: "'LPS' or 'RAS'", fits: (space) => space === 'LPS' || space === 'RAS' },
};

const shown = (value) => (typeof value === 'object' && !Array.isArray(value) ? JSON.stringify(value) : String(value));

/** Returns options of the package. Throws a MarrowError with code 2 if one of them is not what its name stands for. */
export function checked(options) {
  for (const [name, value] of Object.entries(options)) {
    if (value !== undefined && !rules[name].fits(value))
      throw new MarrowError(`${name} must be ${rules[name].is}, not ${shown(value)}`, 2);
  }
  return options;
}
