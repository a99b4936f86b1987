// From the index of a sample to its position in the patient (LPS, mm) and back.
export type Vec3 = [number, number, number];
export type Mat3 = [Vec3, Vec3, Vec3]; // rows

export interface Geometry {
  dims: Vec3;
  spacing: Vec3; // mm
  origin: Vec3; // the position of sample 0
  direction: Mat3; // its columns are the directions of the index axes
}

export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.sqrt(dot(a, a));
export const scale = (a: Vec3, f: number): Vec3 => [a[0] * f, a[1] * f, a[2] * f];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** The step from one sample to the next along an index axis, mm. */
export function column(g: Geometry, axis: number): Vec3 {
  return [0, 1, 2].map((p) => g.direction[p]![axis]! * g.spacing[axis]!) as Vec3;
}

export function toPhysical(g: Geometry, index: Vec3): Vec3 {
  return [0, 1, 2].map((p) => g.origin[p]! + [0, 1, 2].reduce((sum, a) => sum + g.direction[p]![a]! * g.spacing[a]! * index[a]!, 0)) as Vec3;
}

function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** The rows of the inverse matrix: the gradient of each index with respect to the position. */
export function indexGradients(g: Geometry): Mat3 {
  const [a, b, c] = [column(g, 0), column(g, 1), column(g, 2)];
  const det = dot(a, cross(b, c));
  return [scale(cross(b, c), 1 / det), scale(cross(c, a), 1 / det), scale(cross(a, b), 1 / det)];
}

export function toIndexSpace(g: Geometry, position: Vec3): Vec3 {
  const from = sub(position, g.origin);
  return indexGradients(g).map((row) => dot(row, from)) as Vec3;
}

export function clampIndex(g: Geometry, index: Vec3): Vec3 {
  return index.map((value, a) => Math.min(Math.max(value, 0), g.dims[a]! - 1)) as Vec3;
}
