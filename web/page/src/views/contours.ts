// The lines in which surfaces meet a slice: x0, y0, x1, y1, ...
import type { Crop, Mesh, Slice } from 'marrow-wasm';
import { contour } from 'marrow-wasm';
import type { Geometry } from '../scan/geometry';
import { dot, indexGradients } from '../scan/geometry';
import type { SliceGeometry } from './slice_geometry';

/** Columns and rows of a slice that count, both ends included. */
export interface SliceRange { first: [number, number]; last: [number, number] }

/** A growing list of numbers. */
class Lines {
  data = new Float32Array(4096);
  size = 0;
  add(x0: number, y0: number, x1: number, y1: number): void {
    if (this.size + 4 > this.data.length) {
      const larger = new Float32Array(this.data.length * 2);
      larger.set(this.data);
      this.data = larger;
    }
    this.data[this.size++] = x0; this.data[this.size++] = y0;
    this.data[this.size++] = x1; this.data[this.size++] = y1;
  }
  result(): Float32Array { return this.data.slice(0, this.size); }
}

/**
 * The outline of the isosurface in the samples of a range, in columns and rows of the slice. A closed surface is also
 * closed half a sample beyond the range.
 */
export function croppedContour(slice: Slice, isovalue: number, { closed, topology }: { closed: boolean; topology: boolean }, range?: SliceRange): Float32Array {
  const [x0, y0] = range?.first ?? [0, 0], [x1, y1] = range?.last ?? [slice.width - 1, slice.height - 1];
  const pad = closed ? 1 : 0, width = x1 - x0 + 1 + 2 * pad, height = y1 - y0 + 1 + 2 * pad;
  if (x1 < x0 || y1 < y0) return new Float32Array(0);
  // NaN counts as outside, and an edge to it is crossed in the middle, as at the border of a closed surface.
  const samples = new Float64Array(width * height).fill(NaN); // holds samples of each type as they are
  for (let y = y0; y <= y1; ++y)
    samples.set(slice.samples.subarray(y * slice.width + x0, y * slice.width + x1 + 1), (y - y0 + pad) * width + pad);
  const lines = contour({ ...slice, width, height, samples }, isovalue, { topology });
  for (let i = 0; i < lines.length; i += 2) {
    lines[i]! += x0 - pad;
    lines[i + 1]! += y0 - pad;
  }
  return lines;
}

/** The lines in which a mesh of a box of samples meets a slice, in samples from the top left sample. */
export function meshContour(
  { points, triangles }: Mesh, g: Geometry, box: Crop, slice: SliceGeometry, through: number): Float32Array {
  const lines = new Lines();
  const gradients = indexGradients(g);
  const gradient = gradients[slice.through]!;
  const offset = -dot(gradient, g.origin) - through, rounding = 1e-3; // of points on edges within the slice, to float32
  const heights = new Float32Array(points.length / 3);
  for (let i = 0, p = 0; i < heights.length; ++i, p += 3) {
    const height = gradient[0] * points[p]! + gradient[1] * points[p + 1]! + gradient[2] * points[p + 2]! + offset;
    heights[i] = Math.abs(height) < rounding ? 0 : height;
  }
  // Points in the slice count as being on its outer side. Each edge in the slice is then found once, from the
  // triangle on its inner side, even at the border of an open mesh.
  const zeroIsAbove = 2 * through >= box.first[slice.through]! + box.last[slice.through]!;
  const above = (point: number) => heights[point]! > 0 || (heights[point] === 0 && zeroIsAbove);
  const rowU = gradients[slice.across]!, rowV = gradients[slice.down]!;
  const baseU = -dot(rowU, g.origin), baseV = -dot(rowV, g.origin);
  const ends = new Float32Array(4);
  for (let t = 0; t < triangles.length; t += 3) {
    const i = triangles[t]!, j = triangles[t + 1]!, k = triangles[t + 2]!;
    const hi = above(i), hj = above(j), hk = above(k);
    if (hi === hj && hj === hk) continue;
    // The only corner on its side of the slice.
    const alone = hj === hk ? i : hi === hk ? j : k;
    if (heights[alone] === 0) continue; // the triangle only touches the slice
    let n = 0;
    for (const other of [i, j, k]) {
      if (other === alone) continue;
      const ha = heights[alone]!, f = ha / (ha - heights[other]!), a = 3 * alone, b = 3 * other;
      const x = points[a]! + f * (points[b]! - points[a]!);
      const y = points[a + 1]! + f * (points[b + 1]! - points[a + 1]!);
      const z = points[a + 2]! + f * (points[b + 2]! - points[a + 2]!);
      const u = rowU[0] * x + rowU[1] * y + rowU[2] * z + baseU, v = rowV[0] * x + rowV[1] * y + rowV[2] * z + baseV;
      ends[n++] = slice.acrossFlipped ? slice.size[0] - 1 - u : u;
      ends[n++] = slice.downFlipped ? slice.size[1] - 1 - v : v;
    }
    lines.add(ends[0]!, ends[1]!, ends[2]!, ends[3]!);
  }
  return lines.result();
}
