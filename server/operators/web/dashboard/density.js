// Robots that are too many to tell apart on the map: how many there are in each square of it.
import {colourAt, css, hueOf, lutOf} from './palettes.js';

const LEAST_PX = 10;   // of a square's side
const SHARE = 0.8;     // of its side that is drawn
const NEAR_M = 0.001;  // poses come in millimetres

/** 1, 2 or 5 times a power of ten, the least that is not less. */
function roundUp(least) {
  const power = 10 ** Math.floor(Math.log10(least) + 1e-9);
  return [1, 2, 5, 10].map((it) => it * power).find((it) => it >= least * (1 - 1e-9));
}

/**
 * Of poses in metres, the counts in the squares that are in view. Squares keep their places on the map
 * when the view moves: (0, 0) is a corner of one. `counts` has rows from the top on. `most` is the end
 * of the colours: that of the density `before`, as long as it fits, so that they do not flicker. Who
 * stands on the upper or right edge of the map, [x, y], is on the map.
 */
export function densityOf(poses, view, {before = null, edge: [right, upper] = [Infinity, Infinity]} = {}) {
  const cellM = roundUp(LEAST_PX / view.scale);
  const first = Math.floor((view.x - view.width / 2 / view.scale) / cellM);
  const last = Math.floor((view.x + view.width / 2 / view.scale) / cellM);
  const bottom = Math.floor((view.y - view.height / 2 / view.scale) / cellM);
  const top = Math.floor((view.y + view.height / 2 / view.scale) / cellM);
  const columns = last - first + 1;
  const counts = new Uint32Array(columns * (top - bottom + 1));
  let most = 0;
  const square = (at, edge) => Math.floor((Math.abs(at - edge) < NEAR_M ? edge - NEAR_M : at) / cellM);
  for (const {x_m: x, y_m: y} of poses) {
    const column = square(x, right) - first;
    const row = top - square(y, upper);
    if (column < 0 || column >= columns || row < 0 || row > top - bottom) continue;
    counts[row * columns + column] += 1;
    most = Math.max(most, counts[row * columns + column]);
  }
  const fits = before?.cellM === cellM && most <= before.most && most > before.most / 4;
  return {cellM, columns, first, top, counts, most: fits ? before.most : Math.max(2, roundUp(most || 1))};
}

/** From nobody to `most`, for the legend. The hue is the one after those of the pheromones. */
export const densityLut = (layers, theme) => lutOf('hue', hueOf(layers, theme), theme);

export function drawDensity(context, view, theme, density, layers) {
  const {cellM, columns, first, top, counts, most} = density;
  const name = theme.dark ? 'dark' : 'light';
  const hue = hueOf(layers, name);
  const colours = new Map();   // by count
  const side = cellM * view.scale;
  counts.forEach((count, i) => {
    if (count === 0) return;
    if (!colours.has(count)) {
      const [r, g, b, alpha] = colourAt('hue', hue, name, count / most);
      colours.set(count, css([r, g, b], alpha));
    }
    // On the ground of the scale, whatever pheromone is there; that is seen beside it.
    const x = view.sx((first + (i % columns) + (1 - SHARE) / 2) * cellM);
    const y = view.sy((top + 1 - Math.floor(i / columns) - (1 - SHARE) / 2) * cellM);
    for (const colour of [theme.map, colours.get(count)]) {
      context.fillStyle = colour;
      context.fillRect(x, y, SHARE * side, SHARE * side);
    }
  });
}
