// Computes the demo scan beside the page.
import { dicomSlice } from './dicom';
import { DIMS, ORIGIN, SPACING, makeHead } from './head';

onmessage = () => {
  const ct = { samples: makeHead(), dims: DIMS, spacing: [SPACING, SPACING, SPACING] as const, origin: ORIGIN, description: 'Head, computed', uid: '2.25.246813579' };
  const files = Array.from({ length: DIMS[2] }, (_, k) => dicomSlice(ct, k));
  (postMessage as Worker['postMessage'])(files, files.map((file) => file.buffer));
};
