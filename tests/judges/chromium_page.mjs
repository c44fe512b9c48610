// Shows a page in headless Chromium on its software rasteriser (SwiftShader) and hears what it says.
//
// showPage(page, { three, files, minutes }, hear): `page` is HTML; three.js is under /three/, `files` maps other
// paths to files.  The page says things by fetch('/WHAT', { method: 'POST', body }); hear(WHAT, body, finish) gets
// them, and finish(status, text) ends the program.  'failed' is heard here: 77 where Chromium has no WebGL, else 1.
// 77 too when Chromium does not start or says nothing more for `minutes`.
import fs from 'fs';
import http from 'http';
import os from 'os';
import path from 'path';
import { spawn } from 'child_process';

const kinds = { '.js': 'text/javascript', '.wasm': 'application/wasm' };
const options = ['--headless=new', '--no-sandbox', '--no-first-run', '--disable-extensions', '--disable-background-networking',
    '--disable-sync', '--disable-dev-shm-usage', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

export function showPage(page, { three, files = {}, minutes = 4 }, hear) {
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'weft-chromium-'));
    let browser, words = '';
    function finish(status, text) {
        if (text) console.log(text);
        browser.removeAllListeners('exit');
        browser.once('exit', () => {
            try { fs.rmSync(profile, { recursive: true, force: true, maxRetries: 5 }); } catch { /* a last helper still writes there */ }
            process.exit(status);
        });
        try { process.kill(-browser.pid, 'SIGKILL'); } catch { process.exit(status); }
    }
    function take(what, body) {
        if (what === 'failed') finish(/WebGL/.test(body) ? 77 : 1, 'the page failed: ' + body);
        else hear(what, body, finish);
    }
    const server = http.createServer((request, response) => {
        const url = request.url.split('?')[0];
        if (request.method === 'POST') {
            const parts = [];
            request.on('data', part => parts.push(part)).on('end', () => { response.end(); take(url.slice(1), Buffer.concat(parts).toString()); });
            return;
        }
        const wanted = url.startsWith('/three/') ? path.join(three, path.normalize(url.slice(7))) : files[url];
        if (url === '/') { response.setHeader('content-type', 'text/html'); response.end(page); return; }
        if (!wanted || !fs.existsSync(wanted)) { response.statusCode = 404; response.end(); return; }
        response.setHeader('content-type', kinds[path.extname(wanted)] || 'application/octet-stream');
        fs.createReadStream(wanted).pipe(response);
    });
    server.listen(0, '127.0.0.1', () => {
        browser = spawn('chromium', [...options, '--user-data-dir=' + profile, `http://127.0.0.1:${server.address().port}/`],
            { detached: true, stdio: ['ignore', 'ignore', 'pipe'] });
        browser.stderr.on('data', d => { words = (words + d).slice(-2000); });
        browser.on('exit', code => { console.log('chromium ended with ' + code + '\n' + words); process.exit(77); });
        setTimeout(() => finish(77, `chromium did not draw within ${minutes} minutes\n` + words), minutes * 60000);
    });
}
