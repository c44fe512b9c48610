// node preview_three.mjs PAGE PICTURE: shows the page with three.js, prints what it measured and keeps what it drew.
import fs from 'fs';
import { showPage } from '../../judges/chromium_page.mjs';

const [page, picture] = process.argv.slice(2);
const three = process.env.WEFT_JUDGES + '/node_modules/three/';

showPage(fs.readFileSync(page, 'utf8'), { three, minutes: 9 }, (what, body, finish) => {
    if (what === 'picture') fs.writeFileSync(picture, Buffer.from(body.split(',')[1], 'base64'));
    if (what === 'measured') {
        const m = JSON.parse(body);
        finish(0, `three.js r${m.revision} on ${m.renderer}: ${(1 / m.best_s).toFixed(2)} frames/s ` +
            `(median ${(1 / m.median_s).toFixed(2)}, ${m.frames} frames, uploaded in ${m.upload_s.toFixed(1)} s)`);
    }
});
