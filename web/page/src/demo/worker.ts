// Computes slices of the demo scan beside the page.
import type { DemoSlice, Range } from './demo';
import { DIMS, headFile } from './head';

const post = postMessage as (message: DemoSlice | 'done') => void;

onmessage = ({ data: { first, step } }: MessageEvent<Range>) => {
  for (let k = first; k < DIMS[2]; k += step) post({ k, file: headFile(k) });
  post('done');
};
