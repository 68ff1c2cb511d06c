// The map: three canvases on each other, each redrawn only when what it shows has changed: floor
// (pheromones, paths, obstacles, grid), trails (by a worker), and what moves.
import {store} from './store.js';
import {byId} from './dom.js';
import {View} from './view.js';
import {drawRobots, isMoving} from './robots.js';
import {TrailsCanvas} from './trails.js';
import {drawPlaces, fontOf, write} from './places.js';

const NAMES = ['base', 'top'];   // drawn here

export class SwarmMap {
  constructor() {
    this.stage = byId('stage');
    this.canvases = Object.fromEntries(NAMES.map((name) => [name, byId(name)]));
    this.contexts = Object.fromEntries(NAMES.map((name) => [name, this.canvases[name].getContext('2d')]));
    this.trails = new TrailsCanvas(byId('trails'));
    this.dirty = new Set([...NAMES, 'trails']);
    this.overlay = () => {};   // the tool's own drawing
    this.plan = null;          // a picture under all (floorplan.js)
    this.frames = [];          // [start, milliseconds], for measurements
    this.view = new View(this.stage, () => {
      this.invalidate();
      store.emit('shown');
    });
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
      const before = store.density;
      store.density = null;
      if (store.shows.robots) drawRobots(this.contexts.top, this.view, this.theme, now, before);
      if (before?.cellM !== store.density?.cellM || before?.most !== store.density?.most) store.emit('robots');   // for the legend
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
    this.plan?.draw(context, view);
    const grid = store.shows.grid ? this.gridLines() : null;
    if (grid) this.drawGrid(context, grid, left, top, width, height);

    if (store.shows.paths) this.drawPaths(context, theme['ink-2'], [7, 5]);
    this.drawField(context);
    if (store.shows.paths && view.scale * map.cell_m > 5) this.drawPaths(context, theme.map, []);
    context.strokeStyle = theme['ink-3'];
    context.lineWidth = 1;
    context.strokeRect(Math.round(left) - 0.5, Math.round(top) - 0.5, Math.round(width) + 1, Math.round(height) + 1);
    if (grid) this.writeGrid(context, grid, left, top, width, height);
  }

  drawField(context) {
    const {view, theme} = this;
    let walls = null;
    for (const layer of store.layers.values()) {
      if (!layer.levels) continue;
      walls ??= layer;
      const cells = layer.visible ? this.cellsOnScreen(layer) : null;
      if (!cells) continue;
      for (const picture of layer.pictures(cells, layer.cellM * view.scale)) {
        if (picture.repels) this.hatch(context, (on) => this.drawPicture(on, layer, picture));
        else this.drawPicture(context, layer, picture);
      }
    }
    const image = walls?.wallsIn(theme.wall);
    if (image) {
      const {columns, rows} = walls;
      this.drawPicture(context, walls, {canvas: image, area: {first: 0, last: columns, bottom: 0, top: rows}, factor: 1}, false);
    }
  }

  /** Pheromones and obstacles of a part of the map alone, in an image of `scale` pixels a metre. */
  fieldOf(left, right, low, high, scale) {
    const canvas = new OffscreenCanvas(Math.ceil((right - left) * scale), Math.ceil((high - low) * scale));
    const {view} = this;
    this.view = Object.assign(Object.create(View.prototype), {x: (left + right) / 2, y: (low + high) / 2, scale, width: canvas.width, height: canvas.height});
    this.drawField(canvas.getContext('2d'));
    this.view = view;
    return canvas;
  }

  /** {first, last, bottom, top} of a layer, or null. */
  cellsOnScreen({xM, yM, cellM, columns, rows}) {
    const {view} = this;
    const column = (px) => ((px - view.width / 2) / view.scale + view.x - xM) / cellM;
    const row = (px) => (view.y - (px - view.height / 2) / view.scale - yM) / cellM;
    const cells = {first: Math.max(0, Math.floor(column(0))), last: Math.min(columns, Math.ceil(column(view.width))),
                   bottom: Math.max(0, Math.floor(row(view.height))), top: Math.min(rows, Math.ceil(row(0)))};
    return cells.last > cells.first && cells.top > cells.bottom ? cells : null;
  }

  // Only the part on screen: scaling what is outside costs as much.
  drawPicture(context, layer, {canvas, area, factor}, smooth = true) {
    const {view} = this;
    const cells = this.cellsOnScreen(layer);
    if (!cells) return;
    const {first, last, bottom, top} = {first: Math.max(area.first, cells.first), last: Math.min(area.last, cells.last),
                                        bottom: Math.max(area.bottom, cells.bottom), top: Math.min(area.top, cells.top)};
    const step = layer.cellM * view.scale;
    context.imageSmoothingEnabled = smooth && step / factor < 24;
    context.drawImage(canvas, (first - area.first) * factor, (area.top - top) * factor, (last - first) * factor, (top - bottom) * factor,
                      view.sx(layer.xM) + first * step, view.sy(layer.yM + top * layer.cellM), (last - first) * step, (top - bottom) * step);
  }

  // With stripes left out, which tell what repels from what attracts, whatever their colours.
  hatch(context, draw) {
    const {width, height} = context.canvas;
    if (!this.scratch || this.scratch.width !== width || this.scratch.height !== height) this.scratch = new OffscreenCanvas(width, height);
    const on = this.scratch.getContext('2d');
    on.setTransform(1, 0, 0, 1, 0, 0);
    on.globalCompositeOperation = 'source-over';
    on.clearRect(0, 0, width, height);
    on.setTransform(context.getTransform());
    draw(on);
    on.setTransform(1, 0, 0, 1, 0, 0);
    on.globalCompositeOperation = 'destination-out';
    this.stripes ??= on.createPattern(stripes(Math.round(9 * context.getTransform().a)), 'repeat');
    on.fillStyle = this.stripes;
    on.fillRect(0, 0, width, height);
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.scratch, 0, 0);
    context.restore();
  }

  // The curves as configured; what lies on the map are nodes near them. Once below, to be seen where
  // nothing lies any more, and once above, thin.
  drawPaths(context, colour, dash) {
    const {view} = this;
    context.lineJoin = 'round';
    context.lineWidth = 1;
    context.strokeStyle = colour;
    context.setLineDash(dash);
    for (const {closed, points_m: points} of store.paths) {
      context.beginPath();
      points.forEach(([x, y], i) => context[i ? 'lineTo' : 'moveTo'](view.sx(x), view.sy(y)));
      if (closed) context.closePath();
      context.stroke();
    }
    context.setLineDash([]);
  }

  /** Where lines are, in pixels, with the coordinate that is written at each. */
  gridLines() {
    const {view} = this;
    const {origin_m: [x0, y0], width_m: width, height_m: height} = store.map;
    const along = (from, length, px, most) => ticksOf(from, from + length, view.scale)
      .map(([it, label]) => [Math.round(px(it)) + 0.5, label]).filter(([at]) => at > -20 && at < most + 20);
    return {x: along(x0, width, (it) => view.sx(it), view.width), y: along(y0, height, (it) => view.sy(it), view.height)};
  }

  drawGrid(context, grid, left, top, width, height) {
    const {view, theme} = this;
    context.lineWidth = 1;
    context.strokeStyle = theme['line-soft'];
    context.beginPath();
    for (const [x] of grid.x) {
      context.moveTo(x, Math.max(0, top));
      context.lineTo(x, Math.min(view.height, top + height));
    }
    for (const [y] of grid.y) {
      context.moveTo(Math.max(0, left), y);
      context.lineTo(Math.min(view.width, left + width), y);
    }
    context.stroke();
  }

  // Last, so that neither lines nor pheromones cross the numbers. Where the map goes on beyond the
  // screen, they are on it: x at its lower edge, y at the right, where there are no tools.
  writeGrid(context, grid, left, top, width, height) {
    const {view, theme} = this;
    context.font = fontOf(11);
    context.fillStyle = theme['ink-2'];
    context.textBaseline = 'middle';
    context.textAlign = 'center';
    const y = Math.min(top + height + 11 * store.typeScale, view.height - 10 * store.typeScale);
    for (const [x, label] of grid.x) if (x > 12 && x < view.width - 40) write(context, theme, label, x, y);
    const isInside = left < 46 * store.typeScale;
    context.textAlign = 'right';
    const x = isInside ? Math.min(view.width - 6, Math.max(left + width + 30 * store.typeScale, 40)) : left - 6;
    for (const [at, label] of grid.y) if (at > 8 && at < view.height - 24) write(context, theme, label, x, at);
  }
}

function stripes(side) {
  const canvas = new OffscreenCanvas(side, side);
  const context = canvas.getContext('2d');
  context.strokeStyle = 'rgb(0 0 0 / 0.85)';
  context.lineWidth = side * 0.3;
  for (const shift of [-side, 0, side]) {
    context.moveTo(shift - 1, side + 1);
    context.lineTo(shift + side + 1, -1);
  }
  context.stroke();
  return canvas;
}

/** [metres, label] of lines between two coordinates: 1, 2 or 5 times a power of ten, 70 pixels or more. */
export function ticksOf(from, to, scale) {
  const least = 70 / scale;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((it) => it * power).find((it) => it >= least);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const ticks = [];
  for (let n = Math.ceil(from / step - 1e-9); n * step <= to + 1e-9; n += 1) {
    ticks.push([n * step, (n * step).toFixed(decimals).replace(/^-(0(\.0*)?)$/, '$1').replace('-', '−')]);
  }
  return ticks;
}
