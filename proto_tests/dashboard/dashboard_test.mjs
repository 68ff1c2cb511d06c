// The dashboard in a browser against the real daemon and simulated robots: every tool is used, a
// robot is commanded and follows a path that was painted, the connection is cut and comes back; no
// error on the console, no request to another host. Screenshots are left in OUT.
//
// Usage: node dashboard_test.mjs BIN_DIR SOURCE_DIR OUT
import {mkdirSync, readFileSync} from 'node:fs';
import {open as openFile} from 'node:fs/promises';
import {join} from 'node:path';
import {drawn, live, open, pixel} from './browser.mjs';
import {begin, run} from './steps.mjs';
import {DOOR, Swarm, TOKEN, UNPLUGGED, check, defaultConfig, until} from './swarm.mjs';

const [binDir, source, out] = process.argv.slice(2);
mkdirSync(out, {recursive: true});
const swarm = new Swarm(binDir, `${defaultConfig(binDir)}
[[link]]
name = "radio-b"
kind = "pty"
path = "radio-b.pty"
${UNPLUGGED}${DOOR}[obstacles]
rectangles_m = [[4.6, 4.6, 5.4, 5.4]]
[journal]
folder = "journal"
`);

const distance = (a, b) => Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m);

/** The pose of a robot after it moved by this much, or stood for ten of its requests. */
async function moved(id, metres) {
  const from = (await until('a pose', () => swarm.robot(id).then((it) => it?.pose)));
  await until(`robot ${id} moves`, async () => distance((await swarm.robot(id)).pose, from) > metres);
}
async function stands(id) {
  await until(`robot ${id} stands`, async () => {
    const before = await swarm.robot(id);
    const after = await until('ten requests', async () => {
      const now = await swarm.robot(id);
      return now.requests >= before.requests + 10 && now;
    });
    return distance(after.pose, before.pose) < 0.005;
  });
}

async function clickMap(page, x, y) {
  await page.mouse.click(...await pixel(page, x, y));
}

async function drag(page, points) {
  const pixels = [];
  for (const [x, y] of points) pixels.push(await pixel(page, x, y));
  await page.mouse.move(...pixels[0]);
  await page.mouse.down();
  for (const at of pixels.slice(1)) await page.mouse.move(...at, {steps: 8});
  await page.mouse.up();
}

const sensed = async (x, y, type) => {
  const answer = await swarm.get(`sense?x_m=${x}&y_m=${y}&heading_deg=0&pheromone=${type}`);
  return answer.left.intensity + answer.right.intensity;
};
const levelAt = (page, name, x, y) => page.evaluate(([layer, mapX, mapY]) =>
  window.pheromone.store.layers.get(layer).valueAt(mapX, mapY), [name, x, y]);

async function withoutToken(browser) {
  begin('without the token nothing can be changed');
  const {page, context, checkClean} = await open(browser, swarm.port);
  await page.goto(`http://127.0.0.1:${swarm.port}/`);
  await live(page);
  for (const it of ['[data-tool="path"]', '[data-tool="brush"]', '[data-tool="eraser"]', '#undo', '#redo', '#halt-all', '#record', '#snapshot']) {
    await page.waitForSelector(`${it}:disabled`);
  }
  check(/token/.test(await page.getAttribute('[data-tool="path"]', 'title')), 'the reason is not told');
  await page.click('#lock');
  await page.fill('#token-dialog input', TOKEN);
  await page.click('#token-dialog button[type="submit"]');
  await page.waitForSelector('#halt-all:not(:disabled)');
  await page.click('#lock');
  await page.waitForSelector('#halt-all:disabled');
  checkClean();
  await context.close();
}

async function wrongToken(browser) {
  begin('a wrong token is refused when unlocking');
  const {page, context} = await open(browser, swarm.port);   // its console tells the 401
  await page.goto(`http://127.0.0.1:${swarm.port}/`);
  await live(page);
  await page.click('#lock');
  await page.fill('#token-dialog input', 'not the token');
  await page.click('#token-dialog button[type="submit"]');
  await page.waitForFunction(() => document.querySelector('#token-dialog .problem').textContent === 'This is not the server’s token.');
  check(await page.isVisible('#token-dialog') && await page.isDisabled('#halt-all'), 'a wrong token unlocks');
  await page.waitForFunction(() => [...document.querySelectorAll('#events li .warn')].some((it) => it.textContent === 'web 127.0.0.1: unlock: refused, found an invalid token'));
  await context.close();
}

async function commands(page) {
  begin('a robot is selected on the map, halted, resumed');
  await moved(1, 0.1);
  await until('the card opens', async () => {
    const {pose} = await swarm.robot(1);
    await clickMap(page, pose.x_m, pose.y_m);
    return page.isVisible('#robot-card');
  });
  await page.waitForSelector('.row.selected');
  const selected = await page.evaluate(() => window.pheromone.store.selected.key);   // the other may be there, too
  const id = Number(selected.split('/')[1]);
  await page.click('#halt');
  await until('the halt is accepted', async () => (await swarm.robot(id)).last_command?.outcome === 'accepted');
  await stands(id);
  await page.click('#resume');
  await moved(id, 0.1);

  begin('"go here" sets a goal, and it can be cancelled');
  await page.click('#go-here');
  await clickMap(page, 3, 5);
  const goal = await until('the goal', async () => (await swarm.robot(id)).goal);
  check(Math.hypot(goal.x_m - 3, goal.y_m - 5) < 0.05, `the goal is ${JSON.stringify(goal)}`);
  await page.click('#cancel-goal');
  await until('no goal', async () => (await swarm.robot(id)).goal === null);
  await page.click('#follow-view');
  await page.keyboard.press('f');
  await page.keyboard.press('0');
  return id;
}

/** Of what does not evaporate, since otherwise they would be of different times. */
async function agreesWithTheEngine(page) {
  begin('the picture has the values of the engine');
  const field = await swarm.get('field?pheromone=path&format=json');
  const picture = await page.evaluate(() => {
    const {columns, rows, levels, scale} = window.pheromone.store.layers.get('path');
    return {columns, rows, scale, levels: [...levels]};
  });
  check(field.columns === picture.columns && field.rows === picture.rows, 'the sizes differ');
  let painted = 0;
  field.values.forEach((values, down) => values.forEach((value, column) => {
    const level = picture.levels[(field.rows - 1 - down) * field.columns + column];
    const place = `column ${column}, row ${field.rows - 1 - down}: ${level} for ${value}`;
    check((value === null) === (level === 255), `blocked or not: ${place}`);
    if (value === null) return;
    check((value > 0) === (level > 0), `empty or not: ${place}`);
    check(Math.abs(level / 254 * picture.scale - value) <= picture.scale / 254, place);
    painted += value > 0 ? 1 : 0;
  }));
  check(painted > 150, `only ${painted} cells are painted`);
}

async function brushAndEraser(page) {
  begin('brush and eraser change the map, and the picture shows it');
  await page.click('[data-tool="brush"]');
  await page.selectOption('#options select', 'trail');
  await drag(page, [[3, 6], [4, 6]]);
  await until('the daemon has it', async () => await sensed(3.5, 6, 1) > 0);
  await until('the picture has it', async () => await levelAt(page, 'trail', 3.5, 6) > 0.9);
  await page.click('[data-tool="eraser"]');
  await page.keyboard.press(']');
  await page.keyboard.press(']');
  await drag(page, [[2.6, 6], [4.4, 6]]);
  await page.keyboard.press('[');
  await page.keyboard.press('[');
  await page.keyboard.press('Escape');
  for (const x of [3, 3.5, 4]) await until('the picture lost it', async () => await levelAt(page, 'trail', x, 6) === 0);

  begin('strokes are undone and redone as a whole');
  const everywhere = async (what, fits) => {
    for (const x of [3, 3.5, 4]) await until(`${what} at ${x}`, async () => fits(await levelAt(page, 'trail', x, 6)));
  };
  await page.keyboard.press('Control+z');
  await page.waitForSelector('.toasts >> text=/^Undid: erasure of "trail" along a line, made at [0-9:]{8}: [1-9][0-9]* nodes? changed$/');
  await everywhere('the erasure is undone', (level) => level > 0);
  await page.keyboard.press('Control+z');
  await page.waitForSelector('.toasts >> text=/^Undid: stroke of "trail"/');
  await everywhere('the stroke is undone', (level) => level === 0);
  await page.keyboard.press('Control+Shift+z');
  await everywhere('the stroke is redone', (level) => level > 0);
  await page.click('#undo');
  await everywhere('the stroke is undone by the button', (level) => level === 0);
  check(await page.isEnabled('#redo'), 'the button to redo is disabled');
}

async function select(page, key) {
  await page.evaluate((it) => {
    if (window.pheromone.store.selected?.key !== it) document.querySelector(`.row[data-robot="${it}"]`).click();
  }, key);
}

async function followsAPaintedPath(page, id) {
  begin('a path is painted, and the robot follows it');
  await select(page, `${id === 1 ? 'radio-a' : 'radio-b'}/${id}`);
  await page.click('#halt');
  await stands(id);
  const {pose} = await swarm.robot(id);
  // Straight ahead, and then in a bend towards the middle of the map.
  const points = [[pose.x_m, pose.y_m]];
  let heading = (pose.heading_deg * Math.PI) / 180;
  for (let i = 0; i < 12; i += 1) {
    const [x, y] = points.at(-1);
    const wanted = Math.atan2(5 - y, 5 - x);
    const turn = Math.atan2(Math.sin(wanted - heading), Math.cos(wanted - heading));
    if (i > 1) heading += Math.max(-0.28, Math.min(0.28, turn));
    if (Math.hypot(x - 5, y - 5) < 1.8) break;   // there is an obstacle in the middle
    points.push([x + 0.3 * Math.cos(heading), y + 0.3 * Math.sin(heading)]);
  }
  await page.click('[data-tool="path"]');
  await page.selectOption('#options select', 'trail');
  await page.keyboard.press('[');
  await page.keyboard.press('[');
  await page.keyboard.press('[');
  for (const [x, y] of points) await clickMap(page, x, y);
  await page.screenshot({path: join(out, 'path-tool.png')});
  await page.keyboard.press('Enter');
  const end = points.at(-1);
  const before = points.at(-3);
  await until('the picture has it', async () => await levelAt(page, 'trail', before[0], before[1]) > 0.5);
  await page.keyboard.press('v');
  await page.selectOption('#follow-type', '1');
  await page.click('#follow');
  await page.click('#resume');   // waits in the page until the robot has acknowledged the other
  const off = (at) => Math.min(...points.map(([x, y]) => Math.hypot(x - at.x_m, y - at.y_m)));
  let worst = 0;
  let last = null;
  await until('the robot comes to its end', async () => {
    last = await swarm.robot(id);
    worst = Math.max(worst, off(last.pose));
    return Math.hypot(last.pose.x_m - end[0], last.pose.y_m - end[1]) < 0.45;
  }, 120000).catch((error) => {
    console.log(`    path ${JSON.stringify(points)}\n    robot ${JSON.stringify(last)}`);
    throw error;
  });
  console.log(`    ${points.length} points; the robot stayed within ${worst.toFixed(2)} m of them`);
  check(worst < 0.4, 'the robot left the path');
}

async function panels(page) {
  begin('layers, colours, themes, keys, tag, recording, snapshot, time line');
  const box = page.locator('.layer[data-layer="path"] input');
  await box.uncheck();
  await page.keyboard.press('2');
  check(await box.isChecked(), 'the key 2 does not show the second layer');
  await page.waitForFunction(() => window.pheromone.store.layers.get('path').visible);
  for (let i = 0; i < 3; i += 1) await page.click('.layer[data-layer="path"] .ramp');
  await page.click('.layer[data-layer="path"] .name');
  check(await page.inputValue('#senses') === 'path', 'the name does not choose what antennas show');
  await page.click('.layer[data-layer="path"] .name');
  check(await page.inputValue('#senses') === '', 'the name does not take that back');
  for (const key of ['r', 'r', 't', 't', 'a', 'a', 'g', 'g', '+', '-', 'ArrowLeft', 'ArrowUp', '0', 'n', 'N', 'Escape']) await page.keyboard.press(key);
  await page.keyboard.press('d');
  check(await page.getAttribute('html', 'data-theme') === 'light', 'the theme did not change');
  await page.keyboard.press('d');
  await page.keyboard.press('?');
  await page.waitForSelector('#help-dialog[open]');
  await page.keyboard.press('Escape');
  await clickMap(page, 1, 8.5);
  await page.waitForSelector('#tag-card:not([hidden])');
  await page.mouse.move(...await pixel(page, 5, 5));
  await page.mouse.wheel(0, -400);
  await page.click('#zoom [aria-label^="Fit"]');

  await page.click('#record');
  await until('the recording begins', async () => (await swarm.get('capture')).recording);
  await page.waitForSelector('#record.on');
  await page.click('#record');
  await until('the recording ends', async () => !(await swarm.get('capture')).recording);
  await page.locator('#snapshot').scrollIntoViewIfNeeded();
  await page.click('#snapshot');
  await page.waitForSelector('.toasts >> text=/^Snapshot/');

  await page.click('#play');
  await page.waitForFunction(() => window.pheromone.store.past !== null);
  await page.fill('#scrub', '300');
  const past = await page.evaluate(() => window.pheromone.store.past.at);
  await page.waitForSelector('#past-banner >> text=/not live, and its tools are off/');
  check(await page.getAttribute('html', 'data-past') !== null, 'the past looks like the present');
  for (const it of ['path', 'brush', 'eraser']) {
    await page.waitForSelector(`[data-tool="${it}"]:disabled`);
    await page.keyboard.press(it[0]);
    check(await page.getAttribute('button[data-tool="look"]', 'aria-pressed') === 'true', `${it} is in hand while the past is shown`);
  }
  await page.screenshot({path: join(out, 'past.png')});
  await page.click('#play');
  await page.waitForFunction((at) => window.pheromone.store.past?.at > at, past);
  await page.click('#live');
  await page.waitForFunction(() => window.pheromone.store.past === null);
  await page.waitForSelector('#past-banner', {state: 'hidden'});
  await page.waitForSelector('[data-tool="brush"]:not(:disabled)');
}

/** Robot `id` was told to follow *trail*; the other one follows *path*. */
async function antennas(page, id) {
  begin('antennas show what each robot follows, or what is chosen for all; tools have a pheromone of their own');
  const keys = [id, 3 - id].map((it) => `${it === 1 ? 'radio-a' : 'radio-b'}/${it}`);
  const shown = () => page.evaluate(async (robots) => {
    const {pheromoneOf} = await import('/dashboard/robots.js');
    return robots.map((it) => pheromoneOf(window.pheromone.store.robots.get(it))).join();
  }, keys);
  await until('each shows its own', async () => await shown() === 'trail,path');
  check((await swarm.robot(id)).follows === 'trail' && (await swarm.robot(3 - id)).follows === 'path', 'the API says otherwise');
  await page.waitForSelector('.legend .antennas >> text=/path 0–3.5, trail 0–3.5/');
  await page.keyboard.press('b');
  await page.selectOption('#options select', 'trail');
  check(await shown() === 'trail,path', 'the pheromone of a tool changes the antennas');
  await page.keyboard.press('Escape');
  await page.selectOption('#senses', 'path');
  check(await shown() === 'path,path', 'what is chosen for all is not shown');
  await page.selectOption('#senses', '');
  check(await shown() === 'trail,path', 'they do not show their own again');
  await select(page, keys[1]);
  // On the map and on the card, of one message.
  await page.waitForFunction(() => {
    const [, left, right] = [...document.querySelectorAll('.senses tr')].map((it) => it.textContent).find((it) => it.startsWith('path (follows)'))?.match(/^path \(follows\)([\d.]+?)([\d.]+)$/) ?? [];
    return left !== undefined && right !== undefined;
  });
  await page.waitForSelector('.senses th >> text=P_L (left)');
}

/** With the mouse, in the list, from the keyboard: commands and goals are of all that are selected. */
async function several(browser) {
  begin('several robots: a rectangle, Ctrl and Shift, Ctrl+A; they are commanded together');
  const {page, context, checkClean} = await open(browser, swarm.port);
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await live(page);
  await page.waitForFunction(() => window.pheromone.store.map && [...window.pheromone.store.robots.values()].filter((it) => it.pose).length === 2);
  const selected = () => page.evaluate(() => [...window.pheromone.store.group].sort().join());
  const both = 'radio-a/1,radio-b/2';
  const view = await page.evaluate(() => { const {x, y, scale} = window.pheromone.map.view; return [x, y, scale].join(); });
  await page.keyboard.down('Shift');
  await drag(page, [[0.2, 0.2], [9.8, 9.8]]);
  await page.keyboard.up('Shift');
  check(await selected() === both, `a rectangle around both selects ${await selected()}`);
  check(await page.evaluate(() => { const {x, y, scale} = window.pheromone.map.view; return [x, y, scale].join(); }) === view, 'the rectangle moved the map');
  check(await page.textContent('#robot-card h3') === '2 robots', 'the card is not of both');
  await page.waitForFunction(() => /selected=robot\+radio-a\/1,radio-b\/2|selected=robot\+radio-b\/2,radio-a\/1/.test(location.hash));
  await page.reload();
  await until('a reload keeps both', async () => await selected() === both);
  await until('both rows are marked', async () => (await page.$$('.row.selected')).length === 2);
  await page.screenshot({path: join(out, 'several.png')});
  await page.click('#halt');
  await page.waitForSelector('.toasts >> text=2 robots: halt sent');
  await stands(1);
  await stands(2);
  await page.click('.row[data-robot="radio-a/1"]', {modifiers: ['Control']});
  check(await selected() === 'radio-b/2', `Ctrl+click leaves ${await selected()}`);
  await page.click('.row[data-robot="radio-b/2"]');
  check(await selected() === '', 'a click on the selected one keeps it');
  await page.click('.row[data-robot="radio-a/1"]');
  await page.click('.row[data-robot="radio-b/2"]', {modifiers: ['Shift']});
  check(await selected() === both, `Shift+click selects ${await selected()}`);
  await page.keyboard.press('Escape');
  await page.locator('#stage').focus();
  await page.keyboard.press('Control+a');
  check(await selected() === both, `Ctrl+A selects ${await selected()}`);

  // They keep their places to each other.
  const before = await Promise.all([1, 2].map((it) => swarm.robot(it)));
  await page.fill('#goal-x', '7');
  await page.fill('#goal-y', '6');
  await page.click('#go-to');
  await page.waitForSelector('.toasts >> text=2 robots go to 7.00 m, 6.00 m');
  const goals = (await Promise.all([1, 2].map((it) => until('a goal', async () => (await swarm.robot(it)).goal))));
  const poses = before.map((it) => it.pose);
  for (const axis of ['x_m', 'y_m']) {
    check(Math.abs((goals[0][axis] + goals[1][axis]) / 2 - (axis === 'x_m' ? 7 : 6)) < 0.01, `the middle of the goals: ${JSON.stringify(goals)}`);
    check(Math.abs(goals[0][axis] - goals[1][axis] - poses[0][axis] + poses[1][axis]) < 0.02, `goals ${JSON.stringify(goals)} of ${JSON.stringify(poses)}`);
  }
  await page.click('#cancel-goal');
  await page.waitForSelector('.toasts >> text=2 robots: goal cancelled');
  checkClean();   // what follows is on the console
  // One of the two is refused: it is named, and why.
  await page.route('**/api/v1/goto', (route) => (route.request().postDataJSON().id === 2
    ? route.fulfill({status: 409, contentType: 'application/json', body: '{"error": {"what": "radio-b is down"}}'}) : route.continue()));
  await page.click('#go-to');
  await page.waitForSelector('.toasts >> text=1 of 2 robots go to 7.00 m, 6.00 m');
  await page.waitForSelector('.toasts [role="alert"] >> text=Robot 2: radio-b is down');
  await page.unroute('**/api/v1/goto');
  await page.click('#cancel-goal');
  await page.locator('#stage').focus();
  await page.keyboard.press('u');
  await page.waitForSelector('.toasts >> text=2 robots: resume sent');
  await moved(1, 0.05);
  await moved(2, 0.05);
  await context.close();
}

/** Read by the library of the format itself, with what the API says. */
async function mcap(page, id) {
  begin('what is shown is saved as MCAP, from one press to the next');
  await page.click('.layer[data-layer="trail"] input');
  await page.uncheck('.switches [name="trails"]');
  await page.click('[data-export="mcap"]');
  await page.waitForFunction(() => /^Save (\d+ kB|\d+\.\d MB|[1-9]\d\.\d kB)$/.test(document.querySelector('[data-export="mcap"]').textContent));
  const {pose} = await swarm.robot(id);
  await page.uncheck('.switches [name="goals"]');   // shown at the beginning only
  await page.check('.switches [name="trails"]');    // and only from here on
  await until('the robot moves on', async () => distance((await swarm.robot(id)).pose, pose) > 0.1);
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('[data-export="mcap"]')]);
  const path = join(out, 'saved.mcap');
  await download.saveAs(path);
  await page.click('.layer[data-layer="trail"] input');
  await page.check('.switches [name="goals"]');
  const {McapIndexedReader} = await import('@mcap/core');
  const file = await openFile(path);
  try {
    const reader = await McapIndexedReader.Initialize({readable: {
      size: async () => BigInt((await file.stat()).size),
      read: async (offset, size) => {
        const buffer = new Uint8Array(Number(size));
        await file.read(buffer, 0, Number(size), Number(offset));
        return buffer;
      }}});
    const count = {};
    const path1 = [];
    for await (const message of reader.readMessages({validateCrcs: true})) {
      const {topic, schemaId} = reader.channelsById.get(message.channelId);
      const schema = reader.schemasById.get(schemaId);
      check(schema.data.length > 10, `${topic} has no schema`);
      count[topic] = [(count[topic]?.[0] ?? 0) + 1, schema.name];
      if (topic !== '/clients') continue;
      const at = JSON.parse(Buffer.from(message.data)).clients.find((it) => it.id === id).pose;
      path1.push(distance(at, pose));
      check(Math.abs(Number(message.logTime / 1000000n) - Date.now()) < 600000, `its time is ${message.logTime}`);
    }
    const topics = Object.keys(count).sort().join();
    check(topics.includes('/clients,') && topics.includes('/paths') && topics.includes('/pheromone/path') && topics.includes('/robots') && topics.includes('/obstacles'), `topics: ${topics}`);
    check(topics.includes('/trails') && !topics.includes('/pheromone/trail') && !topics.includes('delta'), `what is not shown is saved: ${topics}`);
    check(count['/robots'][1] === 'foxglove.SceneUpdate' && count['/pheromone/path'][1] === 'foxglove.Grid', `schemas: ${JSON.stringify(count)}`);
    check(Number(reader.statistics.messageCount) === Object.values(count).reduce((sum, [it]) => sum + it, 0), 'the index counts others');
    check(Math.min(...path1) < 0.05 && Math.max(...path1) > 0.09, `the robot's way: ${path1}`);
  } finally {
    await file.close();
  }
}

async function measure(page) {
  begin('distances are measured, also of the past');
  await page.locator('#stage').focus();
  await page.keyboard.press('m');
  await clickMap(page, 2, 2);
  await clickMap(page, 5, 2);
  await page.mouse.move(...await pixel(page, 5, 6));
  await page.waitForFunction(() => /^(4\.0|3\.9)\d m at 90°, (7\.0|6\.9)\d m in all$/.test(document.getElementById('measured').textContent));
  await page.keyboard.press('Backspace');
  await page.mouse.move(...await pixel(page, 2, 3));
  await page.waitForFunction(() => /^(1\.0|0\.9)\d m at (89|90|91)°$/.test(document.getElementById('measured').textContent));
  await page.keyboard.press('Escape');
}

async function addressOf(browser, page) {
  begin('the address has what is shown; a reload and another browser get it back');
  await page.click('.layer[data-layer="trail"] input');
  await page.uncheck('.switches [name="grid"]');
  await select(page, 'radio-a/1');
  await page.evaluate(() => window.pheromone.map.view.set(4, 6, 120));
  const is = (it) => it.waitForFunction(() => {
    const {store, map} = window.pheromone;
    return store.layers.get('trail')?.visible === false && store.layers.get('path')?.visible && !store.shows.grid && store.shows.robots &&
      store.selected?.key === 'radio-a/1' && map.view.x === 4 && map.view.y === 6 && map.view.scale === 120;
  });
  await page.waitForFunction(() => /at=4.00,6.00,120/.test(location.hash));
  const url = page.url();
  check(!url.includes(TOKEN), 'the token is in the address');
  const length = () => page.evaluate(() => window.pheromone.store.trails.get('radio-a/1')?.length ?? 0);
  const trail = await length();
  check(trail > 12, `a trail of ${trail} points`);
  await page.reload();
  await live(page);
  await is(page);
  await until('the trail is kept', async () => await length() >= trail);
  const other = await open(browser, swarm.port);
  await other.page.goto(url);
  await is(other.page);
  other.checkClean();
  await other.context.close();
  await page.check('.layer[data-layer="trail"] input');
  await page.check('.switches [name="grid"]');
  await page.locator('#stage').focus();
  await page.keyboard.press('0');
  await page.keyboard.press('Escape');
  await page.waitForFunction(() => location.hash === '');
}

/** The colour of the map at a place, as it is on screen. */
async function colourAt(page, x, y) {
  return (await pixelsAround(page, x, y, 1))[0];
}

async function exports(page, id) {
  begin('what is shown is saved: a picture, a figure with axes, tables');
  const saved = async (name) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(`[data-export="${name}"]`)]);
    const path = join(out, `saved-${name}.${download.suggestedFilename().split('.').at(-1)}`);
    await download.saveAs(path);
    return readFileSync(path);
  };
  const png = await saved('png');
  const {width, height} = await page.evaluate(() => window.pheromone.map.view);
  check(png.readUInt32BE(16) === Math.round(width) && png.readUInt32BE(20) > height, `a PNG of ${png.readUInt32BE(16)} x ${png.readUInt32BE(20)}`);
  const svg = (await saved('svg')).toString();
  const figure = await page.evaluate((text) => {
    const it = new DOMParser().parseFromString(text, 'image/svg+xml');
    return {error: it.querySelector('parsererror')?.textContent, texts: [...it.querySelectorAll('text')].map((t) => t.textContent), images: it.querySelectorAll('image').length};
  }, svg);
  check(!figure.error, `the SVG is broken: ${figure.error}`);
  for (const text of ['x in m', 'y in m', '0', '10', 'path, units', 'trail, units', 'door', '1', '2']) check(figure.texts.includes(text), `the figure does not say ${text}: ${figure.texts}`);
  check(figure.images === 3, `${figure.images} pictures: of the map, and of two scales`);
  const table = (await saved('robots-csv')).toString().trim().split('\n').map((it) => it.split(','));
  check(table.length === 3 && table[0].join() === 'utc,link,id,x_m,y_m,heading_deg,state,follows,trail_left,trail_right,path_left,path_right', `the robots: ${table}`);
  const {pose} = await swarm.robot(id);
  const row = table.find((it) => it[2] === String(id));
  check(row[7] === 'trail' && Math.hypot(row[3] - pose.x_m, row[4] - pose.y_m) < 3, `robot ${id}: ${row}`);
  const levels = (await saved('levels-csv')).toString().trim().split('\n');
  check(levels[0] === 'pheromone,x_m,y_m,units' && levels.length > 150, `${levels.length} levels`);
  const field = await swarm.get('field?pheromone=path&format=json');
  const [, x, y, units] = levels.find((it) => it.startsWith('path,')).split(',').map(Number);
  const value = field.values[field.rows - 1 - Math.round(y / 0.1)][Math.round(x / 0.1)];
  check(Math.abs(value - units) < 0.01, `at ${x}, ${y} there is ${value}, the table has ${units}`);
}

async function haltAll(page) {
  begin('all robots are halted');
  await page.click('#halt-all');
  await page.waitForSelector('.toasts >> text=/Halt sent on 2 of 3 links; modem is down: its robots were not told/');
  await stands(1);
  await stands(2);
  await page.waitForSelector('#halted >> text=2 of 2 halted');
  await page.waitForFunction(() => document.querySelectorAll('.row .dot.held').length === 2);
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('2 halted'));
  await page.screenshot({path: join(out, 'halted.png')});
  await page.click('#resume-all');
  await moved(1, 0.05);
  await moved(2, 0.05);
  await page.waitForSelector('#halted', {state: 'hidden'});
  await page.waitForFunction(() => document.querySelectorAll('.row .dot.held').length === 0);
}

async function cut(page, watch) {
  begin('the daemon stands still, and goes on');
  watch.cut = true;
  swarm.daemon.kill('SIGSTOP');
  await page.waitForSelector('#veil:not([hidden])', {timeout: 60000});
  await page.screenshot({path: join(out, 'connection-lost.png')});
  await page.waitForSelector('#link-state[data-state="lost"]', {timeout: 60000});
  swarm.daemon.kill('SIGCONT');
  await live(page);
  await page.waitForSelector('#veil', {state: 'hidden'});
  begin('the daemon ends, and another one begins');
  await swarm.stopDaemon();
  await page.waitForSelector('#link-state[data-state="lost"]', {timeout: 60000});
  await swarm.start();
  await live(page);
  await page.waitForSelector('#veil', {state: 'hidden'});
  await page.waitForFunction(() => [...window.pheromone.store.robots.values()].some((it) => it.pose && it.silent_s < 1), null, {timeout: 60000});
  watch.cut = false;
}

/** Fingers: each step is where all of them are, [] ends the gesture. */
async function touch(session, ...steps) {
  let before = 0;
  for (const fingers of steps) {
    const type = fingers.length === 0 ? 'touchEnd' : fingers.length > before ? 'touchStart' : 'touchMove';
    before = fingers.length;
    await session.send('Input.dispatchTouchEvent', {type, touchPoints: fingers.map(([x, y], id) => ({x, y, id}))});
  }
}

async function fingers(browser) {
  begin('fingers move and zoom the map, select and paint');
  const {page, context, checkClean} = await open(browser, swarm.port, {viewport: {width: 390, height: 844}, hasTouch: true});
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await page.waitForFunction(() => window.pheromone.store.tags.length > 0 && window.pheromone.store.layers.get('trail')?.levels);
  const session = await context.newCDPSession(page);
  const scale = () => page.evaluate(() => window.pheromone.map.view.scale);
  const near = async (x, y, [px, py], what) => {
    const [nowX, nowY] = await pixel(page, x, y);
    check(Math.hypot(nowX - px, nowY - py) < 6, `${what}: ${[x, y]} is at ${[nowX, nowY]} instead of ${[px, py]}`);
  };
  await until('the card opens', async () => {   // a robot that passes by is before it
    await touch(session, [await pixel(page, 1, 8.5)], []);
    return page.isVisible('#sheet #tag-card');
  });   // which leaves less room for the map
  await drawn(page);
  const [x, y] = await pixel(page, 5, 5);
  const first = await scale();
  await touch(session, [[x, y]], [[x + 20, y + 10]], [[x + 40, y + 20]], [[x + 60, y + 30]], []);
  await near(5, 5, [x + 60, y + 30], 'after a finger moved');
  check(await scale() === first, 'one finger zoomed');
  // About the point between the fingers, which moves, too.
  const [a, b] = [x + 60, y + 30];
  const apart = (d, dx, dy) => [[a + dx - d, b + dy], [a + dx + d, b + dy]];
  await touch(session, [[a - 30, b]], apart(30, 0, 0), apart(45, -10, 5), apart(60, -20, 10), apart(75, -30, 15), apart(90, -40, 20), []);
  await near(5, 5, [a - 40, b + 20], 'after a pinch');
  check(Math.abs(await scale() / first - 3) < 0.1, `a pinch to three times the size: ${await scale() / first}`);
  await page.evaluate(() => window.pheromone.map.view.fit());

  const posts = [];
  page.on('request', (request) => request.method() === 'POST' && posts.push(request.url()));
  await page.click('[data-tool="brush"]');
  await page.selectOption('#options select', 'trail');
  const painted = await sensed(2, 1, 1);
  const [c, d] = await pixel(page, 2, 1);
  await touch(session, [[c, d]], [[c, d], [c + 50, d]], [[c - 20, d], [c + 70, d]], [[c - 40, d], [c + 90, d]], []);
  check(await scale() > 1.5 * first, 'a pinch does not zoom with a brush in hand');
  await page.evaluate(() => window.pheromone.map.view.fit());
  check(posts.length === 0 && await sensed(2, 1, 1) === painted, `a pinch paints: ${posts}`);
  await touch(session, [[c, d]], [[c + 6, d]], [[c + 12, d]], []);
  await until('a finger paints', async () => await sensed(2, 1, 1) > painted);
  checkClean();
  await context.close();
}

async function screenshots(browser) {
  begin('screenshots');
  for (const theme of ['dark', 'light']) {
    for (const [name, width, height] of [['wall', 1920, 1080], ['laptop', 1280, 800], ['phone', 390, 844]]) {
      const {page, context, checkClean} = await open(browser, swarm.port, {viewport: {width, height}, colorScheme: theme});
      await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
      await page.waitForFunction(() => window.pheromone.store.robots.size === 2 && window.pheromone.store.layers.get('path')?.levels);
      check(new URL(page.url()).hash === '', 'the token stays in the address');
      await until('trails', () => page.evaluate(() => [...window.pheromone.store.trails.values()].some((it) => it.length > 12)));
      if (name !== 'phone') await page.click('.row[data-robot]');
      await page.waitForTimeout(600);
      await page.screenshot({path: join(out, `${name}-${theme}.png`)});
      if (name === 'phone') {
        await page.click('#side-toggle');
        await page.waitForTimeout(400);
        await page.screenshot({path: join(out, `${name}-panels-${theme}.png`)});
      }
      checkClean();
      await context.close();
    }
  }
}

async function scaleIsFixed(page, lab) {
  begin('the colours end at the maximum of the law; what is half looks like half; auto is an option');
  const law = await page.evaluate(() => window.pheromone.store.laws.get('path'));
  const paint = (y, units) => lab.post('paint', {pheromone: 'path', points_m: [[0.6, y]], radius_m: 0.25, units});
  await paint(0.6, 0.5);
  await paint(1.3, 0.25);
  await until('the picture has both', async () => await levelAt(page, 'path', 0.6, 0.6) > 0.4 && await levelAt(page, 'path', 0.6, 1.3) > 0.2);
  const [half, quarter] = [await colourAt(page, 0.6, 0.6), await colourAt(page, 0.6, 1.3)];
  check(Math.hypot(...half.map((it, i) => it - quarter[i])) > 60, `0.5 is ${half}, 0.25 is ${quarter}`);
  check(await page.evaluate(() => window.pheromone.store.layers.get('path').range) === law.maximum, 'the scale does not end at the maximum of the law');
  // The server renormalises its bytes when the peak falls; the colour stays.
  await lab.post('erase', {pheromone: 'path', all: true});
  await paint(1.3, 0.25);
  await until('the server has another scale', async () => page.evaluate(() => window.pheromone.store.layers.get('path').scale < 1));
  await until('the picture has it', async () => await levelAt(page, 'path', 0.6, 1.3) > 0.2);
  const again = await colourAt(page, 0.6, 1.3);
  check(Math.hypot(...again.map((it, i) => it - quarter[i])) < 12, `0.25 was ${quarter} and is ${again} beside nothing else`);
  check(await page.textContent('.layer[data-layer="path"] .scale') === '0–1', 'the scale is not told');
  await page.click('.layer[data-layer="path"] .scale');
  const auto = await colourAt(page, 0.6, 1.3);
  check(Math.hypot(...auto.map((it, i) => it - again[i])) > 60, 'auto has no effect');
  await page.waitForSelector('.legend >> text=/auto/');
  await page.click('.layer[data-layer="path"] .scale');
}

/** The colours of the pixels around a place of the map. */
async function pixelsAround(page, x, y, sidePx) {
  await drawn(page);
  return page.evaluate(([mapX, mapY, side]) => {
    const {view, canvases: {base}} = window.pheromone.map;
    const ratio = base.width / view.width;
    const {data} = base.getContext('2d').getImageData(view.sx(mapX) * ratio - (side >> 1), view.sy(mapY) * ratio - (side >> 1), side, side);
    return Array.from({length: side * side}, (_, i) => [...data.slice(4 * i, 4 * i + 3)]);
  }, [x, y, sidePx]);
}

/** Also when the server tells the laws again. */
async function coloursStay(page, lab) {
  begin('each pheromone and each blend has a hue of its own, also after a law was changed');
  const hues = () => page.evaluate(() => Object.fromEntries([...window.pheromone.store.layers].map(([name, it]) => [name, String(it.hue)])));
  const before = await hues();
  check(new Set(Object.values(before)).size === 5, `hues: ${JSON.stringify(before)}`);
  await lab.post('laws', {pheromone: 'trail', tau_s: 77});
  await page.waitForFunction(() => window.pheromone.store.laws.get('trail').tau_s === 77);
  check(JSON.stringify(Object.entries(await hues()).sort()) === JSON.stringify(Object.entries(before).sort()), `hues: ${JSON.stringify(before)}, then ${JSON.stringify(await hues())}`);
}

async function pheromones(browser) {
  const lab = new Swarm(binDir, `${defaultConfig(binDir)}
[[pheromone]]
type = 3
name = "danger"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 1.0
weight = -1.0
[[pheromone]]
type = 4
name = "guide"
blend = [{pheromone = "path"}, {pheromone = "danger", weight = -0.5}]
[[pheromone]]
type = 5
name = "both"
blend = [{pheromone = "path"}, {pheromone = "trail"}]
`);
  try {
    await lab.start();
    const {page, context, checkClean} = await open(browser, lab.port);
    await page.goto(`http://127.0.0.1:${lab.port}/#token=${TOKEN}`);
    await page.waitForSelector('.layer[data-layer="guide"]');
    await coloursStay(page, lab);
    await scaleIsFixed(page, lab);
    begin('a repellent is hatched, a blend is a layer, the curve of a path is drawn; a floor plan; wall mode');
    await lab.post('erase', {pheromone: 'path', all: true});
    for (const [name, x] of [['path', 2], ['danger', 2], ['danger', 4], ['path', 6]]) await lab.post('paint', {pheromone: name, points_m: [[x, 6]], radius_m: 0.5, units: 1});
    check(!await page.isChecked('.layer[data-layer="guide"] input'), 'a blend hides its parts from the beginning');
    await page.waitForSelector('.layer[data-layer="danger"] .ramp.repels');
    await page.waitForSelector('.legend >> text=/danger repels/');
    await page.check('.layer[data-layer="guide"] input');
    for (const name of ['path', 'danger', 'trail']) await page.uncheck(`.layer[data-layer="${name}"] input`);
    const value = (x) => page.evaluate((at) => window.pheromone.store.layers.get('guide').valueAt(at, 6), x);
    await until('the blend is there', async () => Math.abs(await value(2) - 0.5) < 0.01);
    check(Math.abs(await value(4) + 0.5) < 0.01 && Math.abs(await value(6) - 1) < 0.01, `the blend is ${await value(4)} and ${await value(6)}`);
    const spread = (pixels) => Math.max(...[0, 1, 2].map((i) => Math.max(...pixels.map((it) => it[i])) - Math.min(...pixels.map((it) => it[i]))));
    check(spread(await pixelsAround(page, 6, 6, 16)) < 20, 'what attracts is hatched');
    check(spread(await pixelsAround(page, 4, 6, 16)) > 60, 'what repels is not hatched');
    await page.waitForSelector('.legend >> text=/guide blend/');
    await page.screenshot({path: join(out, 'blend.png')});

    // All of the path was erased, but its curve can be seen: where it begins, at (5, 3).
    check(await page.evaluate(() => window.pheromone.store.paths.length === 1 && window.pheromone.store.paths[0].points_m.length > 100), 'the path is not a curve');
    check(spread(await pixelsAround(page, 5, 3, 24)) > 40, 'the curve of the path is not drawn');
    await page.uncheck('.switches [name="grid"]');
    await page.uncheck('.switches [name="paths"]');
    check(spread(await pixelsAround(page, 5, 3, 24)) === 0, 'the curve of the path cannot be hidden');

    const plan = Buffer.from((await page.evaluate(() => {
      const canvas = document.createElement('canvas');
      canvas.width = canvas.height = 40;
      const on = canvas.getContext('2d');
      on.fillStyle = '#f00';
      on.fillRect(0, 0, 40, 40);
      return canvas.toDataURL('image/png');
    })).split(',')[1], 'base64');
    await page.click('.floorplan summary');
    await page.setInputFiles('#floorplan-file', {name: 'room.png', mimeType: 'image/png', buffer: plan});
    const isRed = async (x, y) => { const [r, g, b] = await colourAt(page, x, y); return r > 100 && g < 30 && b < 30; };
    await until('the plan is under the map', () => isRed(8, 2));
    await page.fill('[name="floorplan-width"]', '4');
    check(await isRed(3, 3) && !await isRed(8, 2), 'the width of the plan has no effect');
    await page.reload();
    await until('the plan is kept', () => isRed(3, 3));
    await page.click('.floorplan summary');
    await page.click('#floorplan-remove');
    check(!await isRed(3, 3), 'the plan is not removed');

    await page.locator('#stage').focus();
    const width = () => page.evaluate(() => window.pheromone.map.view.width);
    const before = await width();
    await page.keyboard.press('w');
    await page.waitForSelector('#side', {state: 'hidden'});
    await until('the map is the page', async () => await width() > before + 300);
    await page.waitForFunction(() => /wall=1/.test(location.hash));
    await page.screenshot({path: join(out, 'wall-mode.png')});
    await page.reload();
    await page.waitForSelector('#side', {state: 'hidden'});
    await page.waitForFunction(() => window.pheromone.store.map);
    await page.keyboard.press('w');
    await page.waitForSelector('#side');
    checkClean();
    await context.close();
  } finally {
    await lab.end();
  }
}

/** Nets and their semaphores, on the bench of the paper. */
async function nets(browser) {
  begin('nets and semaphores');
  const text = readFileSync(join(source, 'deploy/examples/bench.toml'), 'utf8')
    .replace(/\n\[web\][^[]*/g, '\n').replace(/"nets\//g, `"${join(source, 'deploy/examples/nets')}/`);
  const bench = new Swarm(binDir, text);
  try {
    await bench.start();
    const {page, context, checkClean} = await open(browser, bench.port);
    await page.goto(`http://127.0.0.1:${bench.port}/#token=${TOKEN}`);
    await page.waitForSelector('.net h3');
    await page.waitForSelector('.row .sign.go, .row .sign.stop');
    await page.waitForSelector('.net-tags .sign');
    await page.click('.net summary');
    await page.waitForSelector('.net .marks');
    await page.screenshot({path: join(out, 'bench.png')});
    checkClean();
    await context.close();
  } finally {
    await bench.end();
  }
}

for (const file of ['uPlot.iife.min.js', 'uPlot.min.css']) {
  check(readFileSync(`node_modules/uplot/dist/${file}`).equals(readFileSync(join(source, 'server/operators/web/dashboard/vendor', file))),
        `${file} is not that of npm's package`);
}
await run(swarm, async (browser) => {
  await swarm.start();
  await swarm.drive('radio-a.pty', 1);
  await swarm.drive('radio-b.pty', 2);
  await withoutToken(browser);
  await wrongToken(browser);
  const {page, watch, checkClean} = await open(browser, swarm.port);
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await live(page);
  const id = await commands(page);
  await brushAndEraser(page);
  await panels(page);
  await agreesWithTheEngine(page);
  await followsAPaintedPath(page, id);
  await haltAll(page);
  await antennas(page, id);
  await measure(page);
  await addressOf(browser, page);
  await exports(page, id);
  await mcap(page, id);
  await several(browser);
  await cut(page, watch);
  checkClean();
  await fingers(browser);
  await screenshots(browser);
  await nets(browser);
  await pheromones(browser);
});
