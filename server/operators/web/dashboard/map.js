// The map: three canvases on each other, each redrawn only when what it shows has changed: floor
// (pheromones, obstacles, grid), trails (by a worker), and what moves.
import {store} from './store.js';
import {byId} from './dom.js';
import {View} from './view.js';
import {drawRobots, isMoving} from './robots.js';
import {TrailsCanvas} from './trails.js';
import {drawPlaces} from './places.js';
import {number} from './format.js';

const NAMES = ['base', 'top'];   // drawn here

export class SwarmMap {
  constructor() {
    this.stage = byId('stage');
    this.canvases = Object.fromEntries(NAMES.map((name) => [name, byId(name)]));
    this.contexts = Object.fromEntries(NAMES.map((name) => [name, this.canvases[name].getContext('2d')]));
    this.trails = new TrailsCanvas(byId('trails'));
    this.dirty = new Set([...NAMES, 'trails']);
    this.overlay = () => {};   // the tool's own drawing
    this.frames = [];          // [start, milliseconds], for measurements
    this.view = new View(this.stage, () => this.invalidate());
    this.readTheme();
  }

  readTheme() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(`--${name}`).trim();
    this.theme = Object.fromEntries(
      ['map', 'ground', 'panel', 'line', 'line-soft', 'ink', 'ink-2', 'ink-3', 'accent', 'warn', 'bad', 'good'].map((it) => [it, of(it)]));
    this.theme.dark = document.documentElement.dataset.theme === 'dark';
    this.theme.wall = this.theme.dark ? '#47545f' : '#a9a598';
    this.invalidate();
  }

  /** Draws these canvases with the next frame; without a name all. */
  invalidate(...names) {
    for (const name of names.length ? names : [...NAMES, 'trails']) this.dirty.add(name);
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.scheduled = false;
    const begin = performance.now();
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const dirty = this.dirty;
    this.dirty = new Set();
    // Each canvas is copied when it has changed; where nothing moves by hand, not all in one frame.
    const place = `${this.view.x} ${this.view.y} ${this.view.scale} ${this.view.width} ${this.view.height}`;
    this.later = dirty.has('base') && dirty.has('top') && place === this.place && !this.later;
    if (this.later) {
      dirty.delete('top');
      this.invalidate('top');
    }
    this.place = place;
    for (const name of NAMES.filter((it) => dirty.has(it))) {
      const canvas = this.canvases[name];
      const width = Math.round(this.view.width * ratio);
      const height = Math.round(this.view.height * ratio);
      if (canvas.width !== width || canvas.height !== height) {
        canvas.width = width;
        canvas.height = height;
      }
      const context = this.contexts[name];
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, this.view.width, this.view.height);
    }
    if (dirty.has('base')) this.drawFloor(this.contexts.base);
    if (dirty.has('trails')) this.trails.draw(this.view, ratio, this.theme);
    this.trails.place(this.view);
    if (dirty.has('top')) {
      drawPlaces(this.contexts.top, this.view, this.theme);
      if (store.shows.robots) drawRobots(this.contexts.top, this.view, this.theme, now);
      this.overlay(this.contexts.top, this.view, this.theme);
      if (isMoving(now)) this.invalidate('top');
    }
    this.frames.push(performance.now() - begin);
    if (this.frames.length > 2000) this.frames.splice(0, 1000);
  }

  drawFloor(context) {
    const {view, theme} = this;
    const map = store.map;
    if (!map) return;
    const [x, y] = map.origin_m;
    const left = view.sx(x);
    const top = view.sy(y + map.height_m);
    const width = map.width_m * view.scale;
    const height = map.height_m * view.scale;
    context.fillStyle = theme.ground;
    context.fillRect(0, 0, view.width, view.height);
    context.fillStyle = theme.map;
    context.fillRect(left, top, width, height);
    if (store.shows.grid) this.drawGrid(context, left, top, width, height);

    let walls = null;
    for (const layer of store.layers.values()) {
      if (!layer.levels) continue;
      walls ??= layer;
      if (!layer.visible) continue;
      context.globalAlpha = layer.opacity;
      this.drawImage(context, layer, layer.canvas, layer.cellM * view.scale < 24);
    }
    context.globalAlpha = 1;
    const image = walls?.wallsIn(theme.wall);
    if (image) this.drawImage(context, walls, image, false);
    context.strokeStyle = theme['ink-3'];
    context.lineWidth = 1;
    context.strokeRect(Math.round(left) - 0.5, Math.round(top) - 0.5, Math.round(width) + 1, Math.round(height) + 1);
  }

  // Only the part on screen: scaling what is outside costs as much.
  drawImage(context, layer, image, smooth) {
    const {view} = this;
    const {columns, rows, cellM, xM, yM} = layer;
    const step = cellM * view.scale;
    const left = view.sx(xM);
    const top = view.sy(yM + rows * cellM);
    const first = Math.max(0, Math.floor(-left / step) - 1);
    const last = Math.min(columns, Math.ceil((view.width - left) / step) + 1);
    const above = Math.max(0, Math.floor(-top / step) - 1);
    const below = Math.min(rows, Math.ceil((view.height - top) / step) + 1);
    if (last <= first || below <= above) return;
    context.imageSmoothingEnabled = smooth;
    context.drawImage(image, first, above, last - first, below - above,
                      left + first * step, top + above * step, (last - first) * step, (below - above) * step);
  }

  drawGrid(context, left, top, width, height) {
    const {view, theme} = this;
    const [x0, y0] = store.map.origin_m;
    const step = gridStep(view.scale);
    const right = left + width;
    const bottom = top + height;
    context.lineWidth = 1;
    context.font = '11px Inter, "Segoe UI", system-ui, "Liberation Sans", sans-serif';
    context.strokeStyle = theme['line-soft'];
    context.fillStyle = theme['ink-3'];
    context.beginPath();
    context.textAlign = 'center';
    context.textBaseline = 'top';
    for (let n = Math.ceil(x0 / step); n * step <= x0 + store.map.width_m + 1e-9; n += 1) {
      const at = Math.round(view.sx(n * step)) + 0.5;
      if (at < -40 || at > view.width + 40) continue;
      context.moveTo(at, Math.max(0, top));
      context.lineTo(at, Math.min(view.height, bottom));
      context.fillText(number(n * step), at, Math.min(bottom + 5, view.height - 16));
    }
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    for (let n = Math.ceil(y0 / step); n * step <= y0 + store.map.height_m + 1e-9; n += 1) {
      const at = Math.round(view.sy(n * step)) + 0.5;
      if (at < -20 || at > view.height + 20) continue;
      context.moveTo(Math.max(0, left), at);
      context.lineTo(Math.min(view.width, right), at);
      if (left > 56) context.fillText(number(n * step), left - 6, at);
    }
    context.stroke();
  }
}

/** Metres between lines: 1, 2 or 5 times a power of ten, 70 pixels or more. */
export function gridStep(scale) {
  const least = 70 / scale;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((it) => it * power).find((it) => it >= least);
}
