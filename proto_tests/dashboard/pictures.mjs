// Makes the README's pictures of the dashboard: a screenshot, and a film in which an operator paints a
// path and sends a robot along it. Needs ImageMagick (convert).
//
// Usage: node pictures.mjs BIN_DIR OUT          OUT: deploy/pictures
import {spawnSync} from 'node:child_process';
import {mkdirSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {setTimeout as pause} from 'node:timers/promises';
import {launch, open, pixel} from './browser.mjs';
import {Swarm, TOKEN, check, defaultConfig, until} from './swarm.mjs';

const [binDir, out] = process.argv.slice(2);
const FRAME_MS = 220;
const ROBOTS = 5;
const preset = defaultConfig(binDir)
  .replace('[[link]]', '[unused]').replace(/\[unused\][\s\S]*?(?=\n#)/, '');
const tags = [['door', 0.9, 8.7, 0.8], ['charger', 9.0, 8.8, 0.7], ['shelf', 4.6, 5.3, 0.7]];
const swarm = new Swarm(binDir, [preset,
  ...Array.from({length: ROBOTS}, (_, i) => `[[link]]\nname = "radio-${i + 1}"\nkind = "pty"\npath = "radio-${i + 1}.pty"`),
  ...tags.map(([name, x, y, range]) => `[[tag]]\nname = "${name}"\nx_m = ${x}\ny_m = ${y}\nrange_m = ${range}\nslots = 8`),
  '[obstacles]\nrectangles_m = [[5.6, 4.0, 6.1, 5.6]]\ndiscs_m = [[3.6, 6.0, 0.3]]',
  '[journal]\nfolder = "journal"'].join('\n'));
const post = (path, body) => fetch(`http://127.0.0.1:${swarm.port}/api/v1/${path}`, {
  method: 'POST', headers: {Authorization: `Bearer ${TOKEN}`}, body: JSON.stringify(body)});

const browser = await launch();
const frames = mkdtempSync(join(tmpdir(), 'film-'));
try {
  mkdirSync(out, {recursive: true});
  await swarm.start();
  for (let i = 1; i <= ROBOTS; i += 1) {
    await swarm.drive(`radio-${i}.pty`, i);
    if (i < ROBOTS) await pause(9000);
  }
  await post('paint', {pheromone: 'trail', points_m: [[7.3, 5.4], [7.6, 6.1]], radius_m: 0.45, units: 0.3});
  await post('paint', {pheromone: 'trail', points_m: [[7.4, 5.6], [7.5, 5.9]], radius_m: 0.25, units: 0.75});
  const {page} = await open(browser, swarm.port, {viewport: {width: 1440, height: 900}});
  await page.goto(`http://127.0.0.1:${swarm.port}/#token=${TOKEN}`);
  await page.waitForSelector('.row[data-robot="radio-3/3"]');
  await page.click('.row[data-robot="radio-3/3"]');
  await page.click('.layer[data-layer="path"] .name');
  await pause(25000);
  await page.screenshot({path: join(out, 'dashboard.png')});

  const stage = await page.locator('#stage').boundingBox();
  const at = await pixel(page, -0.9, 10.2);
  const to = await pixel(page, 10.3, -0.5);
  const clip = {x: Math.max(stage.x, at[0] - 60), y: stage.y, width: to[0] - Math.max(stage.x, at[0] - 60) + 10, height: stage.height};
  let count = 0;
  const shoot = async () => {
    await page.screenshot({path: join(frames, `${String(count).padStart(3, '0')}.png`), clip});
    count += 1;
    await pause(FRAME_MS - 60);
  };
  await page.click('#halt');
  await pause(1500);
  const {pose} = await swarm.robot(3);
  const points = [[pose.x_m, pose.y_m]];
  let heading = (pose.heading_deg * Math.PI) / 180;
  for (let i = 0; i < 14; i += 1) {
    const [x, y] = points.at(-1);
    const wanted = Math.atan2(7.3 - y, 5 - x);
    const turn = Math.atan2(Math.sin(wanted - heading), Math.cos(wanted - heading));
    if (i > 0) heading += Math.max(-0.3, Math.min(0.3, turn));
    points.push([x + 0.35 * Math.cos(heading), y + 0.35 * Math.sin(heading)]);
  }
  for (let i = 0; i < 3; i += 1) await shoot();
  await page.click('[data-tool="path"]');
  await page.selectOption('#options select', 'trail');
  for (const [x, y] of points) {
    await page.mouse.click(...await pixel(page, x, y));
    await shoot();
  }
  await page.keyboard.press('Enter');
  await page.keyboard.press('v');
  await page.selectOption('#follow-type', '1');
  await page.click('#follow');
  await page.click('#resume');
  await page.mouse.move(stage.x + 300, stage.y + 8);
  for (let i = 0; i < 40; i += 1) {
    await shoot();
    await pause(FRAME_MS);
  }
  const made = spawnSync('/usr/bin/convert', ['-delay', '18', '-loop', '0', join(frames, '*.png'), '-resize', '560x', '+dither', '-colors', '40',
                                     '-layers', 'OptimizeTransparency', join(out, 'dashboard.gif')], {encoding: 'utf8'});
  check(made.status === 0, `convert: ${made.error ?? made.stderr}`);
} finally {
  await browser.close();
  await swarm.end();
  rmSync(frames, {recursive: true, force: true});
}
