// Foxglove Studio's own front end, from npm, in Debian's Chromium against the real daemon and a
// simulated robot, with the layout of deploy/examples: it lists the channels, finds no fault with them,
// shows the map, and what its Publish
// panel sends is painted. Then it opens an MCAP file of the same minutes, made by pheromonectl. The page
// is served from another origin than the daemon's, which web.origins permits. Screenshots are left in OUT.
//
// Usage: node studio_test.mjs BIN_DIR LAYOUT OUT
import {spawnSync} from 'node:child_process';
import {createReadStream, existsSync, mkdirSync, readdirSync, statSync} from 'node:fs';
import {createServer} from 'node:http';
import {extname, join, normalize} from 'node:path';
import {chromium} from 'playwright-core';
import {Swarm, check, defaultConfig, until} from './swarm.mjs';

const [binDir, layout, out] = process.argv.slice(2);
mkdirSync(out, {recursive: true});
const TYPES = {'.js': 'text/javascript', '.html': 'text/html', '.wasm': 'application/wasm', '.json': 'application/json'};
const PAGE = `<!doctype html><meta charset="utf-8"><title>Studio</title>
<style>html, body, #root { height: 100%; margin: 0 }</style><div id="root"></div>
<script src="/react/umd/react.production.min.js"></script>
<script src="/react-dom/umd/react-dom.production.min.js"></script>
<script>self.react = React; self["react-dom"] = ReactDOM;</script>
<script src="/studio/index.js"></script><script type="module" src="/page.js"></script>`;
const FOLDERS = {'/studio/': 'node_modules/@foxglove/studio-base/assets/', '/react/': 'node_modules/react/',
                 '/react-dom/': 'node_modules/react-dom/'};

// Studio reads a file in parts.
function sendPart(file, request, response) {
  const {size} = statSync(file);
  const [, from, to] = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? '') ?? [];
  const begin = Number(from ?? 0);
  const end = to ? Math.min(Number(to), size - 1) : size - 1;
  response.writeHead(from === undefined ? 200 : 206, {
    'Accept-Ranges': 'bytes', 'Content-Length': end + 1 - begin,
    ...(from === undefined ? {} : {'Content-Range': `bytes ${begin}-${end}/${size}`}),
  });
  if (request.method === 'HEAD') response.end();
  else createReadStream(file, {start: begin, end}).pipe(response);
}

const pages = createServer((request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  if (path === '/') {
    response.writeHead(200, {'Content-Type': 'text/html'}).end(PAGE);
    return;
  }
  if (path === '/layout.json') {
    sendPart(layout, request, response);
    return;
  }
  if (path === '/recording.mcap') {
    sendPart(join(swarm.folder, 'recording.mcap'), request, response);
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

const swarm = new Swarm(binDir, `${defaultConfig(binDir)}\n[capture]\nfolder = "captures"\n`, `origins = ["${origin}"]\n`);
const TOPICS = ['/pheromone/trail', '/robots', '/tf'];

/** The sidebar names the channels that Studio knows, and what it could not read. */
async function checkTopics(page, more) {
  for (const topic of [...TOPICS, ...more]) {
    await page.getByText(topic, {exact: true}).first().waitFor({timeout: 60000});
  }
  await page.getByRole('tab', {name: 'Problems'}).click();
  await page.getByText('No problems found').waitFor({timeout: 10000}).catch(async () => {
    throw new Error(`Studio has problems:\n${await page.locator('.MuiList-root').allInnerTexts()}`);
  });
  await page.getByRole('tab', {name: 'Topics'}).click();
}

/** Pixels of the map's panel in the orange of what is full of "path". */
async function fullPixels(page) {
  const picture = (await page.screenshot({clip: {x: 330, y: 60, width: 700, height: 700}})).toString('base64');
  return page.evaluate(async (base64) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (it) => it.charCodeAt(0))]));
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    const {data} = context.getImageData(0, 0, image.width, image.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) count += data[i] > 180 && data[i + 1] > 110 && data[i + 1] < 200 && data[i + 2] < 90 ? 1 : 0;
    return count;
  }, picture);
}

const capture = (action) => swarm.post('capture', {action});

let browser;
let status = 0;
try {
  await swarm.start();
  await swarm.drive('radio-a.pty', 1);
  const brush = {pheromone: 'trail', x_m: 2, y_m: 2, radius_m: 0.3, units: 0.2};
  const query = new URLSearchParams({
    server: `ws://127.0.0.1:${swarm.port}/?ticket=${(await swarm.post('ticket', {})).ticket}`,
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
  page.setDefaultTimeout(120000);
  page.on('pageerror', (error) => console.log(`  page: ${error}`));
  const began = Date.now();
  await page.goto(`${origin}/?${query}`);
  await page.getByRole('button', {name: 'Paint'}).waitFor({timeout: 60000});
  console.log(`  Studio is there after ${((Date.now() - began) / 1000).toFixed(1)} s`);
  await until('Studio gets frames', () => frames > 100);
  await checkTopics(page, ['/pheromone_delta/trail', '/status']);
  console.log('  it lists the channels and reports no problem');
  await until('Studio shows the map', async () => await fullPixels(page) > 500);
  console.log('  it shows the map');
  const sense = (x, y) => swarm.get(`sense?pheromone=trail&x_m=${x}&y_m=${y}`);
  await capture('start');
  check((await sense(2, 2)).left.intensity === 0, 'something is there before the brush');
  await page.getByRole('button', {name: 'Paint'}).click();
  await until('the brush of the Publish panel paints', async () => (await sense(2, 2)).left.intensity > 0);
  const {events} = await swarm.get('events');
  check(events.some((it) => it.topic === 'operator' && it.subject === 'viewer 127.0.0.1' && it.text === 'painted "trail" at (2, 2)'), JSON.stringify(events));
  console.log('  its Publish panel paints');
  await page.screenshot({path: join(out, 'studio.png')});
  await page.goto('about:blank');
  await capture('stop');
  await swarm.stopDaemon();
  const captures = readdirSync(join(swarm.folder, 'captures')).map((it) => join(swarm.folder, 'captures', it));
  const exported = spawnSync(join(binDir, 'pheromonectl'), ['export', '--mcap', join(swarm.folder, 'recording.mcap'), ...captures],
                             {encoding: 'utf8'});
  check(exported.status === 0, exported.stderr);
  console.log(`  exported ${exported.stdout.trim().replace(/.*: /, '')}`);
  query.set('file', `${origin}/recording.mcap`);
  await page.goto(`${origin}/?${query}`);
  await page.getByRole('button', {name: 'Paint'}).waitFor({timeout: 60000});
  await checkTopics(page, ['/clients']);
  await until('Studio shows the recording', async () => await fullPixels(page) > 500);
  console.log('  it shows the recording');
  await page.screenshot({path: join(out, 'studio-recording.png')});
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
