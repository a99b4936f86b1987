// The text of DICOM files.
import assert from 'node:assert/strict';
import test from 'node:test';

import { dicomSeries, geometry, lumps, marrow } from './support.mjs';

test('text that changes between character sets is read', async () => {
  const texts = [
    // PS3.5, H.3.2: half-width katakana, then kanji.
    ['ISO 2022 IR 13\\ISO 2022 IR 87', '\xd4\xcf\xc0\xde^\xc0\xdb\xb3=\x1b$B;3ED\x1b(J^\x1b$BB@O:\x1b(J', 'ﾔﾏﾀﾞ^ﾀﾛｳ=山田^太郎'],
    // I.2: each part of a name begins in the first set.
    ['\\ISO 2022 IR 149', 'Hong^Gildong=\x1b$)C\xfb\xf3^\x1b$)C\xd1\xce\xd4\xd7', 'Hong^Gildong=洪^吉洞'],
    ['ISO 2022 IR 100\\ISO 2022 IR 126', 'Caf\xe9 \x1b-F\xe1\xe2\xe3^\xe9', 'Café αβγ^é'],
    ['ISO_IR 192', Buffer.from('頭部').toString('latin1'), '頭部'],
  ];
  for (const [characterSet, description, text] of texts) {
    const { series } = await marrow.inspectScan(dicomSeries(lumps('int16'), geometry, { characterSet, description }));
    assert.equal(series[0].description, text);
  }
});
