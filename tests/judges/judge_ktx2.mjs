// node judge_ktx2.mjs FILE.ktx2...: reads each with ktx-parse and its levels with the zstd of three.js; every level must
// have its size, the rest be as told.
import fs from 'fs';
import { readLevels } from './ktx2_levels.mjs';
let bad = 0;
for (const file of process.argv.slice(2)) {
    const ktx = await readLevels(new Uint8Array(fs.readFileSync(file)));
    const dfd = ktx.dataFormatDescriptor[0];
    const srgb = ktx.vkFormat === 43;
    const wrong = [];
    ktx.levels.forEach((level, l) => {
        const size = 4 * Math.max(1, ktx.pixelWidth >> l) * Math.max(1, ktx.pixelHeight >> l);
        if (level.uncompressedByteLength !== size) wrong.push(`level ${l} says ${level.uncompressedByteLength} bytes, not ${size}`);
        if (level.levelData.length !== size) wrong.push(`level ${l} has ${level.levelData.length} bytes, not ${size}`);
    });
    if (ktx.supercompressionScheme !== 2) wrong.push('is not supercompressed with Zstandard');
    if (ktx.levels.length !== 1 + Math.floor(Math.log2(Math.max(ktx.pixelWidth, ktx.pixelHeight)))) wrong.push('levels');
    if (dfd.transferFunction !== (srgb ? 2 : 1) || dfd.colorPrimaries !== (srgb ? 1 : 0)) wrong.push('descriptor');
    if (dfd.samples.length !== 4 || dfd.bytesPlane[0] !== 4) wrong.push('samples');
    if (ktx.keyValue.KTXorientation !== 'rd') wrong.push('orientation');
    console.log(`${file}: ${wrong.length ? wrong.join(', ') : 'good'}`);
    bad += wrong.length;
}
process.exit(bad ? 1 : 0);
