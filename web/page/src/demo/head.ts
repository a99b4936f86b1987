// Computes a CT of a head from simple shapes, to try the page on: skin, fat, muscle, brain, bone, teeth and a head rest.
// The shapes are signed distances in mm (negative inside), after Inigo Quilez' articles on distance functions.
// x runs to the patient's left, y to posterior, z to superior; the head is symmetrical, so x >= 0 suffices.

import { dicomSlice } from './dicom';

export const SPACING = 1.2; // mm
export const DIMS = [144, 196, 170] as const;
/** The position of the first sample. */
export const ORIGIN = [-SPACING * (DIMS[0] - 1) / 2, -118, -103] as const;

// ---------------------------------------------------------------------------------------------- shapes

function ellipsoid(x: number, y: number, z: number, rx: number, ry: number, rz: number): number {
  const a = x / rx, b = y / ry, c = z / rz, k = Math.sqrt(a * a + b * b + c * c);
  if (k < 1e-6) return -Math.min(rx, ry, rz);
  const d = a / rx, e = b / ry, f = c / rz;
  return (k * (k - 1)) / Math.sqrt(d * d + e * e + f * f);
}

function capsule(x: number, y: number, z: number, ax: number, ay: number, az: number, bx: number, by: number, bz: number, r0: number, r1: number): number {
  const dx = bx - ax, dy = by - ay, dz = bz - az, px = x - ax, py = y - ay, pz = z - az;
  const t = Math.min(Math.max((px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz), 0), 1);
  const qx = px - t * dx, qy = py - t * dy, qz = pz - t * dz;
  return Math.sqrt(qx * qx + qy * qy + qz * qz) - (r0 + t * (r1 - r0));
}

/** A union whose seam is rounded over k mm. */
function join(a: number, b: number, k: number): number {
  const h = Math.max(k - Math.abs(a - b), 0) / k;
  return Math.min(a, b) - h * h * k * 0.25;
}
/** a without b, with a rounded seam. */
const carve = (a: number, b: number, k: number): number => -join(-a, b, k);

// ---------------------------------------------------------------------------------------------- anatomy

const cranium = (x: number, y: number, z: number): number =>
  join(join(ellipsoid(x, y - 12, z - 32, 69, 84, 62), ellipsoid(x, y - 34, z - 24, 62, 62, 52), 20), ellipsoid(x, y + 32, z - 22, 52, 46, 42), 18);

// Teeth stand on an arch; each is a capsule that reaches from the jaw to the bite.
const TEETH = Array.from({ length: 8 }, (_, i) => {
  const angle = ((i + 0.5) / 8) * 1.32, molar = i >= 5;
  return { x: 26 * Math.sin(angle), y: -80 + 44 * (1 - Math.cos(angle)), r: molar ? 4.3 : i === 2 ? 3.5 : 3.1 };
});

function teeth(x: number, y: number, z: number): number {
  let d = 99;
  for (const { x: tx, y: ty, r } of TEETH) {
    d = Math.min(d, capsule(x, y, z, tx, ty, -51, tx, ty - 1, -58, r * 0.8, r));
    d = Math.min(d, capsule(x, y, z, tx * 0.97, ty + 1, -77, tx * 0.97, ty, -67, r * 0.8, r * 0.95));
  }
  return d;
}

function face(x: number, y: number, z: number): number {
  // Upper jaw, brow, cheekbone and its arch to the temple.
  let d = join(ellipsoid(x, y + 60, z + 34, 31, 24, 24), capsule(x, y, z, 14, -62, -46, 27, -44, -46, 9, 8), 10);
  d = join(d, capsule(x, y, z, 4, -77, 17, 43, -66, 13, 6, 6), 9);
  d = join(d, capsule(x, y, z, 46, -62, 12, 48, -58, -16, 5, 6), 7);
  d = join(d, capsule(x, y, z, 30, -70, -22, 50, -56, -18, 7, 7), 9);
  d = join(d, capsule(x, y, z, 50, -56, -17, 66, -14, -10, 4.6, 3.4), 5);
  d = join(d, capsule(x, y, z, 6, -76, 12, 14, -72, -22, 5, 5), 6);
  // Orbit and nose.
  d = carve(d, ellipsoid(x - 28 - 0.12 * (y + 70), y + 72, z + 3, 17, 30, 15.5), 4);
  d = carve(d, join(ellipsoid(x - 4, y + 84, z + 33, 8, 30, 10), capsule(x, y, z, 0, -88, -10, 4, -80, -30, 4, 7), 6), 3);
  d = join(d, capsule(x, y, z, 0, -81, 12, 2, -91, -8, 4, 3), 4);
  return carve(d, ellipsoid(x, y + 52, z + 62, 20, 26, 11), 4); // the palate
}

function jaw(x: number, y: number, z: number): number {
  let d = join(capsule(x, y, z, 0, -83, -89, 24, -70, -88, 9, 8), capsule(x, y, z, 24, -70, -87, 45, -28, -78, 8, 7), 6);
  d = join(d, ellipsoid(x - 6, y + 85, z + 94, 11, 8, 8), 8);
  d = join(d, capsule(x, y, z, 46, -24, -76, 52, -8, -44, 7.5, 6), 10);
  d = join(d, capsule(x, y, z, 52, -8, -44, 52, 0, -17, 5, 5), 6);
  return join(d, capsule(x, y, z, 50, -16, -46, 48, -26, -22, 4.5, 3), 6);
}

function spine(x: number, y: number, z: number): number {
  let d = 99;
  for (const level of [-50, -68, -86, -104]) {
    d = Math.min(d, ellipsoid(x, y - 22, z - level, 14, 11, 8));
    d = Math.min(d, capsule(x, y, z, 14, 26, level, 24, 34, level + 1, 6, 5));
    d = Math.min(d, capsule(x, y, z, 20, 36, level, 0, 56, level - 4, 5, 4));
  }
  return d;
}

// The shapes of the face reach to y = 10 and z = 40; above, skin follows the cranium.
function skin(x: number, y: number, z: number, skull: number, bones: number): number {
  let d = skull - 5.5;
  if (z > 45) return d;
  if (y < 12) {
    d = join(d, join(bones - 4.5, ellipsoid(x, y + 26, z + 40, 59, 55, 54), 18), 18);
    d = join(d, capsule(x, y, z, 0, -86, 8, 0, -107, -30, 6, 9), 13);
    d = join(d, capsule(x, y, z, 6, -101, -32, 12, -92, -33, 6, 5), 9);
    d = join(d, capsule(x, y, z, 0, -92, -56, 18, -83, -58, 3.2, 2.4), 9);
    d = join(d, capsule(x, y, z, 0, -91, -67, 16, -83, -66, 3.2, 2.4), 9);
    d = carve(d, capsule(x, y, z, 0, -99, -61.5, 21, -84, -62, 0.5, 0.5), 5);
    d = join(d, ellipsoid(x - 30, y + 69, z + 2, 14, 13.5, 13), 5); // eyelids
    d = carve(d, capsule(x, y, z, 19, -84, -3, 41, -79, -3, 0.5, 0.5), 3);
  }
  d = join(d, capsule(x, y, z, 0, 20, -40, 0, 26, -170, 52, 58), 24);
  const ear = carve(ellipsoid(x - 77 - 0.35 * (y - 12), y - 12, z + 6, 4.5, 16, 28), ellipsoid(x - 83 - 0.35 * (y - 12), y - 8, z + 6, 5, 9, 17), 3);
  return join(d, ear, 7);
}

// A curved plate behind the head, in which patients rest their head.
const rest = (x: number, y: number): number => (y > 40 ? Math.abs(Math.sqrt(x * x + (y - 2) * (y - 2)) - 108) - 1.6 : 99);

// ---------------------------------------------------------------------------------------------- values

/** How much of a sample lies inside. */
function part(d: number): number {
  const t = 0.5 - d / (3.2 * SPACING);
  return t <= 0 ? 0 : t >= 1 ? 1 : t * t * (3 - 2 * t);
}
const mix = (a: number, b: number, t: number): number => a + (b - a) * t;

// The folds, ventricles and fluid of the brain; `inner` is the distance from the inside of the skull.
function brain(x: number, y: number, z: number, inner: number): number {
  const folds = Math.sin(x * 0.29 + 2.1 * Math.sin(z * 0.13)) + Math.sin(y * 0.26 + 1.9 * Math.sin(x * 0.12)) + Math.sin(z * 0.27 + 2 * Math.sin(y * 0.11));
  const cortex = inner + 3 + 2.6 * Math.max(folds, -0.4);
  const ventricles = join(capsule(x, y, z, 7, -12, 42, 11, 34, 40, 5, 6), capsule(x, y, z, 11, 34, 40, 22, 14, 16, 5, 3), 5);
  const fissure = z > 44 ? x - 1.2 - 0.02 * z : 9;
  const matter = mix(mix(32, 40, part(cortex + 6)), 6, part(Math.min(ventricles, fissure)));
  return mix(9, matter, part(cortex));
}

// The seams of the skull are fine grooves: how deep, from 0 to 1.
function seams(x: number, y: number, z: number): number {
  const coronal = z > 20 ? Math.max(0, 1 - Math.abs(y + 30 + 8 * Math.sin(x * 0.08) + 1.6 * Math.sin(x * 0.9)) / 1.4) : 0;
  const sagittal = z > 30 && y > -30 && y < 62 ? Math.max(0, 1 - Math.abs(x + 1 - 1.6 * Math.sin(y * 0.8)) / 1.4) : 0;
  return Math.max(coronal, sagittal);
}

function value(x: number, y: number, z: number): number {
  const board = part(rest(x, y));
  if (board > 0) return mix(-1000, 180, board);
  const outer = cranium(x, y, z), inner = outer + 7;
  if (outer > 100 || (z > 45 && outer > 8)) return -1000;
  if (outer < -10 && z > 5) return brain(x, y, z, inner);

  const sinus = y > 0 || z > 20 ? 99 : join(ellipsoid(x - 4, y + 62, z + 28, 9, 22, 15), ellipsoid(x - 29, y + 56, z + 32, 9, 13, 12), 3);
  let bone = carve(Math.max(outer, -inner), capsule(x, y, z, 0, 26, -70, 0, 26, 0, 15, 15), 4), bones = 99;
  if (y < 12 && z < 40) {
    bones = face(x, y, z);
    bone = carve(join(bone, bones, 6), Math.min(sinus, ellipsoid(x, y + 60, z - 22, 16, 6, 7)), 2);
    bone = carve(bone, ellipsoid(x - 28 - 0.12 * (y + 70), y + 72, z + 3, 16.5, 34, 15), 3);
    if (z < -5) {
      const lower = jaw(x, y, z);
      bones = join(bones, lower, 20);
      bone = Math.min(bone, lower);
    }
  }
  if (z < 5 && y > -10) {
    bone = join(bone, ellipsoid(x - 58, y - 18, z + 24, 9, 13, 17), 8); // the mastoid process
    if (z < -30) bone = Math.min(bone, carve(spine(x, y, z), capsule(x, y, z, 0, 37, -130, 0, 37, 0, 8.5, 8.5), 2));
  }

  const body = skin(x, y, z, outer, bones);
  if (body > 3) return -1000;
  // Fat below the skin, then muscle.
  let hu = mix(45, -95, part(Math.abs(body + 4.5) - 1.6));
  hu = mix(hu, -1000, part(Math.max(Math.min(sinus, capsule(x, y, z, 0, -22, -36, 0, -6, -120, 7, 8)), body + 4)));
  const eye = ellipsoid(x - 30, y + 69, z + 2, 12, 12, 12); // with its lens
  hu = mix(hu, mix(12, 90, part(ellipsoid(x - 30, y + 78, z + 2, 5, 2.4, 5))), part(eye));
  if (inner < 2) hu = mix(hu, brain(x, y, z, inner), part(inner));
  // Bone is dense outside and spongy within.
  hu = mix(hu, mix(1350, 620, part(bone + 3.1)), part(bone + 1.1 * seams(x, y, z)));
  if (y < -10 && z < -44) hu = mix(hu, 2300, part(teeth(x, y, z)));
  return mix(-1000, hu, part(body));
}

/** The samples of slice k in Hounsfield units, x fastest. The noise is the same each time. */
export function headSlice(k: number): Int16Array {
  const [nx, ny] = DIMS, samples = new Int16Array(nx * ny), z = ORIGIN[2] + k * SPACING;
  let seed = k + 1;
  const noise = () => {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    return seed / 4294967296 - 0.5;
  };
  for (let j = 0; j < ny; ++j) {
    const y = ORIGIN[1] + j * SPACING;
    for (let i = nx / 2; i < nx; ++i) {
      const hu = value(ORIGIN[0] + i * SPACING, y, z), rough = hu > -990 ? 26 : 12;
      samples[j * nx + i] = Math.max(-1024, Math.round(hu + rough * (noise() + noise())));
      samples[j * nx + nx - 1 - i] = Math.max(-1024, Math.round(hu + rough * (noise() + noise())));
    }
  }
  return samples;
}

/** Slice k as a DICOM file. */
export function headFile(k: number): Uint8Array<ArrayBuffer> {
  return dicomSlice({ samples: headSlice(k), size: [DIMS[0], DIMS[1]], spacing: [SPACING, SPACING, SPACING],
    position: [ORIGIN[0], ORIGIN[1], ORIGIN[2] + k * SPACING], number: k + 1, description: 'Head, computed', uid: '2.25.246813579' });
}
