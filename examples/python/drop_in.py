"""marching_cubes in place of scikit-image's: the same arguments, the same arrays.

usage: drop_in.py
"""

import numpy as np
from marrow import marching_cubes  # from skimage.measure import marching_cubes

k, j, i = np.ogrid[:64, :64, :64]
torus = 8 - np.hypot(np.hypot(k - 32, j - 32) - 20, i - 32)

verts, faces, normals, values = marching_cubes(torus, 0.0, spacing=(0.5, 0.5, 0.5))

corners = verts[faces].astype(float)
area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
exact = 4 * np.pi**2 * 10 * 4
print(f"{len(verts)} points, {len(faces)} faces, area {area:.0f} of {exact:.0f}")
