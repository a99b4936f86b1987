// The geometry of slices in patient orientation, as in the desktop viewer.
import type { Geometry, Vec3 } from '../scan/geometry';
import { column, length, scale, dot } from '../scan/geometry';

export type Plane = 'axial' | 'coronal' | 'sagittal';
export const PLANES: readonly Plane[] = ['axial', 'coronal', 'sagittal'];

/** A point in a slice: samples to the right and down from the centre of the top left sample; or mm, or pixels. */
export type Point = [number, number];

/** Maps [u, v] to [a u + c v, b u + d v]. */
export interface Linear { a: number; b: number; c: number; d: number }

/**
 * How a slice is seen: as in radiology, the patient's right is on the left of axial and coronal slices, and anterior is
 * on the left of sagittal ones. Slices follow the index axes of the scan, so that they show unchanged samples; each
 * index axis stands for the nearest patient axis. A tilted gantry shears the scan: then the slice is a parallelogram.
 */
export interface SliceGeometry {
  plane: Plane;
  across: number; down: number; through: number; // index axes
  acrossFlipped: boolean; // the index grows to the left
  downFlipped: boolean; // the index grows upwards
  size: [number, number]; // samples across and down
  toMm: Linear; // from samples to mm, true to scale
  left: string; right: string; top: string; bottom: string;
  forward: string; backward: string; // the patient directions of a growing and a falling position along `through`
}

// The index axis nearest to each patient axis, and whether it runs the other way.
function patientAxes(g: Geometry): { index: Vec3; against: [boolean, boolean, boolean] } {
  const orders: Vec3[] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
  const alignment = (o: Vec3) => o.reduce((sum, axis, p) => sum + Math.abs(g.direction[p]![axis]!), 0);
  const index = orders.reduce((best, o) => (alignment(o) > alignment(best) + 1e-9 ? o : best));
  return { index, against: index.map((axis, p) => g.direction[p]![axis]! < 0) as [boolean, boolean, boolean] };
}

// Maps multiples of the vectors `across` and `down`, mm, to the right and down, and keeps the angle between them.
function trueToScale(across: Vec3, down: Vec3, upright: boolean): Linear {
  const wide = length(across), high = length(down);
  let cosine = dot(across, down) / (wide * high);
  if (Math.abs(cosine) < 1e-4) cosine = 0; // rounding
  const sine = Math.sqrt(1 - cosine * cosine);
  return upright ? { a: wide * sine, b: wide * cosine, c: 0, d: high } : { a: wide, b: 0, c: high * cosine, d: high * sine };
}

export function sliceGeometry(g: Geometry, plane: Plane): SliceGeometry {
  const axes = patientAxes(g);
  const LEFT = 0, POSTERIOR = 1, SUPERIOR = 2;
  const u = plane === 'sagittal' ? POSTERIOR : LEFT, v = plane === 'axial' ? POSTERIOR : SUPERIOR, w = 3 - u - v;
  const across = axes.index[u]!, down = axes.index[v]!, through = axes.index[w]!;
  const acrossFlipped = axes.against[u]!, downFlipped = axes.against[v]! !== (v === SUPERIOR);
  const along = (axis: number, flipped: boolean) => scale(column(g, axis), flipped ? -1 : 1);
  const upright = Math.abs(g.direction[v]![down]!) > Math.abs(g.direction[u]![across]!);
  const [backward, forward] = [['R', 'L'], ['A', 'P'], ['I', 'S']][w]! as [string, string];
  return {
    plane, across, down, through, acrossFlipped, downFlipped,
    size: [g.dims[across]!, g.dims[down]!],
    toMm: trueToScale(along(across, acrossFlipped), along(down, downFlipped), upright),
    left: plane === 'sagittal' ? 'A' : 'R', right: plane === 'sagittal' ? 'P' : 'L',
    top: plane === 'axial' ? 'A' : 'S', bottom: plane === 'axial' ? 'P' : 'I',
    forward, backward,
  };
}

export function toSlice(s: SliceGeometry, index: Vec3): Point {
  const u = index[s.across]!, v = index[s.down]!;
  return [s.acrossFlipped ? s.size[0] - 1 - u : u, s.downFlipped ? s.size[1] - 1 - v : v];
}

/** The index of a point in the slice; along `through` it is that of `other`. */
export function toIndex(s: SliceGeometry, [u, v]: Point, other: Vec3): Vec3 {
  const index: Vec3 = [...other];
  index[s.across] = s.acrossFlipped ? s.size[0] - 1 - u : u;
  index[s.down] = s.downFlipped ? s.size[1] - 1 - v : v;
  return index;
}

export function applyLinear(m: Linear, [u, v]: Point): Point {
  return [m.a * u + m.c * v, m.b * u + m.d * v];
}

export function applyInverse(m: Linear, [x, y]: Point): Point {
  const det = m.a * m.d - m.b * m.c;
  return [(m.d * x - m.c * y) / det, (m.a * y - m.b * x) / det];
}
