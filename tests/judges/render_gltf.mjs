// node render_gltf.mjs FILE.glb OUT.png WIDTH HEIGHT [AZ EL [ZOOM]]: a swatch as three.js shows it in headless
// Chromium: straight on, one distant light, no other; a white card that faces the light is just white.
// Exits 77 when Chromium cannot draw here.
import fs from 'fs';
import { showPage } from './chromium_page.mjs';
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

showPage(page, { three, files: { '/swatch.glb': file } }, (what, body, finish) => {
    if (what === 'about') console.log(body);
    if (what === 'picture') { fs.writeFileSync(out, Buffer.from(body.split(',')[1], 'base64')); finish(0); }
});
