// A pheromone's picture: levels as received, and an image of one pixel a cell, of which only what
// changed is coloured anew.
import {BLOCKED} from './tiles.js';
import {lutOf} from './palettes.js';

function blank(columns, rows) {
  const canvas = new OffscreenCanvas(columns, rows);
  return {canvas, context: canvas.getContext('2d')};
}

export class Layer {
  constructor(name, index) {
    this.name = name;
    this.index = index;
    this.visible = true;
    this.palette = 'hue';
    this.opacity = 1;
    this.levels = null;   // rows from the bottom up
    this.peak = 0;
    this.scale = 1;
    this.version = 0;     // changes with every picture
    this.received = 0;    // messages that changed something
    this.shown = null;    // levels of the past, or null
  }

  setTheme(theme) {
    this.theme = theme;
    this.recolour();
  }

  setPalette(palette) {
    this.palette = palette;
    this.recolour();
  }

  recolour() {
    this.lut = lutOf(this.palette, this.index, this.theme ?? 'dark');
    if (this.levels) this.colour(0, 0, this.columns, this.rows);
  }

  /** Takes a decoded message of tiles.js. */
  take(message) {
    const {columns, rows} = message;
    if (!this.levels || columns !== this.columns || rows !== this.rows) {
      this.columns = columns;
      this.rows = rows;
      this.levels = new Uint8Array(columns * rows);
      Object.assign(this, blank(columns, rows));
      this.image = this.context.createImageData(columns, rows);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.walls = null;
    }
    this.xM = message.xM - message.cellM / 2;
    this.yM = message.yM - message.cellM / 2;
    this.cellM = message.cellM;
    this.scale = message.scale;
    if (message.full) this.levels.fill(0);
    // Of many tiles, all at once takes less than each by itself.
    const whole = message.full || message.tiles.length * message.side ** 2 > columns * rows / 4;
    for (const {x, y, width, height, levels} of message.tiles) {
      for (let row = 0; row < height; row += 1) {
        this.levels.set(levels.subarray(row * width, (row + 1) * width), (y + row) * columns + x);
      }
      if (!whole && !this.shown) this.colour(x, y, width, height);
    }
    if (message.full || message.tiles.length > 0) this.received += 1;
    if (message.full) this.walls = null;
    if (whole && !this.shown) this.colour(0, 0, columns, rows);
    this.version += 1;
  }

  /** Shows levels of the past instead; null: the present ones. */
  show(levels) {
    if (this.shown === levels) return;
    this.shown = levels && levels.length === this.levels?.length ? levels : null;
    if (this.levels) this.colour(0, 0, this.columns, this.rows);
    this.version += 1;
  }

  colour(x, y, width, height) {
    const {columns, rows, pixels, lut} = this;
    const levels = this.shown ?? this.levels;
    for (let row = y; row < y + height; row += 1) {
      let from = row * columns + x;
      let to = (rows - 1 - row) * columns + x;
      for (const end = from + width; from < end; from += 1, to += 1) pixels[to] = lut[levels[from]];
    }
    this.context.putImageData(this.image, 0, 0, x, rows - y - height, width, height);
    this.version += 1;
  }

  /** In the law's units; null: off the map, or blocked. */
  valueAt(xM, yM) {
    if (!this.levels) return null;
    const column = Math.floor((xM - this.xM) / this.cellM);
    const row = Math.floor((yM - this.yM) / this.cellM);
    if (column < 0 || row < 0 || column >= this.columns || row >= this.rows) return null;
    const level = (this.shown ?? this.levels)[row * this.columns + column];
    return level === BLOCKED ? null : (level / 254) * this.scale;
  }

  /** An image of what is blocked, or null if nothing is. Made when it is first asked for. */
  wallsIn(colour) {
    if (!this.levels) return null;
    if (!this.walls || this.walls.colour !== colour) {
      const {canvas, context} = blank(this.columns, this.rows);
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
