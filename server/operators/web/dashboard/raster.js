// A pheromone's picture: levels as received, in colours of a scale that ends at the maximum of its law,
// so that half of a level looks like half; or, if so chosen, at the end of what is there now.
//
//   layer.take(decodeTiles(message));  layer.pictures(cells, pixelsPerCell)  ->  what the map draws
import {BLOCKED} from './tiles.js';
import {hueOf, lutOf} from './palettes.js';
import {factorOf, paint} from './smooth.js';

/** Levels in the colours of one scale, drawn as far as they are on screen. */
class Sheet {
  constructor(repels) {
    this.repels = repels;
    this.lut = null;
    this.version = 0;
  }

  /** An image of at least the cells {first, last, bottom, top} and which it covers. */
  picture(levels, columns, rows, wanted, cellPx) {
    const factor = factorOf(cellPx);
    const key = `${this.version} ${factor}`;
    const has = this.area;
    if (this.key === key && has.first <= wanted.first && has.last >= wanted.last && has.bottom <= wanted.bottom && has.top >= wanted.top) return this;
    // Somewhat more, so that a map that is moved is not painted anew each time.
    const more = (from, to) => Math.ceil((to - from) / 8);
    const area = {
      first: Math.max(0, wanted.first - more(wanted.first, wanted.last)), last: Math.min(columns, wanted.last + more(wanted.first, wanted.last)),
      bottom: Math.max(0, wanted.bottom - more(wanted.bottom, wanted.top)), top: Math.min(rows, wanted.top + more(wanted.bottom, wanted.top)),
    };
    const width = (area.last - area.first) * factor;
    const height = (area.top - area.bottom) * factor;
    if (!this.canvas || this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas = new OffscreenCanvas(width, height);
      this.context = this.canvas.getContext('2d');
      this.image = this.context.createImageData(width, height);
    }
    paint(new Uint32Array(this.image.data.buffer), levels, columns, rows, area, factor, this.lut);
    this.context.putImageData(this.image, 0, 0);
    Object.assign(this, {key, area, factor});
    return this;
  }
}

/** What a pheromone and a blend have in common: a name, colours, and where its cells are. */
class Coloured {
  constructor(name, index, visible) {
    Object.assign(this, {name, index, visible, palette: 'hue', theme: 'dark', isAuto: false});
  }

  setTheme(theme) {
    this.theme = theme;
    this.recolour();
  }

  setPalette(palette) {
    this.palette = palette;
    this.recolour();
  }

  get hue() { return hueOf(this.index, this.theme, this.repels); }
  /** The values of the scale's ends. */
  get ends() { return [this.isSigned && !this.repels ? -this.range : 0, this.range]; }
}

export class Layer extends Coloured {
  constructor(name, index) {
    super(name, index, true);
    this.maximum = null;  // of the law
    this.levels = null;   // rows from the bottom up
    this.scale = 1;       // of level 254
    this.version = 0;     // changes with every picture
    this.received = 0;    // messages that changed something
    this.past = null;     // {levels, scale} of a moment, or null
    this.sheet = new Sheet(false);
  }

  setLaw(law) {
    this.maximum = law?.maximum ?? null;
    this.sheet.repels = law?.weight < 0;
    this.recolour();
  }

  setAuto(isAuto) {
    this.isAuto = isAuto;
    this.recolour();
  }

  get repels() { return this.sheet.repels; }
  /** The colours of the scale from 0 to its end. */
  get rampLut() { return lutOf(this.palette, this.hue, this.theme); }
  /** Levels and the scale as shown: now, or in the past. */
  get shown() { return this.past ?? this; }
  /** The level that has the last colour. */
  get range() { return this.isAuto || !this.maximum ? this.shown.scale : this.maximum; }

  recolour() {
    this.coloured = `${this.shown.scale} ${this.range}`;
    this.sheet.lut = lutOf(this.palette, this.hue, this.theme, this.shown.scale / this.range);
    this.touch();
  }

  touch() {
    this.version += 1;
    this.sheet.version += 1;
  }

  /** Takes a decoded message of tiles.js. */
  take(message) {
    const {columns, rows} = message;
    if (!this.levels || columns !== this.columns || rows !== this.rows) {
      this.columns = columns;
      this.rows = rows;
      this.levels = new Uint8Array(columns * rows);
      this.walls = null;
    }
    this.xM = message.xM - message.cellM / 2;
    this.yM = message.yM - message.cellM / 2;
    this.cellM = message.cellM;
    this.scale = message.scale;
    if (message.full) this.levels.fill(0);
    for (const {x, y, width, height, levels} of message.tiles) {
      for (let row = 0; row < height; row += 1) {
        this.levels.set(levels.subarray(row * width, (row + 1) * width), (y + row) * columns + x);
      }
    }
    if (message.full || message.tiles.length > 0) this.received += 1;
    if (message.full) this.walls = null;
    if (this.coloured !== `${this.shown.scale} ${this.range}`) this.recolour();
    else this.touch();
  }

  /** Shows {levels, scale} of the past instead; null: the present ones. */
  show(past) {
    if (this.past === past) return;
    this.past = past && past.levels.length === this.levels?.length ? past : null;
    this.recolour();
  }

  /** In the law's units; null: off the map, or blocked. */
  valueAt(xM, yM) {
    if (!this.levels) return null;
    const column = Math.floor((xM - this.xM) / this.cellM);
    const row = Math.floor((yM - this.yM) / this.cellM);
    if (column < 0 || row < 0 || column >= this.columns || row >= this.rows) return null;
    const {levels, scale} = this.shown;
    const level = levels[row * this.columns + column];
    return level === BLOCKED ? null : (level / 254) * scale;
  }

  /** What is to be drawn: images with {area, factor, canvas, repels}, for the cells that are wanted. */
  pictures(wanted, cellPx) {
    return [this.sheet.picture(this.shown.levels, this.columns, this.rows, wanted, cellPx)];
  }

  /** An image of what is blocked, or null if nothing is. Made when it is first asked for. */
  wallsIn(colour) {
    if (!this.levels) return null;
    if (!this.walls || this.walls.colour !== colour) {
      const canvas = new OffscreenCanvas(this.columns, this.rows);
      const context = canvas.getContext('2d');
      context.fillStyle = colour;
      let any = false;
      for (let row = 0; row < this.rows; row += 1) {
        for (let column = 0; column < this.columns; column += 1) {
          if (this.levels[row * this.columns + column] !== BLOCKED) continue;
          context.fillRect(column, this.rows - 1 - row, 1, 1);
          any = true;
        }
      }
      this.walls = {canvas, colour, any};
    }
    return this.walls.any ? this.walls.canvas : null;
  }
}

/**
 * A weighted sum of other layers, which has no levels of its own: what attracts in its hue, what
 * repels hatched. `parts`: [{layer, weight}].
 */
export class Blend extends Coloured {
  constructor(name, index, parts) {
    super(name, index, false);
    Object.assign(this, {parts, isBlend: true});
    this.attracts = new Sheet(false);
    this.repelsSheet = new Sheet(true);
    this.isSigned = parts.some((it) => it.weight < 0);
    this.repels = parts.every((it) => it.weight < 0);
  }

  recolour() {
    const {theme} = this;
    this.attracts.lut = lutOf(this.palette, hueOf(this.index, theme), theme);
    this.repelsSheet.lut = lutOf('hue', hueOf(0, theme, true), theme);
    this.summed = null;
  }

  get first() { return this.parts.find((it) => it.layer?.levels)?.layer; }
  get levels() { return this.first?.levels; }
  get columns() { return this.first?.columns; }
  get rows() { return this.first?.rows; }
  get xM() { return this.first?.xM; }
  get yM() { return this.first?.yM; }
  get cellM() { return this.first?.cellM; }
  /** The most that it can be, to either side. */
  get range() {
    const side = (sign) => this.parts.reduce((sum, {layer, weight}) => sum + Math.max(0, sign * weight) * (layer?.range ?? 0), 0);
    return Math.max(side(1), side(-1), 1e-9);
  }

  get rampLut() { return this.repels ? this.repelsSheet.lut : this.attracts.lut; }
  get repelsLut() { return this.repelsSheet.lut; }

  valueAt(xM, yM) {
    let sum = 0;
    for (const {layer, weight} of this.parts) {
      const value = layer?.valueAt(xM, yM);
      if (value === null || value === undefined) return null;
      sum += weight * value;
    }
    return sum;
  }

  // Adds the parts up, if they changed.
  sum() {
    const of = this.parts.map(({layer}) => layer?.version).join();
    if (of === this.summed) return;
    this.summed = of;
    const size = this.columns * this.rows;
    const sum = new Float32Array(size);
    for (const {layer, weight} of this.parts) {
      if (!layer?.levels || layer.levels.length !== size) continue;
      const {levels, scale} = layer.shown;
      const by = ((weight * scale) / 254 / this.range) * 254;
      for (let i = 0; i < size; i += 1) if (levels[i] !== BLOCKED) sum[i] += by * levels[i];
    }
    this.above = Uint8Array.from(sum, (it) => (it > 0.5 ? Math.min(254, Math.round(it)) : 0));
    this.below = Uint8Array.from(sum, (it) => (it < -0.5 ? Math.min(254, Math.round(-it)) : 0));
    for (const it of [this.attracts, this.repelsSheet]) it.version += 1;
  }

  pictures(wanted, cellPx) {
    this.sum();
    return [this.attracts.picture(this.above, this.columns, this.rows, wanted, cellPx),
            ...(this.isSigned ? [this.repelsSheet.picture(this.below, this.columns, this.rows, wanted, cellPx)] : [])];
  }

  wallsIn() { return null; }
}
