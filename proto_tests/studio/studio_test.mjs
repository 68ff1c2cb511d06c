// Foxglove Studio's own front end, from npm, in Debian's Chromium against the real daemon and a
// simulated robot: it lists the channels, shows the map, and what its Publish panel sends is painted.
// The page is served from another origin than the daemon's, which web.origins permits. A screenshot is
// left in OUT.
//
// Usage: node studio_test.mjs BIN_DIR OUT
import {spawnSync} from 'node:child_process';
import {createReadStream, existsSync, statSync} from 'node:fs';
import {createServer} from 'node:http';
import {extname, join, normalize} from 'node:path';
import {chromium} from 'playwright-core';
import {Swarm, TOKEN, check, until} from './swarm.mjs';

const [binDir, out] = process.argv.slice(2);
const TYPES = {'.js': 'text/javascript', '.html': 'text/html', '.wasm': 'application/wasm', '.json': 'application/json'};
const PAGE = `<!doctype html><meta charset="utf-8"><title>Studio</title>
<style>html, body, #root { height: 100%; margin: 0 }</style><div id="root"></div>
<script src="/react/umd/react.production.min.js"></script>
<script src="/react-dom/umd/react-dom.production.min.js"></script>
<script>self.react = React; self["react-dom"] = ReactDOM;</script>
<script src="/studio/index.js"></script><script type="module" src="/page.js"></script>`;
const FOLDERS = {'/studio/': 'node_modules/@foxglove/studio-base/assets/', '/react/': 'node_modules/react/',
                 '/react-dom/': 'node_modules/react-dom/'};

const pages = createServer((request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  if (path === '/') {
    response.writeHead(200, {'Content-Type': 'text/html'}).end(PAGE);
    return;
  }
  const prefix = Object.keys(FOLDERS).find((it) => path.startsWith(it));
  const file = prefix ? join(FOLDERS[prefix], path.slice(prefix.length)) : path === '/page.js' ? 'page.js' : join(FOLDERS['/studio/'], path);
  if (!existsSync(file) || !statSync(file).isFile()) {
    response.writeHead(404).end();
    return;
  }
  response.writeHead(200, {'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream'});
  createReadStream(file).pipe(response);
});
await new Promise((resolve) => pages.listen(0, '127.0.0.1', resolve));
const origin = `http://127.0.0.1:${pages.address().port}`;

const preset = spawnSync(join(binDir, 'pheromoned'), ['--default-config'], {encoding: 'utf8'}).stdout
  .replace(/\n\[web\][\s\S]*$/, '\n');
const swarm = new Swarm(binDir, preset, `origins = ["${origin}"]\n`);
let browser;
let status = 0;
try {
  await swarm.start();
  await swarm.drive('radio-a.pty', 1);
  const brush = {pheromone: 'trail', x_m: 2, y_m: 2, radius_m: 0.3, units: 0.2};
  const query = new URLSearchParams({
    server: `ws://127.0.0.1:${swarm.port}/?token=${TOKEN}`,
    pheromones: 'trail,path',
    schema: 'pheromone.Brush',
    brush: JSON.stringify(brush),
  });
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-component-update'],
  });
  const page = await browser.newPage({viewport: {width: 1400, height: 800}});
  let frames = 0;
  page.on('websocket', (socket) => socket.on('framereceived', () => ++frames));
  page.on('pageerror', (error) => console.log(`  page: ${error}`));
  const began = Date.now();
  await page.goto(`${origin}/?${query}`);
  await page.getByRole('button', {name: 'Paint'}).waitFor({timeout: 60000});
  console.log(`  Studio is there after ${((Date.now() - began) / 1000).toFixed(1)} s`);
  await until('Studio gets frames', () => frames > 100);
  // The sidebar names the channels that Studio knows.
  for (const topic of ['/pheromone/trail', '/robots', '/tf']) {
    await page.getByText(topic, {exact: true}).first().waitFor({timeout: 60000});
  }
  console.log('  it lists the channels');
  const sense = (x, y) => swarm.get(`sense?pheromone=trail&x_m=${x}&y_m=${y}`);
  check((await sense(2, 2)).left.intensity === 0, 'something is there before the brush');
  await page.getByRole('button', {name: 'Paint'}).click();
  await until('the brush of the Publish panel paints', async () => (await sense(2, 2)).left.intensity > 0);
  console.log('  its Publish panel paints');
  await page.screenshot({path: join(out, 'studio.png')});
  await swarm.stopDaemon();
  console.log('ok');
} catch (error) {
  console.error(error.stack);
  console.error(swarm.log());
  await browser?.contexts()[0]?.pages()[0]?.screenshot({path: join(out, 'studio-failed.png')}).catch(() => {});
  status = 1;
} finally {
  await browser?.close();
  await swarm.end();
  pages.close();
}
process.exit(status);
