// How the dashboard draws pheromones, without a browser: colours of levels, lines and discs of single
// nodes, the antennas' scale. Expectations are computed here, from CIE's formulas and from the laws.
//
// Usage: node drawing_test.mjs SOURCE_DIR
import {cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const [source] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'drawing-'));
cpSync(join(source, 'server/operators/web/dashboard'), folder, {recursive: true});
writeFileSync(join(folder, 'package.json'), '{"type": "module"}');   // so that Node takes them for modules
const {PALETTES, hueOf, lutOf} = await import(join(folder, 'palettes.js'));
const {factorOf, paint, weightsOf} = await import(join(folder, 'smooth.js'));
const {fullLine} = await import(join(folder, 'robots.js'));
const {densityOf, drawDensity} = await import(join(folder, 'density.js'));
const {distanceFrom} = await import(join(folder, 'charts.js'));
rmSync(folder, {recursive: true});

let failures = 0;
function check(holds, text) {
  if (holds) return;
  console.log(`  ${text}`);
  failures += 1;
}

// ---- CIE 1976 L*a*b*, D65, of sRGB ----

function lab([r, g, b]) {
  const linear = [r, g, b].map((it) => (it / 255 <= 0.04045 ? it / 255 / 12.92 : ((it / 255 + 0.055) / 1.055) ** 2.4));
  const xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]].map((row) => row.reduce((sum, it, i) => sum + it * linear[i], 0));
  const [x, y, z] = xyz.map((it, i) => it / [0.9505, 1, 1.089][i]).map((it) => (it > (6 / 29) ** 3 ? Math.cbrt(it) : it / (3 * (6 / 29) ** 2) + 4 / 29));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}
const distance = (a, b) => Math.hypot(...lab(a).map((it, i) => it - lab(b)[i]));
const channels = (pixel) => [pixel & 255, (pixel >>> 8) & 255, (pixel >>> 16) & 255, (pixel >>> 24) / 255];
const over = (pixel, ground) => {
  const [r, g, b, alpha] = channels(pixel);
  return [r, g, b].map((it, i) => it * alpha + ground[i] * (1 - alpha));
};

const css = readFileSync(join(source, 'server/operators/web/dashboard/theme.css'), 'utf8');
const grounds = Object.fromEntries(['dark', 'light'].map((theme) => {
  const block = css.slice(css.indexOf(`data-theme="${theme}"] {`));
  return [theme, [...block.match(/--map: #(\w\w)(\w\w)(\w\w)/).slice(1)].map((it) => parseInt(it, 16))];
}));

// ---- distance from a path: of a square, by hand ----

const corners = [[0, 0], [2, 0], [2, 2], [0, 2]];
for (const [x, y, open, closed] of [[1, 0, 0, 0], [1, -0.5, 0.5, 0.5], [3, 3, Math.SQRT2, Math.SQRT2], [0, 1, 1, 0], [0.25, 1, 1, 0.25], [-3, -4, 5, 5]]) {
  for (const [isClosed, expected] of [[false, open], [true, closed]]) {
    const found = distanceFrom([{closed: isClosed, points_m: corners}], {x_m: x, y_m: y});
    check(Math.abs(found - expected) < 1e-9, `(${x}, ${y}) is ${found} m from the ${isClosed ? 'closed' : 'open'} path, not ${expected} m`);
  }
}

// ---- density: 60 x 40 pixels, 10 a metre, around (1, 1): squares of 1 m, counted by hand ----

const screen = {x: 1, y: 1, scale: 10, width: 60, height: 40, sx: (x) => (x - 1) * 10 + 30, sy: (y) => (1 - y) * 10 + 20};
const places = [[0, 0], [0.99, 0.5], [1, 0], [-0.01, 0], [-2, 2.9], [-2.01, 0], [3.5, -0.5], [0, 3.01]].map(([x_m, y_m]) => ({x_m, y_m}));
const density = densityOf(places, screen);
check(density.cellM === 1 && density.first === -2 && density.columns === 7 && density.top === 3, `squares: ${JSON.stringify(density)}`);
const expected = new Map(Object.entries({'-2 2': 1, '-1 0': 1, '0 0': 2, '1 0': 1, '3 -1': 1, '0 3': 1}));   // by their lower left corners; (-2.01, 0) is off screen
const found = new Map([...density.counts].map((count, i) => [`${density.first + (i % 7)} ${density.top - Math.floor(i / 7)}`, count]).filter(([, count]) => count));
check(found.size === expected.size && [...expected].every(([at, count]) => found.get(at) === count), `density: ${JSON.stringify([...found])}`);
check(density.most === 2 && densityOf([], screen).most === 2, 'the scale of few robots ends at 2');
for (const [count, before, end] of [[3, null, 5], [7, null, 10], [11, null, 20], [3, 10, 10], [2, 10, 2], [11, 10, 20]]) {
  const at = densityOf(Array(count).fill({x_m: 0.5, y_m: 0.5}), screen, {before: before && {cellM: 1, most: before}});
  check(at.most === end, `the scale of ${count} robots after ${before} ends at ${at.most}, not ${end}`);
}
for (const [scale, side] of [[10, 1], [9.9, 2], [4, 5], [2, 5], [1.5, 10], [100, 0.1], [51, 0.2]]) {
  check(Math.abs(densityOf([], {...screen, scale}).cellM - side) < 1e-12, `at ${scale} pixels a metre, squares are ${densityOf([], {...screen, scale}).cellM} m`);
}
const onEdge = densityOf([{x_m: 2, y_m: 2.0004}, {x_m: 0.5, y_m: 0.5}, {x_m: 2.5, y_m: 0.5}], screen, {edge: [2, 2]});
check(onEdge.counts[2 * 7 + 3] === 1 && onEdge.counts[3 * 7 + 2] === 1 && onEdge.counts[3 * 7 + 4] === 1, `on the edge: ${JSON.stringify([...onEdge.counts])}`);
const rects = [];
drawDensity({fillRect: (...rect) => rects.push(rect)}, screen, {dark: true}, density, 0);
check(rects.length === 12 && rects.some((rect) => rect.every((it, i) => Math.abs(it - [21, 21, 8, 8][i]) < 1e-9)), `drawn: ${JSON.stringify(rects)}`);   // of (0, 0): 8 of 10 pixels, twice

// ---- hues are told apart, also by deuteranopes: Machado, Oliveira and Fernandes 2009, severity 1 ----

const DEUTERANOPIA = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]];
function asDeuteranope(colour) {
  const linear = colour.map((it) => (it / 255 <= 0.04045 ? it / 255 / 12.92 : ((it / 255 + 0.055) / 1.055) ** 2.4));
  return DEUTERANOPIA.map((row) => Math.min(1, Math.max(0, row.reduce((sum, it, i) => sum + it * linear[i], 0))))
    .map((it) => 255 * (it <= 0.0031308 ? 12.92 * it : 1.055 * it ** (1 / 2.4) - 0.055));
}
for (const theme of ['dark', 'light']) {
  const hues = [0, 1, 2, 3, 4, 5].map((index) => hueOf(index, theme, index === 5));
  for (const see of [(colour) => colour, asDeuteranope]) {
    const pairs = hues.flatMap((one, i) => hues.slice(i + 1).map((other) => distance(see(one), see(other))));
    check(pairs.length === 15 && Math.min(...pairs) >= 25, `${theme}, ${see.name}: two hues differ by ${Math.min(...pairs).toFixed(1)}`);
  }
}

let least = Infinity;
for (const theme of ['dark', 'light']) {
  for (const palette of PALETTES) {
    for (let index = 0; index < 6; index += 1) {
      const hue = hueOf(index, theme, index === 5);
      const lut = lutOf(palette, hue, theme);
      const seen = (value) => over(lut[Math.round(value * 254)], grounds[theme]);
      for (const [one, half] of [[0.638, 0.317], [1, 0.5], [0.5, 0.25]]) {
        const differs = distance(seen(one), seen(half));
        least = Math.min(least, differs);
        check(differs >= 20, `${theme}, ${palette}, hue ${index}: ${one} and ${half} differ by ${differs.toFixed(1)}`);
      }
      check(distance(seen(0.005), grounds[theme]) < 12, `${theme}, ${palette}, hue ${index}: 0.005 glows: ${distance(seen(0.005), grounds[theme]).toFixed(1)}`);
      // The server's scale is half of the law's maximum: the same value has the same colour.
      check(lutOf(palette, hue, theme, 0.5)[254] === lut[127], `${theme}, ${palette}: the colour depends on the server's scale`);
    }
  }
}
console.log(`halves differ by ${least.toFixed(1)} or more (CIE 1976)`);

// ---- lines and discs of single nodes ----

const SIDE = 48;
const FACTOR = 6;
const LUT = Uint32Array.from({length: 256}, (_, level) => (level === 0 || level === 255 ? 0 : (0xFF000000 | level) >>> 0));   // red tells the level
function painted(nodes) {
  const levels = new Uint8Array(SIDE * SIDE);
  for (const [x, y, level] of nodes) levels[y * SIDE + x] = level;
  const pixels = new Uint32Array((SIDE * FACTOR) ** 2);
  paint(pixels, levels, SIDE, SIDE, {first: 0, last: SIDE, bottom: 0, top: SIDE}, FACTOR, LUT);
  /** Level and opacity at a place, where nodes have whole numbers. */
  return (x, y) => {
    const [level, , , alpha] = channels(pixels[(SIDE * FACTOR - 1 - Math.floor((y + 0.5) * FACTOR)) * SIDE * FACTOR + Math.floor((x + 0.5) * FACTOR)]);
    return {level, alpha};
  };
}

for (const weights of weightsOf(4)) check(Math.abs(weights.reduce((a, b) => a + b) - 1) < 1e-12, 'weights do not add up to 1');
check(factorOf(2) === 1 && factorOf(7.5) === 4 && factorOf(1000) === 8, 'pixels a cell');

let worst = 0;
for (const degrees of [0, 6, 12, 20, 27, 35, 45, 63, 90]) {
  const [dx, dy] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  const nodes = new Map();
  for (let t = -20; t <= 20; t += 0.05) nodes.set(`${Math.round(23 + t * dx)},${Math.round(23 + t * dy)}`, [Math.round(23 + t * dx), Math.round(23 + t * dy), 200]);
  const at = painted([...nodes.values()]);
  const sides = [[], []];   // how far from the line half of the opacity is, to the left and right
  for (let t = -13; t <= 13; t += 0.1) {
    const {level, alpha} = at(23 + t * dx, 23 + t * dy);
    check(level === 200, `a line at ${degrees} degrees has level ${level} for 200`);
    check(alpha > 0.5, `a line at ${degrees} degrees has a gap: opacity ${alpha.toFixed(2)}`);
    sides.forEach((side, i) => {
      const sign = i ? -1 : 1;
      let off = 0;
      while (at(23 + t * dx - sign * off * dy, 23 + t * dy + sign * off * dx).alpha > 0.5) off += 0.05;
      side.push(off);
    });
  }
  // A staircase of nodes is off by up to a cell between two steps.
  for (const side of sides) {
    const off = Math.max(...side) - Math.min(...side);
    worst = Math.max(worst, off);
    check(off < 0.5, `a line at ${degrees} degrees is off by ${off.toFixed(2)} cells`);
  }
  const wide = sides[0].map((it, i) => it + sides[1][i]);
  check(Math.max(...wide) < 2.2 && Math.min(...wide) > 1, `a line at ${degrees} degrees is ${Math.min(...wide).toFixed(2)} to ${Math.max(...wide).toFixed(2)} cells wide`);
}
console.log(`the edges of lines are off by ${worst.toFixed(2)} cells at most`);

const disc = painted([[11, 11, 100], [10, 11, 100], [12, 11, 100], [11, 10, 100], [11, 12, 100]]);
const radii = Array.from({length: 16}, (_, i) => {
  const [dx, dy] = [Math.cos((i * Math.PI) / 8), Math.sin((i * Math.PI) / 8)];
  let r = 0;
  while (disc(11 + r * dx, 11 + r * dy).alpha > 0.5) r += 0.02;
  return r;
});
check(Math.max(...radii) / Math.min(...radii) < 1.25, `five nodes are a cross: radii ${radii.map((it) => it.toFixed(2))}`);
const plain = painted(Array.from({length: SIDE * SIDE}, (_, i) => [i % SIDE, Math.floor(i / SIDE), i % SIDE < 24 ? 254 : 127]));
check(plain(15, 11).level === 254 && plain(34, 11).level === 127, 'an even level is not shown as it is');
check(painted([[5, 5, 255]])(5, 5).alpha === 0, 'what is blocked is painted');

// ---- the antennas' scale: P in the middle of a straight line of full nodes ----

const law = {type: 1, profile: 'z-shape', core_m: 0.1, sigma_m: 0.4, reach_m: 0.5, maximum: 1, weight: 1, directional: true};
const laws = new Map([['a', law]]);
const near = (a, b) => Math.abs(a - b) < 1e-9;
check(near(fullLine(law, laws, 0.1), 1 + 1 + 0.75 + 0.5 + 0.25), `ahead: ${fullLine(law, laws, 0.1)}`);
check(near(fullLine({...law, directional: false, weight: -2, maximum: 3}, laws, 0.1), 6 * (1 + 2 * 2.5)), 'all round, repellent');
check(near(fullLine({...law, profile: 'gaussian', sigma_m: 0.2, reach_m: 0.25}, laws, 0.2), 1 + Math.exp(-0.5)), 'Gaussian');
check(near(fullLine({type: 3, blend: [{type: 1, weight: -0.5}]}, laws, 0.1), 1.75), 'blend');

if (failures) process.exit(1);
console.log('ok');
