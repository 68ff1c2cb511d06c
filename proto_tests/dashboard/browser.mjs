// Debian's Chromium without a window, and what a page said and asked for.
import {chromium} from 'playwright-core';
import {check} from './swarm.mjs';

export function launch() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--disable-gpu', '--disable-component-update', '--disable-background-networking'],
  });
}

/** A page, and what went wrong on it. While `cut` is set, failing connections are expected. */
export async function open(browser, port, options = {}) {
  const context = await browser.newContext({viewport: {width: 1440, height: 900}, colorScheme: 'dark', ...options});
  const page = await context.newPage();
  const watch = {errors: [], hosts: new Set(), cut: false};
  const connects = /ERR_CONNECTION|ERR_EMPTY_RESPONSE|WebSocket connection to .* failed/;
  page.on('console', (message) => {
    if (message.type() !== 'error' || (watch.cut && connects.test(message.text()))) return;
    watch.errors.push(`${message.text()} ${message.location().url}`);
  });
  page.on('pageerror', (error) => watch.errors.push(String(error.stack)));
  const note = (url) => {
    if (!/^(data|blob):/.test(url)) watch.hosts.add(new URL(url).host);
  };
  page.on('request', (request) => note(request.url()));
  page.on('websocket', (socket) => note(socket.url()));
  return {page, context, watch, checkClean() {
    check(watch.errors.length === 0, `the console has errors:\n${watch.errors.join('\n')}`);
    const foreign = [...watch.hosts].filter((host) => host !== `127.0.0.1:${port}`);
    check(foreign.length === 0, `the page asked ${foreign}`);
  }};
}

/** Pixels of the page for metres of the map. */
export function pixel(page, x, y) {
  return page.evaluate(([mapX, mapY]) => {
    const {view} = window.pheromone.map;
    const box = view.element.getBoundingClientRect();
    return [box.left + view.sx(mapX), box.top + view.sy(mapY)];
  }, [x, y]);
}

/** The page has heard the server. */
export const live = (page) => page.waitForSelector('#link-state[data-state="live"]', {timeout: 60000});

/** What the page draws next is on the screen. */
export const drawn = (page) => page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
