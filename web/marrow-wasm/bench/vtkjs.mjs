// Compares the next isovalue of a slider with vtk.js's vtkImageMarchingCubes, with merged points and normals.
// usage: node web/marrow-wasm/bench/vtkjs.mjs FOLDER SCAN ISOVALUE...    FOLDER: where `npm install @kitware/vtk.js` ran
import { pathToFileURL } from 'node:url';

const [folder, input, ...isovalues] = process.argv.slice(2);
const vtk = (name) => import(pathToFileURL(`${folder}/node_modules/@kitware/vtk.js/${name}.js`)).then((m) => m.default);
const [ImageData, DataArray, MarchingCubes] =
  await Promise.all(['Common/DataModel/ImageData', 'Common/Core/DataArray', 'Filters/General/ImageMarchingCubes'].map(vtk));
const { Extractor, readScan } = await import(new URL('../../../build/web/marrow-wasm/index.mjs', import.meta.url));

const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
const scan = await readScan(input);
const slices = await Promise.all(Array.from({ length: scan.dims[2] }, (_, k) => scan.slice(2, k)));
const samples = new slices[0].samples.constructor(scan.dims[0] * scan.dims[1] * scan.dims[2]);
slices.forEach((slice, k) => samples.set(slice.samples, k * scan.dims[0] * scan.dims[1]));
const image = ImageData.newInstance({ extent: scan.dims.flatMap((n) => [0, n - 1]), spacing: scan.spacing });
image.getPointData().setScalars(DataArray.newInstance({ values: samples, numberOfComponents: 1 }));

const extractor = await Extractor.create(scan, { closed: false });
let mesh = await extractor.extract(Number(isovalues[0]) + 1);
const ours = [], inWorker = [], theirs = [];
for (let round = 0; round < 3; ++round) {
  for (const isovalue of isovalues.map(Number)) {
    for (let i = 0; i < 5; ++i) {
      extractor.recycle(mesh);
      const start = performance.now();
      mesh = await extractor.extract(isovalue + 5 * i);
      ours.push(performance.now() - start);
      inWorker.push(mesh.stats.extractMs);
    }
    const cubes = MarchingCubes.newInstance({ contourValue: isovalue, computeNormals: true, mergePoints: true });
    cubes.setInputData(image);
    const start = performance.now();
    cubes.update();
    theirs.push(performance.now() - start);
    const points = cubes.getOutputData().getPoints().getNumberOfPoints();
    if (round === 0) console.log(`isovalue ${isovalue}: vtk.js ${points} points, ours ${mesh.points.length / 3} at ${isovalue + 20}`);
  }
}
const [a, b, c] = [median(ours), median(inWorker), median(theirs)];
console.log(`medians: ours ${a.toFixed(1)} ms with the copy, ${b.toFixed(1)} ms in the worker; vtk.js ${c.toFixed(0)} ms: ` +
  `${(c / a).toFixed(0)} and ${(c / b).toFixed(0)} times as fast`);
scan.dispose();
