// The modules of the demo that the tests make DICOM files with.
export { dicomSlice } from '../src/demo/dicom';
export { DIMS, ORIGIN, SPACING, makeHead } from '../src/demo/head';
