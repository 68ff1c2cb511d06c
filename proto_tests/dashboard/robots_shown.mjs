// What the page of the server at PORT shows of each robot, and of who is halted: a line of JSON for each
// line that is read.
//
//   robots_shown.mjs PORT
import {createInterface} from 'node:readline';
import {launch, open} from './browser.mjs';

const port = Number(process.argv[2]);
const browser = await launch();
const {page, checkClean} = await open(browser, port);
await page.goto(`http://127.0.0.1:${port}/`);
await page.waitForSelector('#link-state[data-state="live"]');
console.log('{}');
for await (const line of createInterface({input: process.stdin})) {
  console.log(JSON.stringify(await page.$$eval('.row[data-robot], #halted', (elements) =>
    Object.fromEntries(elements.map((it) => [it.dataset.robot ?? it.id, it.hidden ? '' : it.textContent])))));
}
checkClean();
await browser.close();
