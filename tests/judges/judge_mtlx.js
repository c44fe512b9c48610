// node judge_mtlx.js FILE.mtlx...: exits 1 unless MaterialX 1.39 (WebAssembly) validates each and makes a shader of it.
const fs = require('fs');
const os = require('os');
const path = require('path');
const bin = process.env.WEFT_JUDGES + '/node_modules/@needle-tools/materialx/bin';

// The package is made for bundlers: its last line is an ES module's, which node's require does not take.
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'weft-judge-'));
const script = path.join(work, 'materialx.cjs');
fs.writeFileSync(script, fs.readFileSync(bin + '/JsMaterialXGenShader.js', 'utf8').replace(/^export default .*$/m, ''));
const data = fs.readFileSync(bin + '/JsMaterialXGenShader.data.txt');

(async () => {
    const mx = await require(script)({
        locateFile: file => path.join(bin, path.basename(file)),
        getPreloadedPackage: () => data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength),
    });
    const generator = mx.EsslShaderGenerator.create();
    const context = new mx.GenContext(generator);
    const library = mx.loadStandardLibraries(context);
    let bad = 0;
    for (const file of process.argv.slice(2)) {
        const document = mx.createDocument();
        document.setDataLibrary(library);
        await mx.readFromXmlString(document, fs.readFileSync(file, 'utf8'), '');
        const valid = document.validate();
        const surface = mx.findRenderableElement(document);
        const shader = surface ? generator.generate('swatch', surface, context) : null;
        console.log(`${file}: ${valid ? 'valid' : 'NOT VALID'}, ${shader ? 'makes a shader' : 'NO SHADER'}`);
        bad += !valid || !shader;
    }
    fs.rmSync(work, { recursive: true });
    process.exit(bad ? 1 : 0);
})().catch(error => { console.log('NOT VALID:', error && error.message || error); process.exit(1); });
