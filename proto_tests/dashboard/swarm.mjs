// pheromoned and simulated robots in a folder of their own, for tests in a browser.
import {spawn, spawnSync} from 'node:child_process';
import {chmodSync, existsSync, mkdirSync, mkdtempSync, openSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {setTimeout as pause} from 'node:timers/promises';

export const TOKEN = 'a-token-of-the-test';
const PATIENCE_MS = 60000;

export function check(holds, otherwise) {
  if (!holds) throw new Error(otherwise);
}

/** The first true result of `get`, which may be asynchronous. That the machine stood still does not count. */
export async function until(what, get, patienceMs = PATIENCE_MS) {
  for (let waited = 0, last = Date.now();;) {
    const result = await get();
    if (result) return result;
    check(waited < patienceMs, `waited in vain: ${what}`);
    await pause(50);
    waited += Math.min(1000, Date.now() - last);
    last = Date.now();
  }
}

/** The default configuration, without its section [web], which is the last one. */
export function defaultConfig(binDir) {
  return spawnSync(join(binDir, 'pheromoned'), ['--default-config'], {encoding: 'utf8'}).stdout
    .replace(/\n\[web\][\s\S]*$/, '\n');
}

/** Parts of configurations: a modem that is not plugged in, so a link that is down; a tag. */
export const UNPLUGGED = `
[[link]]
name = "modem"
kind = "serial"
port = "./unplugged"
`;
export const DOOR = `
[[tag]]
name = "door"
x_m = 1.0
y_m = 8.5
range_m = 0.8
slots = 8
`;

export class Swarm {
  /** `config` is the text of a configuration; a section [web] with a token and `web` is added. */
  constructor(binDir, config, web = '') {
    this.binDir = binDir;
    this.folder = mkdtempSync(join(tmpdir(), 'dashboard-'));
    this.robots = [];
    this.port = 0;
    this.config = config;
    this.web = web;
    writeFileSync(join(this.folder, 'token'), TOKEN);
    chmodSync(join(this.folder, 'token'), 0o600);
  }

  async start() {
    writeFileSync(join(this.folder, 'test.toml'),
                  `${this.config}\n[web]\nlisten = "127.0.0.1:${this.port}"\ntoken_file = "token"\n${this.web}`);
    const log = openSync(join(this.folder, 'pheromoned.log'), 'w');
    this.daemon = spawn(join(this.binDir, 'pheromoned'), ['--config', 'test.toml', ...(process.env.WEB_ROOT ? ['--web-root', process.env.WEB_ROOT] : [])],
                        {cwd: this.folder, stdio: ['ignore', log, log]});
    this.daemonEnded = new Promise((resolve) => this.daemon.on('exit', resolve));
    const found = await until('the daemon listens', () => {
      check(this.daemon.exitCode === null, `the daemon ended:\n${this.log()}`);
      const text = this.log();
      return text.includes('ready: ') && text.match(/web: http:\/\/127\.0\.0\.1:(\d+)/);
    });
    this.port = Number(found[1]);
  }

  log() { return readFileSync(join(this.folder, 'pheromoned.log'), 'utf8'); }

  async drive(modem, id) {
    const path = join(this.folder, modem);
    await until(`${modem} appears`, () => existsSync(path));
    const out = join(this.folder, `robot-${id}`);
    mkdirSync(out);
    this.robots.push(spawn(join(this.binDir, 'pheromone-swarm'),
                           ['live', '--modem', path, '--id', String(id), '--out', out, '--speed', '150'], {stdio: 'ignore'}));
  }

  async get(path) {
    // Each on a connection of its own: an idle one may be closed just when it is used again.
    const response = await fetch(`http://127.0.0.1:${this.port}/api/v1/${path}`, {headers: {Connection: 'close'}});
    return response.json();
  }

  async post(path, body, status = 200) {
    const response = await fetch(`http://127.0.0.1:${this.port}/api/v1/${path}`, {
      method: 'POST', headers: {Authorization: `Bearer ${TOKEN}`, Connection: 'close'}, body: JSON.stringify(body)});
    const answer = await response.text();
    check(response.status === status, `${path}: ${answer}`);
    return JSON.parse(answer);
  }

  async robot(id) {
    return (await this.get('clients')).clients.find((it) => it.id === id);
  }

  async stopDaemon() {
    this.daemon.kill('SIGCONT');
    this.daemon.kill('SIGTERM');
    check(await this.daemonEnded === 0, `the daemon ended badly:\n${this.log()}`);
  }

  async end() {
    for (const robot of this.robots) robot.kill('SIGKILL');
    this.daemon?.kill('SIGKILL');
    await this.daemonEnded;
    rmSync(this.folder, {recursive: true, force: true});
  }
}
