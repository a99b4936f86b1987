// The command line that does the same.

const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`);

export function commandLine({ scan, surfaces = [], extractor = {}, labels, components = {}, smooth, simplify = {}, output, space }) {
  const words = ['marrow', quoted(scan.name.startsWith('-') ? `./${scan.name}` : scan.name)];
  const add = (...more) => words.push(...more.map(String));
  const { series, spacing, resample, volume } = scan.options;
  if (series !== undefined) add('--series', quoted(String(series)));
  if (spacing) add('--spacing', spacing.join(','));
  if (resample) add('--resample');
  if (volume !== undefined) add('--volume', volume);
  const crop = labels ? labels.crop : extractor.crop;
  if (crop) add('--crop', `vox:${[0, 1, 2].flatMap((a) => [crop.first[a], crop.last[a]]).join(',')}`);
  if (labels) {
    add('--labels');
    if (labels.table) add(quoted(labels.table.name.startsWith('-') ? `./${labels.table.name}` : labels.table.name));
    if (labels.relax !== undefined && labels.relax !== 40) add('--relax', labels.relax);
    if (labels.only) add('--only', labels.only.join(','));
  }
  for (const surface of labels ? [] : surfaces) {
    if (typeof surface === 'number') add(`--isovalue${surface < 0 ? '=' : ' '}${surface}`);
    else add('--type', surface);
  }
  if (extractor.closed === false) add('--open');
  if (extractor.snap) add('--snap', extractor.snap);
  if (extractor.topology) add('--topology');
  if (components.largest) add('--largest');
  else if (components.count !== undefined) add('--components', components.count);
  if (components.minVolume) add('--clean-small', components.minVolume);
  if (components.cavities === false) add('--no-cavities');
  if (smooth) {
    add('--smooth', smooth.iterations ?? 20);
    if (typeof smooth.bound === 'number') add('--smooth-bound', smooth.bound);
    else if (smooth.bound) add('--smooth-bound');
  }
  if (simplify.keep !== undefined) add('--keep', simplify.keep);
  if (simplify.triangles !== undefined) add('--triangles', simplify.triangles);
  if (simplify.maxError !== undefined) add('--max-error', simplify.maxError);
  if (space === 'RAS') add('--space', 'RAS');
  add('-o', quoted(output.startsWith('-') ? `./${output}` : output));
  return words.join(' ');
}
