// How long a frame takes: a map of 512 x 512 nodes of which all tiles change five times a second, and
// 200 robots with trails of 200 poses, ten times a second, drawn without a GPU. A worker makes the
// messages, so that the page's thread does only what it does with a real server: it takes them as
// those of a WebSocket. What counts is that thread: how long its tasks are, by Chromium's own trace,
// and what messages and drawing take of each frame. A task that runs for more than 16 ms makes a frame
// late on any machine; one that is longer, but runs for less, waited for a processor. On two cores that
// were busy with four times as much: 99 % ran for less than 8 ms, and one task in three runs for longer
// than 16, 18.6 ms.
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

// Runs in a worker: posts messages as the server sends them, every 100 ms those of robots, every 200 ms
// tiles.
function makeMessages() {
  const SIDE = 512;
  const TILE = 32;
  const TILES = (SIDE / TILE) ** 2;
  const size = 42 + TILES * (4 + TILE * TILE);
  const message = (id, bytes) => {
    const data = new Uint8Array(13 + bytes.length);
    data[0] = 1;
    new DataView(data.buffer).setUint32(1, id, true);
    data.set(bytes, 13);
    return data.buffer;
  };
  const picture = (t) => {
    const bytes = new Uint8Array(4 + size);   // of protobuf: the key and the length
    bytes.set([0x0A, (size & 127) | 128, ((size >> 7) & 127) | 128, size >> 14]);
    const at0 = 4;
    const view = new DataView(bytes.buffer, at0);
    bytes.set([1, 1, TILE, 0], at0);
    view.setUint16(4, SIDE, true);
    view.setUint16(6, SIDE, true);
    view.setUint32(24, 100000, true);
    view.setFloat32(28, 1, true);
    view.setUint16(40, TILES, true);
    let at = 42;
    for (let ty = 0; ty < SIDE / TILE; ty += 1) {
      for (let tx = 0; tx < SIDE / TILE; tx += 1) {
        view.setUint16(at, tx, true);
        view.setUint16(at + 2, ty, true);
        at += 4;
        for (let i = 0; i < TILE * TILE; i += 1, at += 1) {
          const x = tx * TILE + (i % TILE);
          const y = ty * TILE + (i >> 5);
          bytes[at0 + at] = Math.max(0, 127 + 127 * Math.sin(x / 23 + t) * Math.cos(y / 31 - t));
        }
      }
    }
    return bytes;
  };
  const poses = (t) => new TextEncoder().encode(JSON.stringify({field_time_ms: t * 1000, clients: Array.from({length: 200}, (_, id) => {
    const radius = 5 + (id % 20);
    const angle = t * 0.5 / radius + id;
    const x = 25.5 + radius * Math.cos(angle);
    const y = 25.5 + radius * Math.sin(angle);
    const ahead = angle + Math.PI / 2;
    const side = {x: 0.165 * Math.sin(ahead), y: -0.165 * Math.cos(ahead)};
    return {link: 'radio', id, known: true, silent_s: 0.1, requests: 1, repeats: 0, refusals: 0, goal: null, last_event: null, last_command: null,
            pose: {x_m: x, y_m: y, heading_deg: ahead * 180 / Math.PI, source: 'robot'},
            antennas: {left: {x_m: x - side.x, y_m: y - side.y}, right: {x_m: x + side.x, y_m: y + side.y}, pheromones: {trail: {left: 0.5, right: 0.4}}}};
  })}));
  const post = (kind, data) => self.postMessage({kind, data}, [data]);
  for (let i = 0; i < 320; i += 1) post('clients', message(1, poses(i * 0.1)));   // full trails
  post('tiles', message(2, picture(0)));
  post('ready', new ArrayBuffer(0));
  let i = 0;
  setInterval(() => {
    i += 1;
    post('clients', message(1, poses(32 + i * 0.1)));
    if (i % 2 === 0) post('tiles', message(2, picture(i * 0.1)));
  }, 100);
}

// Runs in the page.
async function load([source, forMs]) {
  const {stream, map, store} = window.pheromone;
  const of = (topic) => stream.watches.find((it) => it.match(topic)).handler;
  const topics = ['/clients', '/pheromone_delta/trail'];
  for (const topic of topics) stream.pause(topic);
  topics.forEach((topic, i) => stream.subscriptions.set(i + 1, {topic, handler: of(topic)}));
  stream.nextId = 100;
  const work = {tiles: [], clients: [], drawing: []};
  let ofFrame = 0;
  const timed = (list, go) => {
    const begin = performance.now();
    go();
    const took = performance.now() - begin;
    list.push(took);
    ofFrame += took;
  };
  const worker = new Worker(URL.createObjectURL(new Blob([`(${source})()`], {type: 'text/javascript'})));
  await new Promise((resolve) => {
    worker.onmessage = ({data: {kind, data}}) => {
      if (kind === 'ready') resolve();
      else timed(work[kind], () => stream.takeData(data));
    };
  });
  map.view.fit();
  const frame = map.frame.bind(map);
  map.frame = (now) => timed(work.drawing, () => frame(now));
  await new Promise((resolve) => setTimeout(resolve, 2000));
  for (const list of Object.values(work)) list.length = 0;
  const intervals = [];
  const frames = [];
  let last = 0;
  let running = true;
  performance.mark('measured');
  const beat = (now) => {
    if (last) intervals.push(now - last);
    if (last) frames.push(ofFrame);
    last = now;
    ofFrame = 0;
    if (running) requestAnimationFrame(beat);
  };
  requestAnimationFrame(beat);
  await new Promise((resolve) => setTimeout(resolve, forMs));
  running = false;
  worker.terminate();
  return {...work, frames, intervals, robots: store.robots.size, trail: [...store.trails.values()][5].length,
          received: store.layers.get('trail').received, size: [map.canvases.base.width, map.canvases.base.height]};
}

const sum = (list) => {
  const sorted = [...list].sort((a, b) => a - b);
  const at = (share) => (sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? NaN).toFixed(1);
  return `median ${at(0.5)}, 95 % ${at(0.95)}, 99 % ${at(0.99)}, most ${at(1)} ms (${list.length})`;
};

/** Tasks of the page's thread in milliseconds, the longest ones with what they did. */
function tasksOf(trace) {
  const {traceEvents: events} = JSON.parse(trace);
  const mark = events.find((it) => it.name === 'measured');
  const own = events.filter((it) => it.pid === mark.pid && it.tid === mark.tid && it.ph === 'X' && it.ts >= mark.ts);
  const tasks = own.filter((it) => /RunTask$/.test(it.name)).sort((a, b) => b.dur - a.dur);
  const longest = tasks.slice(0, 5).map((task) => {
    const inside = own.filter((it) => it !== task && it.ts >= task.ts && it.ts + (it.dur ?? 0) <= task.ts + task.dur && it.dur > 1000);
    return `${(task.dur / 1000).toFixed(1)} ms, ${(task.tdur / 1000).toFixed(1)} of them running: ` +
           inside.sort((a, b) => b.dur - a.dur).slice(0, 8).map((it) => `${it.name} ${(it.dur / 1000).toFixed(1)}`).join(', ');
  });
  const running = tasks.reduce((all, it) => all + (it.tdur ?? it.dur), 0);
  const end = Math.max(...own.map((it) => it.ts));
  return {times: tasks.map((it) => it.dur / 1000), ran: tasks.map((it) => (it.tdur ?? it.dur) / 1000), longest, share: running / (end - mark.ts)};
}

const browser = await launch();
try {
  await swarm.start();
  const {page} = await open(browser, swarm.port, {viewport: {width: 1920, height: 1080}, bypassCSP: true});
  await page.goto(`http://127.0.0.1:${swarm.port}/`);
  await page.waitForSelector('#link-state[data-state="live"]');
  await browser.startTracing(page, {categories: ['toplevel', 'devtools.timeline', 'blink.user_timing', 'v8', 'disabled-by-default-v8.gc']});
  const result = await page.evaluate(load, [makeMessages.toString(), Number(seconds) * 1000]);
  const tasks = tasksOf((await browser.stopTracing()).toString());
  console.log(`${result.robots} robots, trails of ${result.trail} points, canvas ${result.size.join(' x ')}, no GPU; ${result.received} pictures`);
  console.log(`tasks of the page     ${sum(tasks.times)}`);
  console.log(`  time they ran       ${sum(tasks.ran)}, ${(100 * tasks.share).toFixed(0)} % of the time`);
  console.log(`  longer than 16 ms   ${tasks.times.filter((it) => it > 16).length}, running for longer: ${tasks.ran.filter((it) => it > 16).length}`);
  for (const it of tasks.longest) console.log(`    ${it}`);
  console.log(`scripts in a frame    ${sum(result.frames)}`);
  console.log(`  drawing             ${sum(result.drawing)}`);
  console.log(`  256 tiles           ${sum(result.tiles)}`);
  console.log(`  200 robots          ${sum(result.clients)}`);
  console.log(`from frame to frame   ${sum(result.intervals)}`);
} finally {
  await browser.close();
  await swarm.end();
}
