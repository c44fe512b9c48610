// node judge_basisu.mjs MATERIAL...: the KTX2 pictures inside gltf-ktx2/*.glb, each level through Khronos' rules
// (ktx-parse) and Binomial's transcoder (WebAssembly, as three.js ships it), against the textures of ktx2/; where their
// sides are no multiples of 4, against those stretched linearly.
import fs from 'fs';
import path from 'path';
import { createRequire } from 'module';
import { readLevels } from './ktx2_levels.mjs';
const modules = process.env.WEFT_JUDGES + '/node_modules/';
const basis = modules + 'three/examples/jsm/libs/basis/';
const require = createRequire(import.meta.url);
fs.copyFileSync(basis + 'basis_transcoder.js', 'basis_transcoder.cjs'); // the package calls it a module, which it is not
const BASIS = require(path.resolve('basis_transcoder.cjs'));
const transcoder = await new Promise(resolve => BASIS({ wasmBinary: fs.readFileSync(basis + 'basis_transcoder.wasm') }).then(m => resolve({ m })));
const { m } = transcoder;
m.initializeBasis();
const RGBA32 = 13, ETC1 = 0, BC7 = 6, ASTC = 10;
const suffix = { baseColor: 'base_color', normal: 'normal', occlusionRoughness: 'orm' };

let bad = 0, seen = 0;
const fail = text => { console.log('  ' + text); bad++; };

function pictures(file) {
    const glb = fs.readFileSync(file);
    const jsonLength = glb.readUInt32LE(12);
    const json = JSON.parse(glb.subarray(20, 20 + jsonLength));
    const bin = glb.subarray(28 + jsonLength);
    if (!json.extensionsRequired?.includes('KHR_texture_basisu')) fail('KHR_texture_basisu is not required');
    for (const texture of json.textures)
        if (texture.source !== undefined || !json.images[texture.extensions.KHR_texture_basisu.source]) fail('texture source');
    return json.images.map(image => {
        const view = json.bufferViews[image.bufferView];
        if (image.mimeType !== 'image/ktx2') fail(image.name + ': mimeType');
        return { name: image.name, bytes: new Uint8Array(bin.subarray(view.byteOffset, view.byteOffset + view.byteLength)) };
    });
}

function checkContainer(name, ktx) {
    const dfd = ktx.dataFormatDescriptor[0], srgb = name === 'baseColor' || name === 'sheenColor';
    const levels = 1 + Math.floor(Math.log2(Math.max(ktx.pixelWidth, ktx.pixelHeight)));
    if (ktx.vkFormat !== 0 || dfd.colorModel !== 166 || ktx.supercompressionScheme !== 2) fail(name + ': is not UASTC in Zstandard');
    if (dfd.transferFunction !== (srgb ? 2 : 1) || dfd.colorPrimaries !== (srgb ? 1 : 0) || dfd.flags !== 0) fail(name + ': colour space');
    if (dfd.samples.length !== 1 || ![0, 3].includes(dfd.samples[0].channelType) || dfd.bytesPlane[0] !== 16) fail(name + ': descriptor');
    if (ktx.pixelWidth % 4 || ktx.pixelHeight % 4 || ktx.levels.length !== levels) fail(name + ': size or levels');
    if (ktx.keyValue.KTXorientation !== 'rd' || ktx.keyValue.KTXswizzle) fail(name + ': orientation');
}

// The texels of a level of `other` as they lie under those of a w x h picture.
function stretched(other, level, w, h) {
    const l = Math.min(level, other.levels.length - 1), from = other.levels[l].levelData;
    const fw = Math.max(1, other.pixelWidth >> l), fh = Math.max(1, other.pixelHeight >> l);
    if (fw === w && fh === h) return from;
    const out = new Float64Array(4 * w * h), clamp = (v, n) => Math.min(Math.max(v, 0), n - 1);
    for (let y = 0; y < h; y++) for (let x = 0; x < w; x++) {
        const u = (x + 0.5) * fw / w - 0.5, v = (y + 0.5) * fh / h - 0.5, s = u - Math.floor(u), t = v - Math.floor(v);
        const at = (i, j, c) => from[4 * (clamp(Math.floor(v) + j, fh) * fw + clamp(Math.floor(u) + i, fw)) + c];
        for (let c = 0; c < 4; c++)
            out[4 * (y * w + x) + c] = (1 - t) * ((1 - s) * at(0, 0, c) + s * at(1, 0, c)) + t * ((1 - s) * at(0, 1, c) + s * at(1, 1, c));
    }
    return out;
}

for (const material of process.argv.slice(2)) {
    const title = path.basename(material, '.material');
    console.log(material);
    for (const { name, bytes } of pictures(`${material}/gltf-ktx2/${title}.glb`)) {
        const ktx = await readLevels(bytes);
        checkContainer(name, ktx);
        const file = new m.KTX2File(bytes);
        if (!file.isValid() || !file.isUASTC() || !file.startTranscoding()) { fail(name + ': the transcoder refuses it'); continue; }
        const other = suffix[name] ? await readLevels(new Uint8Array(fs.readFileSync(`${material}/ktx2/${title}_${suffix[name]}.ktx2`))) : null;
        const sameSize = other && other.pixelWidth === ktx.pixelWidth && other.pixelHeight === ktx.pixelHeight;
        const figures = [];
        for (let level = 0; level < file.getLevels(); level++) {
            const texels = new Uint8Array(file.getImageTranscodedSizeInBytes(level, 0, 0, RGBA32));
            if (!file.transcodeImage(texels, level, 0, 0, RGBA32, 0, -1, -1)) fail(`${name}: level ${level}`);
            for (const format of [ETC1, BC7, ASTC]) {
                const size = file.getImageTranscodedSizeInBytes(level, 0, 0, format);
                if (!file.transcodeImage(new Uint8Array(size), level, 0, 0, format, 0, -1, -1)) fail(`${name}: level ${level} to format ${format}`);
            }
            if (!other) continue;
            const wanted = stretched(other, level, Math.max(1, ktx.pixelWidth >> level), Math.max(1, ktx.pixelHeight >> level)), channels = name === 'occlusionRoughness' ? 2 : 3;
            let sum = 0;
            for (let i = 0; i < wanted.length; i += 4) for (let c = 0; c < channels; c++) sum += (wanted[i + c] - texels[i + c]) ** 2;
            figures.push(10 * Math.log10(255 ** 2 / Math.max(sum / (wanted.length / 4 * channels), 1e-3)));
            seen++;
        }
        console.log(`  ${name}: ${ktx.pixelWidth} x ${ktx.pixelHeight}, ${file.getLevels()} levels` +
            (figures.length ? `, PSNR ${figures.map(f => f.toFixed(0)).join(' ')} dB` : ''));
        if (figures.some(f => f < (sameSize ? 30 : 20))) fail(`${name}: a level is not the material's`);
        file.close(); file.delete();
    }
}
if (!seen) fail('nothing was compared');
process.exit(bad ? 1 : 0);
