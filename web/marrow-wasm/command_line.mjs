// The command line that does the same.
import { MarrowError } from './errors.mjs';

const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`);

// A file whose name begins as an option does, or is that of a command, is named by its path.
const commands = ['check', 'devices', 'help', 'info', 'sweep', 'terrain', 'view'];
const fileWord = (name) => quoted(name.startsWith('-') || commands.includes(name) ? `./${name}` : name);

export function commandLine({ scan, surfaces = [], extractor = {}, labels, components = {}, smooth, simplify = {}, output, space }) {
  if (/[{}]/.test(output)) throw new MarrowError(`'${output}' is a pattern on the command line: give a name without braces`, 2);
  const words = ['marrow', fileWord(scan.name)];
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
    if (labels.table) add(fileWord(labels.table.name));
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
  add('-o', fileWord(output));
  return words.join(' ');
}
