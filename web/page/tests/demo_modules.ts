// What the tests make DICOM files with.
export { DIMS, headFile, headSlice } from '../src/demo/head';
