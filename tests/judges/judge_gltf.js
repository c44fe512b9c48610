// node judge_gltf.js FILE.glb...: exits 1 unless the Khronos validator has nothing at all to say.
// It does not know KHR_texture_basisu (KhronosGroup/glTF-Validator#177): what it says of that alone is left out, and
// judge_basisu.mjs looks at those pictures.  A scan's sides are no powers of two, of which it informs for WebGL 1.
const fs = require('fs');
const validator = require(process.env.WEFT_JUDGES + '/node_modules/gltf-validator');
(async () => {
    let bad = 0;
    for (const file of process.argv.slice(2)) {
        const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
        const basisu = (info?.extensionsRequired || []).includes('KHR_texture_basisu');
        const ofBasisu = ({ code, message, pointer }) => basisu &&
            ((code === 'UNSUPPORTED_EXTENSION' && message.includes("'KHR_texture_basisu'")) ||
             (code === 'VALUE_NOT_IN_LIST' && message.includes("'image/ktx2'")) ||
             (code === 'UNUSED_OBJECT' && /^\/images\/\d+$/.test(pointer)) || code === 'IMAGE_UNRECOGNIZED_FORMAT');
        const messages = issues.messages.filter(m => !ofBasisu(m) && m.code !== 'IMAGE_NPOT_DIMENSIONS');
        console.log(`${file}: ${messages.length} issues`, messages.length ? JSON.stringify(messages) : '');
        bad += messages.length;
    }
    process.exit(bad ? 1 : 0);
})();
