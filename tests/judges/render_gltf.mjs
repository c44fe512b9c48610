// node render_gltf.mjs FILE.glb OUT.png WIDTH HEIGHT [AZ EL [ZOOM]]: a swatch as three.js shows it in headless
// Chromium: straight on, one distant light, no other; a white card that faces the light is just white.
// Exits 77 when Chromium cannot draw here.
import fs from 'fs';
import http from 'http';
import os from 'os';
import path from 'path';
import { spawn } from 'child_process';
const three = process.env.WEFT_JUDGES + '/node_modules/three/';
const [file, out, width, height, azimuth = '135', elevation = '45', zoom = '1'] = process.argv.slice(2);

const page = `<!doctype html><script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
const say = (what, body) => fetch('/' + what, { method: 'POST', body });
window.addEventListener('error', e => say('failed', e.message));
window.addEventListener('unhandledrejection', e => say('failed', String(e.reason)));
const THREE = await import('three');
const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
const { KTX2Loader } = await import('three/addons/loaders/KTX2Loader.js');
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(${width}, ${height}, false);
const ktx2 = new KTX2Loader().setTranscoderPath('/three/examples/jsm/libs/basis/').detectSupport(renderer);
const gltf = await new GLTFLoader().setKTX2Loader(ktx2).loadAsync('/swatch.glb');
const scene = new THREE.Scene(), size = new THREE.Box3().setFromObject(gltf.scene).getSize(new THREE.Vector3());
const w = size.x / ${zoom}, h = w * ${height} / ${width};
const camera = new THREE.OrthographicCamera(-w / 2, w / 2, h / 2, -h / 2, 0.01, 2);
camera.position.z = 1;
const az = ${azimuth} * Math.PI / 180, el = ${elevation} * Math.PI / 180;
const light = new THREE.DirectionalLight(0xffffff, Math.PI);
light.position.set(Math.cos(el) * Math.cos(az), Math.cos(el) * Math.sin(az), Math.sin(el));
scene.background = new THREE.Color().setRGB(0.18, 0.18, 0.18);
scene.add(gltf.scene, light);
renderer.render(scene, camera);
const materials = [];
gltf.scene.traverse(o => o.material && materials.push({ type: o.material.type, map: o.material.map?.image?.width, levels: o.material.roughnessMap?.mipmaps?.length, format: o.material.normalMap?.format }));
await say('about', JSON.stringify({ size_mm: [size.x * 1000, size.y * 1000], materials }));
await say('picture', renderer.domElement.toDataURL('image/png'));
</script>`;

const kinds = { '.js': 'text/javascript', '.wasm': 'application/wasm' };
const server = http.createServer((request, response) => {
    const url = request.url.split('?')[0];
    if (request.method === 'POST') {
        const parts = [];
        request.on('data', part => parts.push(part)).on('end', () => { response.end(); take(url, Buffer.concat(parts).toString()); });
        return;
    }
    const wanted = url === '/swatch.glb' ? file : url.startsWith('/three/') ? path.join(three, path.normalize(url.slice(7))) : null;
    if (url === '/') { response.setHeader('content-type', 'text/html'); response.end(page); return; }
    if (!wanted || !fs.existsSync(wanted)) { response.statusCode = 404; response.end(); return; }
    response.setHeader('content-type', kinds[path.extname(wanted)] || 'application/octet-stream');
    fs.createReadStream(wanted).pipe(response);
});

const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'weft-chromium-'));
let browser, words = '';
function finish(status, text) {
    if (text) console.log(text);
    browser.removeAllListeners('exit');
    browser.once('exit', () => { fs.rmSync(profile, { recursive: true, force: true, maxRetries: 5 }); process.exit(status); });
    try { process.kill(-browser.pid, 'SIGKILL'); } catch { process.exit(status); }
}
function take(url, body) {
    if (url === '/about') console.log(body);
    if (url === '/failed') finish(/WebGL/.test(body) ? 77 : 1, 'the page failed: ' + body);
    if (url === '/picture') { fs.writeFileSync(out, Buffer.from(body.split(',')[1], 'base64')); finish(0); }
}
server.listen(0, '127.0.0.1', () => {
    browser = spawn('chromium', ['--headless=new', '--no-sandbox', '--no-first-run', '--disable-extensions', '--disable-background-networking',
        '--disable-sync', '--disable-dev-shm-usage', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
        '--user-data-dir=' + profile, `http://127.0.0.1:${server.address().port}/`], { detached: true, stdio: ['ignore', 'ignore', 'pipe'] });
    browser.stderr.on('data', d => { words = (words + d).slice(-2000); });
    browser.on('exit', code => { console.log('chromium ended with ' + code + '\n' + words); process.exit(77); });
    setTimeout(() => finish(77, 'chromium did not draw within 4 minutes\n' + words), 240000);
});
