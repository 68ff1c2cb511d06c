// Recordings in the dashboard: what happens is recorded, replayed, sought in, and compared with what
// the API said of the map and the robots at those moments; and back to live. Screenshots of the
// replay are left in OUT.
//
// Usage: node replay_test.mjs BIN_DIR OUT
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';
import {checkAccessible} from './axe.mjs';
import {live, open} from './browser.mjs';
import {begin, run} from './steps.mjs';
import {Swarm, TOKEN, UNPLUGGED, check, defaultConfig, until} from './swarm.mjs';

const [binDir, out] = process.argv.slice(2);
mkdirSync(out, {recursive: true});
const swarm = new Swarm(binDir, `${defaultConfig(binDir)}
${UNPLUGGED}[obstacles]
rectangles_m = [[4.6, 4.6, 5.4, 5.4]]
`);
const PHEROMONES = ['path', 'trail'];

const post = (path, body) => swarm.post(path, body);
const paint = (pheromone, points, units) => post('paint', {pheromone, points_m: points, radius_m: 0.3, units});

/**
 * What the API says of now. Robots stand: nothing but evaporation changes meanwhile, nor within 20 ms,
 * since a recording's clock and ours may differ by a few.
 */
async function moment() {
  const begun = Date.now();
  await until('20 ms', async () => Date.now() > begun + 20);
  const fields = {};
  for (const name of PHEROMONES) fields[name] = await swarm.get(`field?pheromone=${name}&format=json`);
  const {pose} = await swarm.robot(1);
  const ms = Date.now();
  await until('20 ms', async () => Date.now() > ms + 20);
  return {ms, fields, pose};
}

/** The page shows this moment, and nothing is under way. */
async function seek(page, ms) {
  const before = await page.evaluate((at) => {
    const {replay, store} = window.pheromone;
    replay.seek(at);
    return [...store.layers].map(([name, it]) => [name, it.received]);
  }, ms);
  await page.waitForFunction(([at, messages]) => {
    const {replay, store} = window.pheromone;
    return replay.phase === 'paused' && Number(replay.at / 1000000n) === at && store.robots.size > 0 &&
           messages.every(([name, received]) => store.layers.get(name).received > received);
  }, [ms, before], {timeout: 60000});
}

async function compare(page, {ms, fields, pose}, what) {
  await seek(page, ms);
  for (const name of PHEROMONES) {
    const field = fields[name];
    const picture = await page.evaluate((it) => {
      const {columns, rows, levels, scale} = window.pheromone.store.layers.get(it);
      return {columns, rows, scale, levels: [...levels]};
    }, name);
    check(field.columns === picture.columns && field.rows === picture.rows, `${what}: ${name}: the sizes differ`);
    let painted = 0;
    field.values.forEach((values, down) => values.forEach((value, column) => {
      const level = picture.levels[(field.rows - 1 - down) * field.columns + column];
      const place = `${what}: ${name}, column ${column}, row ${field.rows - 1 - down}: ${level} of ${picture.scale} for ${value}`;
      check((value === null) === (level === 255), `blocked or not: ${place}`);
      // A level, and what evaporates while the API is asked.
      if (value !== null) check(Math.abs((level / 254) * picture.scale - value) <= picture.scale / 254 + 0.02, place);
      painted += value > 0 ? 1 : 0;
    }));
    console.log(`    ${what}: ${painted} cells of ${name}`);
  }
  const robot = await page.evaluate(() => [...window.pheromone.store.robots.values()].find((it) => it.id === 1));
  check(Math.hypot(robot.pose.x_m - pose.x_m, robot.pose.y_m - pose.y_m) < 0.002,
        `${what}: the robot is at ${JSON.stringify(robot.pose)}, not ${JSON.stringify(pose)}`);
}

async function stands() {
  await post('halt', {});
  await until('the robot stands', async () => {
    const before = await swarm.robot(1);
    const after = await until('requests', async () => {
      const now = await swarm.robot(1);
      return now.requests >= before.requests + 10 && now;
    });
    return after.pose.x_m === before.pose.x_m && after.pose.y_m === before.pose.y_m;
  });
}

async function drives(metres) {
  const {pose} = await swarm.robot(1);
  await post('command', {link: 'radio-a', id: 1, command: 'resume', arguments: []});
  await until('the robot drives', async () => {
    const now = (await swarm.robot(1)).pose;
    return Math.hypot(now.x_m - pose.x_m, now.y_m - pose.y_m) > metres;
  });
}

async function record() {
  begin('something happens, and is recorded');
  await until('a pose', async () => (await swarm.robot(1))?.pose);
  await post('capture', {action: 'start'});
  const moments = [];
  await drives(0.3);
  await stands();
  await paint('path', [[2, 2], [5, 3]], 1);
  await paint('trail', [[7, 2], [8, 8]], 1);
  moments.push(await moment());
  await drives(0.6);
  await stands();
  await post('erase', {pheromone: 'path', points_m: [[2, 2], [3, 2.3]], radius_m: 0.4});
  moments.push(await moment());
  await paint('path', [[1, 9], [9, 9]], 0.5);
  moments.push(await moment());
  await drives(0.3);
  await stands();
  await post('capture', {action: 'stop'});
  const {captures} = await swarm.get('captures');
  return {name: captures.at(-1).name, moments};
}

async function disabled(page) {
  for (const it of ['[data-tool="path"]', '[data-tool="brush"]', '[data-tool="eraser"]', '#record', '#snapshot']) {
    check(await page.isDisabled(it), `${it} is not disabled`);
  }
  check(/not while a recording is replayed/.test(await page.getAttribute('[data-tool="brush"]', 'title')), 'the reason is not told');
  check(await page.isEnabled('#halt-all'), 'halting is not possible');
}

async function replays(browser, {name, moments}) {
  const {page, context, checkClean} = await open(browser, swarm.port);
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await live(page);
  begin('a recording is replayed');
  await page.click('#panel-recordings summary');
  await page.click(`button.replay[data-capture="${name}"]`);
  await page.waitForSelector('#replay-banner:not([hidden])');
  check((await page.textContent('#replay-banner')).startsWith(`Replay of ${name} – not live`), 'the banner does not say so');
  await page.waitForFunction(() => window.pheromone.replay.phase === 'playing' && window.pheromone.store.layers.get('path')?.levels);
  await disabled(page);
  // Keys are not disabled, but command nobody: the robots that are shown are those of the recording.
  await page.waitForFunction(() => window.pheromone.store.robots.size > 0);
  await page.locator('#stage').focus();
  await page.keyboard.press('n');
  const before = (await swarm.robot(1)).last_command.seq;
  for (const key of ['u', 'h']) {
    await page.keyboard.press(key);
    await page.waitForSelector('.toasts [role="alert"] >> text=Nothing is sent: not while a recording is replayed');
  }
  check((await swarm.robot(1)).last_command.seq === before, 'a robot of the present was commanded from the past');
  await page.keyboard.press('Escape');
  const first = await page.evaluate(() => window.pheromone.replay.at);
  await page.waitForFunction((at) => window.pheromone.replay.at > at, first);
  await page.keyboard.press(' ');
  await page.waitForFunction(() => window.pheromone.replay.phase === 'paused');

  begin('a link without traffic is not shown as one that works');
  const dots = () => page.$$eval('#panel-links .row.link', (rows) => rows.map((it) => [it.children[1].textContent.trim(), it.children[0].className]));
  await until('the links', async () => (await dots()).length === 2);
  const [, [name2, dot]] = await dots();
  check(name2 === 'modem no traffic' && dot === 'dot ', `${name2}: ${dot}`);

  begin('at each moment it shows what there was');
  await compare(page, moments[1], 'second moment');
  await compare(page, moments[0], 'first moment, backwards');
  await compare(page, moments[2], 'third moment');
  await compare(page, moments[0], 'first moment again');
  check(!(await page.textContent('#replay-banner .trouble')), 'there is a problem');

  begin('time line, keys and speed');
  await page.fill('#replay-scrub', '1000');
  await page.waitForFunction(() => {
    const {replay} = window.pheromone;
    return replay.phase === 'paused' && !replay.isWaiting && 2n * (replay.at - replay.begin) >= (replay.end - replay.begin) - 10000000n;
  });
  await page.click('#stage', {position: {x: 300, y: 300}});
  const middle = await page.evaluate(() => window.pheromone.replay.at);
  await page.keyboard.press('ArrowLeft');
  await page.waitForFunction((at) => window.pheromone.replay.phase === 'paused' && window.pheromone.replay.at < at, middle);
  await page.keyboard.press('Home');
  await page.waitForFunction(() => window.pheromone.replay.at === window.pheromone.replay.begin);
  await page.selectOption('#replay-speed', '32');
  await page.click('#replay-play');
  await page.waitForFunction(() => window.pheromone.replay.phase === 'ended', null, {timeout: 60000});
  check(await page.evaluate(() => window.pheromone.replay.at === window.pheromone.replay.end), 'it did not end at the end');
  await page.keyboard.press('Escape');

  for (const key of ['d', 'd']) {   // both themes
    await checkAccessible(page, `replay, ${await page.getAttribute('html', 'data-theme')}`);
    await page.keyboard.press(key);
  }

  begin('back to live');
  await page.click('#back-to-live');
  await page.waitForSelector('#replay-banner', {state: 'hidden'});
  await page.waitForFunction(() => document.querySelector('#link-state').textContent === 'Live' && window.pheromone.store.layers.get('path')?.levels);
  check(await page.isEnabled('[data-tool="brush"]'), 'the brush is still disabled');
  await page.waitForFunction(() => Math.abs(window.pheromone.store.layers.get('path').valueAt(5, 9) - 0.5) < 0.01);
  checkClean();
  await context.close();
}

async function missing(browser) {
  begin('a file that is not there is not being read');
  const {page, context} = await open(browser, swarm.port);   // its console tells of the refusal
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await live(page);
  await page.evaluate(() => window.pheromone.replay.enter('nothing.pcapng'));
  await page.waitForFunction(() => document.querySelector('#replay-banner .trouble').textContent);
  const told = await page.textContent('#replay-banner .replay-words');
  check(!/reading/.test(told) && /nothing\.pcapng/.test(told), told);
  await context.close();
}

async function screenshots(browser, {name, moments}) {
  begin('screenshots');
  for (const theme of ['dark', 'light']) {
    for (const [size, width, height] of [['wall', 1920, 1080], ['laptop', 1280, 800], ['phone', 390, 844]]) {
      const {page, context, checkClean} = await open(browser, swarm.port, {viewport: {width, height}, colorScheme: theme});
      await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
      await live(page);
      await page.evaluate((it) => window.pheromone.replay.enter(it), name);
      await page.waitForFunction(() => window.pheromone.replay.phase === 'playing' && window.pheromone.store.layers.get('path')?.levels);
      await page.keyboard.press(' ');
      await seek(page, moments[0].ms);
      await page.keyboard.press(' ');   // plays: a trail
      await page.waitForFunction((ms) => window.pheromone.replay.at > BigInt(ms) * 1000000n, moments[1].ms, {timeout: 120000});
      await page.screenshot({path: join(out, `replay-${size}-${theme}.png`)});
      checkClean();
      await context.close();
    }
  }
}

await run(swarm, async (browser) => {
  await swarm.start();
  await swarm.drive('radio-a.pty', 1);
  const recording = await record();
  await replays(browser, recording);
  await missing(browser);
  await screenshots(browser, recording);
});
