// The dashboard's panels, and whether everybody can use them: against the real daemon and simulated
// robots, in both themes, locked, on a phone, without a mouse. Screenshots are left in OUT.
//
// Usage: node panels_test.mjs BIN_DIR OUT
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';
import {checkAccessible} from './axe.mjs';
import {drawn, live, open, pixel} from './browser.mjs';
import {begin, run} from './steps.mjs';
import {DOOR, Swarm, TOKEN, UNPLUGGED, check, defaultConfig, until} from './swarm.mjs';

const [binDir, out] = process.argv.slice(2);
mkdirSync(out, {recursive: true});
const swarm = new Swarm(binDir, `${defaultConfig(binDir)}
${UNPLUGGED}${DOOR}[journal]
folder = "journal"
[capture]
folder = "captures"
`);

/** The page with the robot's card open, or at least its row. */
async function ready(browser, options, address = `#token=${TOKEN}`) {
  const opened = await open(browser, swarm.port, options);
  await opened.page.goto(`http://127.0.0.1:${swarm.port}/${address}`);
  await live(opened.page);
  await opened.page.waitForFunction(() => window.pheromone.store.robots.get('radio-a/1')?.pose && window.pheromone.store.tags.length > 0);
  await opened.page.waitForSelector('.row[data-robot]', {state: 'attached'});
  return opened;
}

async function accessible(browser) {
  for (const colorScheme of ['dark', 'light']) {
    begin(`axe: ${colorScheme}`);
    const {page, context, checkClean} = await ready(browser, {colorScheme});
    await page.click('.row[data-robot]');
    for (const panel of await page.$$('details.panel:not([open]) summary')) await panel.click();
    await checkAccessible(page, `${colorScheme}, a robot selected, all panels open`);
    await page.click('#play');
    await page.waitForFunction(() => window.pheromone.store.past);
    await checkAccessible(page, `${colorScheme}, in the past`);
    await page.click('#live');
    await page.click('[data-tool="path"]');
    await checkAccessible(page, `${colorScheme}, drawing a path`);
    await page.keyboard.press('Escape');
    await page.click('#help');
    await checkAccessible(page, `${colorScheme}, help`);
    await page.keyboard.press('Escape');
    await page.click('#halt-all');
    await page.waitForSelector('#halted:not([hidden])');
    await checkAccessible(page, `${colorScheme}, halted`);
    await page.click('#resume-all');
    await page.waitForSelector('#halted', {state: 'hidden'});
    checkClean();
    await context.close();

    const locked = await ready(browser, {colorScheme}, '');
    await locked.page.click('.row[data-robot]');
    await checkAccessible(locked.page, `${colorScheme}, locked`);
    await locked.page.click('#lock');
    await checkAccessible(locked.page, `${colorScheme}, unlocking`);
    locked.checkClean();
    await locked.context.close();

    const phone = await ready(browser, {colorScheme, viewport: {width: 390, height: 844}, hasTouch: true});
    await checkAccessible(phone.page, `${colorScheme}, 390 px`);
    await phone.page.click('#side-toggle');
    await checkAccessible(phone.page, `${colorScheme}, 390 px, panels`);
    await phone.page.click('.row[data-robot]');
    await phone.page.waitForSelector('#sheet #robot-card');
    await checkAccessible(phone.page, `${colorScheme}, 390 px, a robot selected`);
    phone.checkClean();
    await phone.context.close();
  }
}

const boxOf = (page, selector) => page.locator(selector).boundingBox();
const goalOf = (x, y) => until(`the goal ${x}, ${y}`, async () => {
  const {goal} = await swarm.robot(1);
  return goal && Math.hypot(goal.x_m - x, goal.y_m - y) < 0.02;
});

async function tapRobot(page) {
  await until('the card opens', async () => {
    const {pose} = await swarm.robot(1);
    await page.touchscreen.tap(...await pixel(page, pose.x_m, pose.y_m));
    return page.isVisible('#robot-card');
  });
}

/** Whether a click in the middle of each button reaches it. */
async function reachable(page, selector) {
  const covered = await page.$$eval(selector, (elements) => elements.filter((it) => it.offsetParent && !it.disabled).filter((it) => {
    const box = it.getBoundingClientRect();
    return !it.contains(document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2));
  }).map((it) => it.title || it.id));
  check(covered.length === 0, `covered: ${covered}`);
}

async function phone(browser) {
  begin('a phone: a tap opens the card, "Go here" leaves the map free');
  const {page, context, checkClean} = await ready(browser, {viewport: {width: 390, height: 844}, hasTouch: true});
  await reachable(page, '.bar button, #tools button');
  const bar = await boxOf(page, '#halt-all');
  check(bar.x + bar.width <= 390, `"Halt all" ends at ${bar.x + bar.width}`);
  await tapRobot(page);
  await page.screenshot({path: join(out, 'phone-card.png')});
  const sheet = await boxOf(page, '#sheet');
  check(sheet.y > (await pixel(page, 5, 5))[1], 'the card covers the middle of the map');
  await reachable(page, '#robot-card button');
  await page.click('#go-here');
  check(!(await page.isVisible('#sheet')), '"Go here" leaves the card over the map');
  await drawn(page);   // the map has its new size
  await page.touchscreen.tap(...await pixel(page, 3, 5));
  await goalOf(3, 5);
  await page.waitForSelector('#robot-card');
  await page.click('#cancel-goal');
  await page.click('#help');
  await page.waitForSelector('#help-dialog[open]');
  checkClean();
  await context.close();

  for (const [what, width, height, tool] of [['a phone on its side', 844, 390, 'path'], ['a laptop at 200 %', 720, 450, 'brush'], ['1024 px', 1024, 768, 'path']]) {
    begin(`${what}: nothing covers the tools`);
    const {page: wide, context: itsContext, checkClean: itsCheck} = await ready(browser, {viewport: {width, height}, hasTouch: true});
    await reachable(wide, '.bar button, #tools button, #zoom button');
    await wide.click(`[data-tool="${tool}"]`);
    await reachable(wide, '.bar button, #tools button, #zoom button, #options button');
    await wide.keyboard.press('v');
    await tapRobot(wide);
    await reachable(wide, '.bar button, #tools button');
    itsCheck();
    await itsContext.close();
  }
}

async function keyboard(browser) {
  begin('without a mouse: a robot, its goal, a path');
  const {page, context, checkClean} = await ready(browser, {});
  await page.focus('#stage');
  await page.keyboard.press('n');
  await page.waitForSelector('#robot-card:not([hidden])');
  await page.focus('#goal-x');
  await page.keyboard.type('4.5');
  await page.keyboard.press('Tab');
  await page.keyboard.type('6.25');
  await page.keyboard.press('Enter');
  await goalOf(4.5, 6.25);
  await page.focus('#stage');
  await page.keyboard.press('p');
  await page.selectOption('#options select', 'trail');
  await page.focus('#path-points');
  await page.keyboard.type('7, 7; 8.5');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.toasts [role="alert"] >> text=/Found 3 numbers, expected x, y of each point/');
  await page.focus('#path-points');
  await page.keyboard.press('Control+a');
  await page.keyboard.type('7, 7; 8.5, 7');
  await page.keyboard.press('Enter');
  await page.keyboard.type('8.5 8');
  await page.keyboard.press('Enter');
  await page.focus('#finish-path');
  await page.keyboard.press('Enter');
  for (const [x, y] of [[7.5, 7], [8.5, 7.5]]) {
    await until(`the path is at ${x}, ${y}`, async () => (await swarm.get(`sense?x_m=${x}&y_m=${y}&pheromone=trail`)).left.intensity > 0);
  }
  await page.keyboard.press('Escape');
  for (const key of ['?', '/']) {
    await page.focus('#stage');
    await page.keyboard.press(key);
    await page.waitForSelector('#help-dialog[open]');
    await page.keyboard.press('Escape');
  }

  begin('what the map shows, and each robot, in words');
  await page.click('#halt');
  await page.waitForFunction(() => /^Robot 1, halted.*, left [\d.]+, right [\d.]+$/.test(document.querySelector('.row[data-robot] > span').textContent));
  await page.waitForFunction(() => /^Map, 10 m by 10 m\. 1 robot: 1 halted\. Robot 1 at [\d.]+ m, [\d.]+ m, heading .*halted/.test(document.querySelector('#top').getAttribute('aria-label')));
  await page.click('#cancel-goal');
  await page.click('#resume');
  checkClean();
  await context.close();
}

/** Ten thousand robots, 100 to a square metre, told by the test in place of the server. */
async function crowd(browser) {
  begin('ten thousand robots: a density, and the first rows of a list');
  const {page, context, checkClean} = await ready(browser, {});
  await page.evaluate(() => {
    const {stream} = window.pheromone;
    stream.pause('/clients');
    const clients = Array.from({length: 10000}, (_, i) => ({link: `lab-${Math.floor(i / 250)}`, id: 1 + i % 250, known: true, silent_s: 0.1, requests: 1, refusals: 0, repeats: 0, goal: null,
      last_event: null, last_command: null, antennas: null, pose: {x_m: 0.05 + (i % 100) / 10, y_m: 0.05 + Math.floor(i / 100) / 10, heading_deg: 0, source: 'robot'},
      state: {is: 'driving', reason: null, since_s: 1, told_by: 'robot', moves: true, held: false}}));
    const {handler} = stream.watches.find((it) => it.match('/clients'));
    window.tell = () => handler(new TextEncoder().encode(JSON.stringify({field_time_ms: 1, clients})));
    window.tell();
  });
  await page.waitForSelector('#panel-robots >> text=The first 500 of 10000: the search finds others');
  check((await page.$$('.row[data-robot]')).length === 500, 'a list of as many rows');
  await page.waitForSelector('#legend .density');
  const {counts, cellM} = await page.evaluate(() => {
    const {density} = window.pheromone.store;
    return {counts: [...density.counts].filter((it) => it), cellM: density.cellM};
  });
  check(counts.reduce((a, b) => a + b) === 10000, 'robots are missing from the density');
  check(counts.every((it) => it === Math.round((10 * cellM) ** 2)), `in squares of ${cellM} m there are ${[...new Set(counts)]} robots`);
  await checkAccessible(page, 'a density');
  await page.screenshot({path: join(out, 'density.png')});
  await page.click('#select-all');
  check(await page.evaluate(() => window.pheromone.store.group.size) === 10000, 'not all are selected');
  await page.fill('#robot-search', 'lab-39 250');
  await page.waitForSelector('.row[data-robot="lab-39/250"]');
  await page.evaluate(() => {
    const {view} = window.pheromone.map;
    Object.assign(view, {fitted: false, scale: 1000});
    view.centre(5, 5);
  });
  await page.waitForFunction(() => !document.querySelector('#legend .density') && !window.pheromone.store.density);
  checkClean();
  await context.close();
}

/** Three hundred robots, told by the test in place of the server. */
async function manyRobots(browser) {
  begin('a list of three hundred robots, with a search');
  const {page, context, checkClean} = await ready(browser, {});
  await page.evaluate(() => {
    const {stream} = window.pheromone;
    stream.pause('/clients');
    const client = (link, id) => ({link, id, known: true, silent_s: 0.1, requests: 1, refusals: 0, repeats: 0, goal: null, last_event: null, last_command: null,
      antennas: null, pose: {x_m: id / 30, y_m: link === 'a' ? 2 : 8, heading_deg: 0, source: 'robot'},
      state: {is: id % 10 === 0 ? 'halted' : 'driving', reason: null, since_s: 1, told_by: 'robot', moves: true, held: false}});
    const clients = [...Array.from({length: 200}, (_, i) => client('a', i + 1)), ...Array.from({length: 100}, (_, i) => client('b', i + 1))];
    const {handler} = stream.watches.find((it) => it.match('/clients'));
    window.tell = () => handler(new TextEncoder().encode(JSON.stringify({field_time_ms: 1, clients})));
    window.halt = (link, id) => { clients.find((it) => it.link === link && it.id === id).state.is = 'halted'; };
    window.tell();
  });
  const rows = (count) => page.waitForFunction((it) => document.querySelectorAll('.row[data-robot]').length === it, count);
  await rows(300);
  await page.fill('#robot-search', 'b 7');
  await rows(11);   // 7 and 70 to 79
  check(await page.$('.row[data-robot="b/7"]') && !(await page.$('.row[data-robot="a/7"]')), 'the search shows others');
  await page.click('#select-all >> text=Select these 11');
  check(await page.textContent('#robot-card h3') === '11 robots', 'those that were found are not selected');
  check(await page.$$eval('#robot-card .about dd', ([state]) => state.textContent) === '10 driving · 1 halted', 'the states of the group');
  await checkAccessible(page, 'eleven robots selected');
  await page.screenshot({path: join(out, 'group.png')});
  await page.fill('#robot-search', 'halted');
  await rows(30);
  await page.fill('#robot-search', 'no such');
  await rows(0);
  await page.waitForSelector('#panel-robots >> text=None of 300 robots');
  await page.fill('#robot-search', '');
  await rows(300);
  await page.evaluate(() => window.halt('b', 99));   // far below what is in view: after some messages
  await page.waitForFunction(() => window.tell() ?? /halted/.test(document.querySelector('.row[data-robot="b/99"]').textContent));
  checkClean();
  await context.close();
}

/** What is drawn on a chart is of the links that are there, though one is not. */
async function charts(browser) {
  begin('charts: traffic with a dead link, the values under the pointer, one robot');
  const {page, context, checkClean} = await ready(browser, {});
  const traffic = page.locator('.dock > div', {has: page.locator('h2', {hasText: 'Bytes a second'})});
  await page.waitForFunction(() => [...document.querySelectorAll('.dock h2')].some((it) => /^Bytes a second.*[1-9]\d* B$/.test(it.textContent)));
  check(!/modem/.test(await traffic.locator('h2').textContent()), 'a link that was never there is on the chart');
  await until('two points', async () => (await traffic.locator('.u-over').boundingBox()) !== null);
  const over = await traffic.locator('.u-over').boundingBox();
  await page.mouse.move(over.x + over.width - 12, over.y + over.height / 2);
  await page.waitForFunction(() => [...document.querySelectorAll('.dock h2 .at')].some((it) => /^−\d+ s|^−now/.test(it.textContent)));
  await page.click('.row[data-robot]');
  await page.waitForFunction(() => {
    const [sensed, speed, away] = [...document.querySelectorAll('.robot-charts h4')].map((it) => it.textContent);
    return /P_L [\d.]+P_R [\d.]+$/.test(sensed) && /^Speed0\.\d+ m\/s$/.test(speed) && /^From the path0(\.\d+)? m$/.test(away);
  });
  checkClean();
  await context.close();
}

async function events(browser) {
  begin('events: what operators did, warnings, a filter, and where it was');
  const {page, context, checkClean} = await ready(browser, {});
  const shown = (pattern) => page.waitForFunction((it) => [...document.querySelectorAll('#events li')].some((row) => new RegExp(it).test(row.textContent)), pattern);
  const post = (...request) => swarm.post(...request);
  await post('paint', {pheromone: 'trail', points_m: [[2, 9], [3, 9]], radius_m: 0.1});
  await post('paint', {pheromone: 'no such', points_m: [[2, 9], [3, 9]], radius_m: 0.1}, 400);
  await post('goto', {link: 'radio-a', id: 1, x_m: 6.5, y_m: 8.25});
  await post('goto', {link: 'radio-a', id: 1, cancel: true});
  await shown('web 127.0.0.1: painted "trail" at \\(2, 9\\)$');
  await shown('web 127.0.0.1: paint: refused, found "no such"warning$');
  await shown('web 127.0.0.1: robot radio-a 1: sent to a goal at \\(6.5, 8.25\\)$');
  await shown('web 127.0.0.1: robot radio-a 1: goal cancelled$');
  check(!/painted "no such/.test(await page.textContent('#events')), 'what was refused is told as done');
  await shown('link radio-a is up');   // before any page was opened
  await page.click('#events .jump >> text=painted "trail" at (2, 9)');
  const [x, y] = await pixel(page, 2, 9);
  const stage = await boxOf(page, '#stage');
  check(Math.hypot(x - stage.x - stage.width / 2, y - stage.y - stage.height / 2) < 2, 'the place is not in the middle');
  await page.click('#events .jump >> text=goal cancelled');
  await page.waitForSelector('#robot-card:not([hidden])');

  await page.selectOption('#event-filter', 'operator');
  const kinds = await page.$$eval('#events li', (rows) => [...new Set(rows.map((it) => it.dataset.name))]);
  check(kinds.length === 1 && kinds[0] === 'operator', `shown as operators' actions: ${kinds}`);
  check(/^\d+ of \d+/.test(await page.textContent('#event-count')), 'the count does not say that some are not shown');
  await page.selectOption('#event-filter', 'all');
  // A robot that is killed is told by nobody; one whose link is silent stops by itself, and says so later.
  const stops = () => page.$$eval('#events li', (rows) => rows.filter((it) => /robot radio-a 1: (fail-safe stop|trail lost)/.test(it.textContent)).length);
  const stopsBefore = await stops();
  swarm.robots[0].kill('SIGSTOP');
  swarm.daemon.kill('SIGSTOP');
  swarm.robots[0].kill('SIGCONT');
  await new Promise((resolve) => setTimeout(resolve, 1500));   // the fault's length
  swarm.daemon.kill('SIGCONT');
  await until('the stop is told', async () => await stops() > stopsBefore);
  await page.waitForFunction(() => /\d+ new warnings?$/.test(document.querySelector('#event-count').textContent));
  await page.screenshot({path: join(out, 'events.png')});
  await page.selectOption('#event-filter', 'trouble');
  check((await page.$$eval('#events li .dot', (dots) => dots.every((it) => it.classList.contains('warn') || it.classList.contains('bad')))), 'something else is shown as a warning');
  await page.click('#acknowledge');
  await page.waitForFunction(() => !/new warning/.test(document.querySelector('#event-count').textContent) && !document.querySelector('#events .unseen'));
  checkClean();
  await context.close();
}

/** After a lost connection the stream tells the last ones again. */
async function toldAgain(browser) {
  begin('an event that is told again is shown once, also of several in one millisecond');
  const {page, context, checkClean} = await ready(browser, {});
  const texts = await page.evaluate(async () => {
    const {EventList} = await import('/dashboard/panels/events.js');
    const list = new EventList(document.createElement('div'), () => {});
    for (const text of ['a', 'b', 'c', 'a', 'b', 'c']) list.add({timeMs: 1000, level: 'info', text, name: 'link'});
    return list.events.map((it) => it.text).sort().join('');
  });
  check(texts === 'abc', `shown: ${texts}`);
  checkClean();
  await context.close();
}

/** That somebody is not told to halt interrupts what a screen reader says. */
async function notHalted(browser) {
  begin('a halt that fails');
  const {page, context} = await ready(browser, {});   // its console tells of the request
  await page.route('**/api/v1/halt', (route) => route.abort());
  await page.click('#halt-all');
  await page.waitForSelector('.toasts [role="alert"] >> text=NOT halted: the server does not answer');
  await context.close();
}

/** With the colours of the system alone, states are still shapes. */
async function forcedColours(browser) {
  begin('forced colours');
  const {page, context, checkClean} = await ready(browser, {forcedColors: 'active'});
  for (const selector of ['.row[data-robot] .dot', '.row[data-robot] .meter', '#panel-links .dot']) {
    const border = await page.$eval(selector, (it) => getComputedStyle(it).borderTopWidth);
    check(parseFloat(border) >= 1, `${selector} cannot be seen: its border is ${border}`);
  }
  await page.screenshot({path: join(out, 'forced-colours.png')});
  checkClean();
  await context.close();
}

async function screenshots(browser) {
  begin('screenshots');
  for (const colorScheme of ['dark', 'light']) {
    for (const [width, height] of [[2560, 1440], [1440, 900], [1024, 768], [844, 390], [390, 844]]) {
      const {page, context, checkClean} = await ready(browser, {colorScheme, viewport: {width, height}, hasTouch: width < 900});
      if (width < 900) await tapRobot(page);
      else await page.click('.row[data-robot]');
      await page.waitForTimeout(5000);   // for something to be on the charts
      await page.screenshot({path: join(out, `panels-${width}-${colorScheme}.png`)});
      checkClean();
      await context.close();
    }
  }
}

await run(swarm, async (browser) => {
  await swarm.start();
  await swarm.drive('radio-a.pty', 1);
  await accessible(browser);
  await phone(browser);
  await keyboard(browser);
  await crowd(browser);
  await manyRobots(browser);
  await charts(browser);
  await events(browser);
  await toldAgain(browser);
  await notHalted(browser);
  await forcedColours(browser);
  await screenshots(browser);
});
