// The outline of the isosurface in a slice, by marching squares: on the faces of cells, marching cubes does the same.

// Edges of a square, counter-clockwise: 0 below, 1 right, 2 above, 3 left. Corners 0 to 3 are the bits 1, 2, 4, 8, in the
// order (0, 0), (1, 0), (1, 1), (0, 1). Where two opposite corners are inside, each is cut off by itself. To join them instead,
// the pieces for the other two corners are used.
const kPieces = [
  [], [3, 0], [0, 1], [3, 1], [1, 2], [3, 0, 1, 2], [0, 2], [3, 2],
  [2, 3], [2, 0], [0, 1, 2, 3], [2, 1], [1, 3], [1, 0], [0, 3], [],
];

// Whether two inside corners at the ends of a diagonal are joined, by the asymptotic decider. Unlike on the surface, products
// are rounded, which can matter only where samples of floats nearly tie.
function joins(insideA, insideB, outsideA, outsideB, isovalue) {
  const outside = (outsideA - isovalue) * (outsideB - isovalue);
  return Number.isFinite(outside) && (insideA - isovalue) * (insideB - isovalue) >= outside;
}

export function contour({ width, height, samples, rescaled }, isovalue, { topology = false } = {}) {
  if (rescaled) isovalue = Math.fround(isovalue);  // as the values: where it is that of a sample, the sample is inside
  let out = new Float32Array(4096), size = 0;
  const corners = new Float64Array(4);
  const put = (edge, x, y) => {
    const a = corners[edge], b = corners[(edge + 1) & 3];
    const t = (isovalue - a) / (b - a);
    // Where a sample is not finite, the surface is in the middle.
    const part = t >= 0 && t <= 1 ? t : 0.5;
    out[size++] = edge === 0 ? x + part : edge === 1 ? x + 1 : edge === 2 ? x + 1 - part : x;
    out[size++] = edge === 0 ? y : edge === 1 ? y + part : edge === 2 ? y + 1 : y + 1 - part;
  };
  for (let y = 0; y + 1 < height; ++y) {
    for (let x = 0, at = y * width; x + 1 < width; ++x, ++at) {
      const a = samples[at], b = samples[at + 1], c = samples[at + 1 + width], d = samples[at + width];
      const inside = (a >= isovalue && a < Infinity ? 1 : 0) | (b >= isovalue && b < Infinity ? 2 : 0) |
                     (c >= isovalue && c < Infinity ? 4 : 0) | (d >= isovalue && d < Infinity ? 8 : 0);
      if (inside === 0 || inside === 15) continue;
      if (size + 8 > out.length) {
        const larger = new Float32Array(2 * out.length);
        larger.set(out);
        out = larger;
      }
      corners[0] = a, corners[1] = b, corners[2] = c, corners[3] = d;
      const joined = topology && (inside === 5 ? joins(a, c, b, d, isovalue) : inside === 10 && joins(b, d, a, c, isovalue));
      for (const edge of kPieces[joined ? 15 - inside : inside]) put(edge, x, y);
    }
  }
  return out.slice(0, size);
}
