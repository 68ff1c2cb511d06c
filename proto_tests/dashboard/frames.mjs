// How long a frame takes: a map of 512 x 512 nodes of which all tiles change five times a second, and
// 200 robots with trails of 200 poses, ten times a second, drawn without a GPU. The messages are made
// here and go through the page's own decoders. On two idle cores, with a window of 1920 x 1080: median
// 1.0 ms, 95 % below 5 ms, most 23 ms; 16.7 ms from frame to frame, always.
//
// Usage: node frames.mjs BIN_DIR [SECONDS]
import {launch, open} from './browser.mjs';
import {Swarm} from './swarm.mjs';

const [binDir, seconds = '20'] = process.argv.slice(2);
const swarm = new Swarm(binDir, `
[map]
width_m = 51.1
height_m = 51.1
cell_m = 0.1
wide = true
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 30.0
quantum = 0.125
maximum = 1.0
`);

// Runs in the page.
async function load(forMs) {
  const {stream, map, store} = window.pheromone;
  const of = (topic) => stream.watches.find((it) => it.match(topic)).handler;
  const robots = of('/clients');
  const tiles = of('/pheromone_delta/trail');
  stream.pause('/clients');
  stream.pause('/pheromone_delta/trail');
  const begin = performance.now();
  const SIDE = 512;
  const TILE = 32;
  const message = new Uint8Array(42 + (SIDE / TILE) ** 2 * (4 + TILE * TILE));
  const view = new DataView(message.buffer);
  message.set([1, 1, TILE, 0]);
  view.setUint16(4, SIDE, true);
  view.setUint16(6, SIDE, true);
  view.setUint32(24, 100000, true);
  view.setFloat32(28, 1, true);
  view.setUint16(40, (SIDE / TILE) ** 2, true);
  const picture = (t) => {
    let at = 42;
    for (let ty = 0; ty < SIDE / TILE; ty += 1) {
      for (let tx = 0; tx < SIDE / TILE; tx += 1) {
        view.setUint16(at, tx, true);
        view.setUint16(at + 2, ty, true);
        at += 4;
        for (let i = 0; i < TILE * TILE; i += 1, at += 1) {
          const x = tx * TILE + (i % TILE);
          const y = ty * TILE + (i >> 5);
          message[at] = Math.max(0, 127 + 127 * Math.sin(x / 23 + t) * Math.cos(y / 31 - t));
        }
      }
    }
    tiles(message, '/pheromone_delta/trail');
  };
  const poses = (t) => robots(new TextEncoder().encode(JSON.stringify({field_time_ms: t * 1000, clients: Array.from({length: 200}, (_, id) => {
    const radius = 5 + (id % 20);
    const angle = t * 0.5 / radius + id;
    const x = 25.5 + radius * Math.cos(angle);
    const y = 25.5 + radius * Math.sin(angle);
    const ahead = angle + Math.PI / 2;
    const side = {x: 0.165 * Math.sin(ahead), y: -0.165 * Math.cos(ahead)};
    return {link: 'radio', id, known: true, silent_s: 0.1, requests: 1, repeats: 0, refusals: 0, goal: null, last_event: null, last_command: null,
            pose: {x_m: x, y_m: y, heading_deg: ahead * 180 / Math.PI, source: 'robot'},
            antennas: {left: {x_m: x - side.x, y_m: y - side.y}, right: {x_m: x + side.x, y_m: y + side.y}, pheromones: {trail: {left: 0.5, right: 0.4}}}};
  })})), '/clients');
  for (let i = 0; i < 320; i += 1) poses(i * 0.1);   // full trails
  picture(0);
  map.view.fit();
  await new Promise((resolve) => setTimeout(resolve, 1000));
  map.frames.length = 0;
  // Canvases note what is to be drawn, and draw it later; reading a pixel makes them draw it now.
  const whole = [];
  const raster = {};
  const frame = map.frame.bind(map);
  map.frame = (now) => {
    const a = performance.now();
    const drawn = [...map.dirty];
    frame(now);
    for (const name of drawn) {
      const b = performance.now();
      map.contexts[name].getImageData(0, 0, 1, 1);
      (raster[name] ??= []).push(performance.now() - b);
    }
    whole.push(performance.now() - a);
  };
  const intervals = [];
  let last = performance.now();
  let running = true;
  const beat = (now) => { intervals.push(now - last); last = now; if (running) requestAnimationFrame(beat); };
  requestAnimationFrame(beat);
  const work = {tiles: [], clients: []};
  for (let i = 0; performance.now() - begin < forMs + 1000; i += 1) {
    const t = 32 + i * 0.1;
    const a = performance.now();
    poses(t);
    work.clients.push(performance.now() - a);
    if (i % 2 === 0) {
      picture(t);   // its own cost is told apart below
      const b = performance.now();
      tiles(message, '/pheromone_delta/trail');
      work.tiles.push(performance.now() - b);
    }
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, 100 - (performance.now() - a))));
  }
  running = false;
  return {frames: [...map.frames], whole, raster, intervals: intervals.slice(5), ...work, robots: store.robots.size, trail: [...store.trails.values()][5].length,
          size: [map.canvases.base.width, map.canvases.base.height]};
}

const sum = (list) => {
  const sorted = [...list].sort((a, b) => a - b);
  const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))].toFixed(1);
  return `median ${at(0.5)}, 95 % ${at(0.95)}, most ${at(1)} ms (${list.length})`;
};

const browser = await launch();
try {
  await swarm.start();
  const {page} = await open(browser, swarm.port, {viewport: {width: 1920, height: 1080}});
  await page.goto(`http://127.0.0.1:${swarm.port}/`);
  await page.waitForSelector('#link-state[data-state="live"]');
  const result = await page.evaluate(load, Number(seconds) * 1000);
  console.log(`${result.robots} robots, trails of ${result.trail} points, canvas ${result.size.join(' x ')}, no GPU`);
  console.log(`drawing a frame       ${sum(result.whole)}`);
  console.log(`  of which calls      ${sum(result.frames)}`);
  for (const [name, list] of Object.entries(result.raster)) console.log(`  pixels of ${name.padEnd(10)}${sum(list)}`);
  console.log(`decoding 256 tiles    ${sum(result.tiles)}`);
  console.log(`decoding 200 robots   ${sum(result.clients)}`);
  console.log(`from frame to frame   ${sum(result.intervals)}`);
} finally {
  await browser.close();
  await swarm.end();
}
