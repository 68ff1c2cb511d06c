// The last minutes, kept by the page itself, so that one can look back at what just happened: poses
// twice a second and pheromones every two seconds, in bounded memory.
import {store} from './store.js';

const KEEP_MS = 10 * 60 * 1000;
const EVERY_MS = 500;
const PICTURE_EVERY_MS = 2000;
const MOST_BYTES = 64 << 20;
const MOST_POSES = 1e6;   // of all moments together: some 500 MB

export class History {
  constructor() {
    this.moments = [];   // {at, robots, pictures: Map(name -> {levels, scale}) or null}
    this.bytes = 0;
    this.poses = 0;
    this.lastPicture = 0;
  }

  get start() { return this.moments[0]?.at ?? Date.now(); }

  record(now = Date.now()) {
    if (this.moments.length && now - this.moments.at(-1).at < EVERY_MS) return;
    let pictures = null;
    if (now - this.lastPicture >= PICTURE_EVERY_MS) {
      pictures = new Map();
      for (const layer of store.layers.values()) {
        if (!layer.levels || layer.isBlend || !layer.isNeeded) continue;
        const last = this.lastOf(layer.name);
        // What did not change is kept once.
        const same = last && last.version === layer.received && last.levels.length === layer.levels.length;
        if (same) pictures.set(layer.name, last);
        else {
          pictures.set(layer.name, {levels: layer.levels.slice(), scale: layer.scale, version: layer.received});
          this.bytes += layer.levels.length;
        }
      }
      this.lastPicture = now;
    }
    const robots = new Map();
    for (const [key, it] of store.robots) {
      robots.set(key, {key, link: it.link, id: it.id, pose: it.pose, antennas: it.antennas, goal: it.goal, follows: it.follows, state: it.state, silent_s: it.silent_s});
    }
    this.moments.push({at: now, robots, pictures});
    this.poses += robots.size;
    while (this.moments.length > 1 && (now - this.moments[0].at > KEEP_MS || this.bytes > MOST_BYTES || this.poses > MOST_POSES)) this.drop();
  }

  lastOf(name) {
    for (let i = this.moments.length - 1; i >= 0; i -= 1) {
      const {pictures} = this.moments[i];
      if (pictures) return pictures.get(name);
    }
    return undefined;
  }

  drop() {
    const {robots, pictures} = this.moments.shift();
    this.poses -= robots.size;
    const next = this.moments.find((it) => it.pictures)?.pictures;
    for (const [name, picture] of pictures ?? []) {
      if (next?.get(name) !== picture) this.bytes -= picture.levels.length;
    }
  }

  /** The last moment not after `at`, with the pictures shown then. */
  at(at) {
    let low = 0;
    let high = this.moments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.moments[middle].at <= at) low = middle;
      else high = middle - 1;
    }
    const moment = this.moments[low];
    if (!moment) return null;
    let pictures = null;
    for (let i = low; i >= 0 && !pictures; i -= 1) pictures = this.moments[i].pictures;
    return {at: moment.at, robots: moment.robots, pictures: pictures ?? new Map()};
  }

  clear() {
    this.moments = [];
    this.bytes = 0;
    this.poses = 0;
  }
}
