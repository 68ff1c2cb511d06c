// A picture of levels that are known at nodes only: between them, smooth. A line of single nodes is a
// line, whatever its direction, and a few nodes around a point are a disc.
//
// Around each pixel, the nodes are weighed by a Gaussian: w. The colour is that of sum(w L^2) / sum(w L),
// which is L wherever all nodes that have something have L: a thin line is not paler than a wide one,
// and half of it is half. The shape is where sum(w [L > 0]) is more than in the gaps beside a line. The
// nodes of a line one node wide are those nearest to it, so they lie to either side: they are moved onto
// the mean of their neighbours along the line, by no more than the rounding.

import {BLOCKED} from './tiles.js';

const SIGMA = 0.65;   // of the Gaussian, in cells
const REACH = 2;      // nodes to either side
const EDGE = [0.17, 0.36];
const ROUNDS = 12;    // a line is smoothed over sqrt(ROUNDS / 2) nodes to either side
const ROUNDING = 0.7; // cells; half of a cell's diagonal

const kernels = new Map();   // by pixels a cell
const bell = (d) => Math.exp(-(d * d) / (2 * SIGMA * SIGMA));

/** The weights of the nodes -REACH to REACH for each of `factor` pixels in a cell; each adds up to 1. */
export function weightsOf(factor) {
  let rows = kernels.get(factor);
  if (!rows) {
    rows = Array.from({length: factor}, (_, pixel) => {
      const row = Array.from({length: 2 * REACH + 1}, (__, i) => bell(i - REACH - ((pixel + 0.5) / factor - 0.5)));
      const sum = row.reduce((a, b) => a + b);
      return row.map((it) => it / sum);
    });
    kernels.set(factor, rows);
  }
  return rows;
}

/** Pixels a cell, for a cell that has so many on screen; 1: it is not worth it. */
export const factorOf = (cellPx) => (cellPx < 3 ? 1 : Math.min(8, Math.max(2, Math.round(cellPx / 2))));

/** The nodes of lines that are one node wide, moved onto the line: Map from index to [column, row]. */
function linesOf(levels, columns, rows, {first, last, bottom, top}) {
  const there = (column, row) => {
    if (column < 0 || row < 0 || column >= columns || row >= rows) return false;
    const level = levels[row * columns + column];
    return level !== 0 && level !== BLOCKED;
  };
  const nodes = [];   // {index, column, row, x, y, next: indices}
  for (let row = Math.max(0, bottom); row < Math.min(rows, top); row += 1) {
    for (let column = Math.max(0, first); column < Math.min(columns, last); column += 1) {
      if (!there(column, row)) continue;
      const next = [];
      let isThin = true;
      for (const dx of [-1, 1]) {
        for (const dy of [-1, 1]) {
          if (!there(column + dx, row + dy)) continue;
          const beside = there(column + dx, row);
          const above = there(column, row + dy);
          if (beside && above) isThin = false;   // a block of four
          if (!beside && !above) next.push((row + dy) * columns + column + dx);
        }
        if (there(column + dx, row)) next.push(row * columns + column + dx);
        if (there(column, row + dx)) next.push((row + dx) * columns + column);
      }
      if (isThin && next.length === 2) nodes.push({index: row * columns + column, column, row, x: column, y: row, next});
    }
  }
  const byIndex = new Map(nodes.map((it) => [it.index, it]));
  const at = (index) => byIndex.get(index) ?? {x: index % columns, y: Math.floor(index / columns)};
  for (let round = 0; round < ROUNDS; round += 1) {
    const moved = nodes.map(({x, y, next: [a, b]}) => [(at(a).x + 2 * x + at(b).x) / 4, (at(a).y + 2 * y + at(b).y) / 4]);
    nodes.forEach((it, i) => {
      const [dx, dy] = [moved[i][0] - it.column, moved[i][1] - it.row];
      const by = Math.min(1, ROUNDING / Math.max(1e-9, Math.hypot(dx, dy)));
      it.x = it.column + dx * by;
      it.y = it.row + dy * by;
    });
  }
  return new Map(nodes.map(({index, x, y}) => [index, [x, y]]));
}

let sums = new Float32Array(0);   // of w, w L and w L^2 for each pixel

/**
 * Writes the pixels of the cells {first, last, bottom, top} (ends excluded), `factor` a cell to either
 * side, the top row first. `levels` begins with the bottom row.
 */
export function paint(pixels, levels, columns, rows, {first, last, bottom, top}, factor, lut) {
  const width = (last - first) * factor;
  const height = (top - bottom) * factor;
  if (factor === 1) {
    for (let row = bottom; row < top; row += 1) {
      let to = (top - 1 - row) * width;
      for (let from = row * columns + first, end = row * columns + last; from < end; from += 1, to += 1) pixels[to] = lut[levels[from]];
    }
    return;
  }
  if (sums.length < 3 * width * height) sums = new Float32Array(3 * width * height);
  sums.fill(0, 0, 3 * width * height);
  const lines = linesOf(levels, columns, rows, {first: first - ROUNDS, last: last + ROUNDS, bottom: bottom - ROUNDS, top: top + ROUNDS});
  const used = new Uint8Array(top - bottom);   // cells' rows with something in reach
  const mark = (row) => { for (let i = Math.max(bottom, row - REACH - 1); i <= Math.min(top - 1, row + REACH + 1); i += 1) used[i - bottom] = 1; };
  const weights = weightsOf(factor);
  const along = new Float32Array(3 * width);

  for (let row = Math.max(0, bottom - REACH - 1); row < Math.min(rows, top + REACH + 1); row += 1) {
    // First to the left and right, then up and down.
    let low = width;
    let high = 0;
    for (let column = Math.max(0, first - REACH - 1); column < Math.min(columns, last + REACH + 1); column += 1) {
      const level = levels[row * columns + column];
      if (level === 0 || level === BLOCKED) continue;
      mark(row);
      const place = lines.get(row * columns + column);
      if (place) { splat(place[0] - first, place[1] - bottom, level, width, height, factor); continue; }
      if (low > high) along.fill(0);
      for (let cell = Math.max(first, column - REACH); cell <= Math.min(last - 1, column + REACH); cell += 1) {
        const to = (cell - first) * factor;
        low = Math.min(low, to);
        high = Math.max(high, to + factor);
        for (let pixel = 0; pixel < factor; pixel += 1) {
          const w = weights[pixel][column - cell + REACH];
          along[3 * (to + pixel)] += w;
          along[3 * (to + pixel) + 1] += w * level;
          along[3 * (to + pixel) + 2] += w * level * level;
        }
      }
    }
    if (low >= high) continue;
    for (let cell = Math.max(bottom, row - REACH); cell <= Math.min(top - 1, row + REACH); cell += 1) {
      for (let pixel = 0; pixel < factor; pixel += 1) {
        const w = weights[pixel][row - cell + REACH];
        const to = 3 * ((cell - bottom) * factor + pixel) * width;
        for (let i = 3 * low; i < 3 * high; i += 1) sums[to + i] += w * along[i];
      }
    }
  }

  for (let y = 0; y < height; y += 1) {
    let to = (height - 1 - y) * width;   // the picture begins at the top
    if (!used[Math.floor(y / factor)]) { pixels.fill(0, to, to + width); continue; }
    for (let from = 3 * y * width, end = from + 3 * width; from < end; from += 3, to += 1) {
      const there = sums[from];
      if (there <= EDGE[0]) { pixels[to] = 0; continue; }
      const colour = lut[Math.min(254, Math.max(1, Math.round(sums[from + 2] / sums[from + 1])))];
      if (there >= EDGE[1]) { pixels[to] = colour; continue; }
      const t = (there - EDGE[0]) / (EDGE[1] - EDGE[0]);
      pixels[to] = ((colour & 0xFFFFFF) | (Math.round((colour >>> 24) * t * t * (3 - 2 * t)) << 24)) >>> 0;
    }
  }
}

// One node at a place between nodes, in cells from the corner's node.
function splat(x, y, level, width, height, factor) {
  const total = 2 * Math.PI * SIGMA * SIGMA;
  const range = (at, size) => [Math.max(0, Math.ceil((at - REACH) * factor)), Math.min(size - 1, Math.floor((at + 1 + REACH) * factor))];
  const [left, right] = range(x, width);
  const [low, high] = range(y, height);
  for (let row = low; row <= high; row += 1) {
    const across = bell((row + 0.5) / factor - 0.5 - y) / total;
    for (let column = left; column <= right; column += 1) {
      const w = across * bell((column + 0.5) / factor - 0.5 - x);
      const to = 3 * (row * width + column);
      sums[to] += w;
      sums[to + 1] += w * level;
      sums[to + 2] += w * level * level;
    }
  }
}
