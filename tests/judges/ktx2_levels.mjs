// A KTX2 file as ktx-parse reads it, its levels inflated by the zstd that three.js ships (WebAssembly).
const modules = process.env.WEFT_JUDGES + '/node_modules/';
const { read } = await import(modules + 'ktx-parse/dist/index.mjs');
const { ZSTDDecoder } = await import(modules + 'three/examples/jsm/libs/zstddec.module.js');
const zstd = new ZSTDDecoder();
await zstd.init();

export async function readLevels(bytes) {
    const ktx = read(bytes);
    if (ktx.supercompressionScheme === 2)
        for (const level of ktx.levels) level.levelData = zstd.decode(level.levelData, level.uncompressedByteLength);
    return ktx;
}
