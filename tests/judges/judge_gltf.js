// node judge_gltf.js FILE.glb...: exits 1 unless the Khronos validator has nothing at all to say.
const fs = require('fs');
const validator = require(process.env.WEFT_JUDGES + '/node_modules/gltf-validator');
(async () => {
    let bad = 0;
    for (const file of process.argv.slice(2)) {
        const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
        const count = issues.numErrors + issues.numWarnings + issues.numInfos + issues.numHints;
        console.log(`${file}: ${count} issues`, count ? JSON.stringify(issues.messages) : '');
        bad += count;
    }
    process.exit(bad ? 1 : 0);
})();
