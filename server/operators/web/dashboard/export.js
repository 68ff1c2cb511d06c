// What the map shows, as files: a picture; a figure with axes and scales, to be edited further or put
// into a paper; tables of the robots, and of the levels of the nodes that are in view. Of the present,
// of a moment of the time line or of a recording, whichever is shown. And MCAP, for Foxglove: from one
// press of its button to the next.
import {store} from './store.js';
import {bytes, number} from './format.js';
import {poseNow, stateOf} from './robots.js';
import {ticksOf} from './map.js';
import {McapFile} from './mcap.js';
import {FONT} from './places.js';
import {dataUrl, h, setText, toast} from './dom.js';

const MARGIN = {left: 52, top: 16, right: 16, bottom: 46};
const SCALE_PX = 120;
const FIGURE_PX = 640;
const MOST_BYTES = 256 << 20;   // of an MCAP file, which is in the page's memory until it is saved

const shownAt = () => new Date(store.past?.at ?? Date.now());

function save(blob, name) {
  const url = URL.createObjectURL(blob);
  h('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

const stamp = () => shownAt().toISOString().slice(0, 19).replaceAll(':', '-');
const visibleLayers = () => [...store.layers.values()].filter((it) => it.visible && it.levels);
const unitText = (layer) => `${layer.name}${layer.repels ? ' (repels)' : layer.isBlend ? ' (blend)' : ''}, units`;

/** Whether a topic of the stream is of what is shown. */
function isShown(topic) {
  if (topic.startsWith('/pheromone/')) return Boolean(store.layers.get(topic.slice('/pheromone/'.length))?.isNeeded);
  const of = {'/robots': 'robots', '/clients': 'robots', '/tf': 'robots', '/trails': 'trails', '/paths': 'paths', '/tags': 'tags', '/goals': 'goals'};
  return topic in of ? store.shows[of[topic]] : topic === '/obstacles' || topic === '/events';
}

/** The button that begins and ends an MCAP file. */
export class McapButton {
  constructor(stream) {
    this.stream = stream;
    this.file = null;
    this.element = h('button', {type: 'button', 'data-export': 'mcap', title: 'What is shown, from now until this is pressed again, for Foxglove', onclick: () => this.press()}, 'MCAP');
    setInterval(() => this.show(), 500);
  }

  press() {
    if (this.file) this.end();
    else if (store.past) toast('Not saved: the time line shows the past: "Go live" first', true);
    else this.begin();
  }

  begin() {
    this.file = new McapFile();
    this.stream.record(isShown, (channel, time, payload) => {
      this.file.add(channel, time, payload);
      if (this.file.bytes > MOST_BYTES) {
        this.end();
        toast(`MCAP: ended at ${bytes(MOST_BYTES)}; longer recordings: "Record" below, then pheromonectl export --mcap`, true);
      }
    });
    this.show();
  }

  /** Saves what there is. */
  end() {
    if (!this.file) return;
    const {file} = this;
    this.file = null;
    this.stream.record(null);
    if (file.count > 0) save(file.end(), `map-${stamp()}.mcap`);
    else toast('Not saved: nothing came from the server', true);
    this.show();
  }

  show() {
    setText(this.element, this.file ? `Save ${bytes(this.file.bytes + this.file.chunk.bytes)}` : 'MCAP');
    this.element.setAttribute('aria-pressed', String(Boolean(this.file)));
  }
}

/** The buttons. `map`: the SwarmMap, `layers`: who draws ramps, `mcap`: the McapButton. */
export function exportButtons(map, layers, mcap) {
  const act = (name, title, go) => h('button', {type: 'button', 'data-export': name.toLowerCase().replace(' ', '-'), title, onclick: async () => {
    try {
      await go();
    } catch (error) {
      toast(`Not saved: ${error.message}`, true);
    }
  }}, name);
  return h('div', {class: 'exports'}, h('span', {}, 'Save'),
    act('PNG', 'The map as it is shown, with its scales', async () => save(await picture(map, layers), `map-${stamp()}.png`)),
    act('SVG', 'A figure of what is in view, with axes and scales', async () => save(new Blob([await figure(map, layers)], {type: 'image/svg+xml'}), `map-${stamp()}.svg`)),
    act('Robots CSV', 'A row for each robot: pose, state, what it senses', () => save(new Blob([robotsTable()], {type: 'text/csv'}), `robots-${stamp()}.csv`)),
    act('Levels CSV', 'A row for each node in view that has something', () => save(new Blob([levelsTable(map)], {type: 'text/csv'}), `levels-${stamp()}.csv`)), mcap.element);
}

const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const rows = (all) => all.map((row) => row.map((it) => (it === null || it === undefined ? '' : quote(String(it)))).join(',')).join('\n') + '\n';

function robotsTable() {
  const names = [...store.laws.keys()];
  const table = [['utc', 'link', 'id', 'x_m', 'y_m', 'heading_deg', 'state', 'follows', ...names.flatMap((it) => [`${it}_left`, `${it}_right`])]];
  for (const robot of store.shownRobots.values()) {
    const {pose, antennas} = robot;
    table.push([shownAt().toISOString(), robot.link, robot.id, pose?.x_m, pose?.y_m, pose?.heading_deg, stateOf(robot), robot.follows,
                ...names.flatMap((it) => [antennas?.pheromones?.[it]?.left, antennas?.pheromones?.[it]?.right])]);
  }
  return rows(table);
}

function levelsTable(map) {
  const table = [['pheromone', 'x_m', 'y_m', 'units']];
  for (const layer of visibleLayers()) {
    const cells = map.cellsOnScreen(layer);
    if (!cells) continue;
    for (let row = cells.bottom; row < cells.top; row += 1) {
      for (let column = cells.first; column < cells.last; column += 1) {
        const x = layer.xM + (column + 0.5) * layer.cellM;
        const y = layer.yM + (row + 0.5) * layer.cellM;
        const value = layer.valueAt(x, y);
        if (value) table.push([layer.name, Number(x.toFixed(4)), Number(y.toFixed(4)), Number(value.toPrecision(4))]);
      }
    }
  }
  return rows(table);
}

/** The canvases on each other, and the scales below them. */
async function picture(map, layers) {
  const {base, top} = map.canvases;
  const ratio = base.width / map.view.width;
  const scales = visibleLayers();
  const foot = scales.length ? 44 : 0;
  const canvas = new OffscreenCanvas(base.width, base.height + Math.round(foot * ratio));
  const context = canvas.getContext('2d');
  context.fillStyle = map.theme.ground;
  context.fillRect(0, 0, canvas.width, canvas.height);
  for (const it of [base, map.trails.element, top]) context.drawImage(it, 0, 0, base.width, base.height);
  context.setTransform(ratio, 0, 0, ratio, 0, map.view.height * ratio);
  context.font = `11px ${FONT}`;
  context.fillStyle = map.theme.ink;
  let x = 12;
  for (const layer of scales) {
    const [low, high] = layer.ends;
    context.drawImage(layers.ramp(layer), x, 20, SCALE_PX, 8);
    context.fillText(unitText(layer), x, 14);
    context.fillText(number(low), x, 40);
    context.textAlign = 'right';
    context.fillText(number(high), x + SCALE_PX, 40);
    context.textAlign = 'left';
    x += SCALE_PX + 30;
  }
  return canvas.convertToBlob({type: 'image/png'});
}

/** With the colours of the light theme, whatever the page's. */
function asOnPaper(draw) {
  const layers = [...store.layers.values()];
  const {theme} = document.documentElement.dataset;
  for (const it of layers) it.setTheme('light');
  const drawn = draw();
  for (const it of layers) it.setTheme(theme);
  return drawn;
}

function onWhite(image) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext('2d');
  context.fillStyle = '#fff';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0);
  return canvas;
}

const escaped = (text) => String(text).replace(/[&<>"]/g, (it) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'}[it]));

/** SVG: what is in view of the map, in black on white; pheromones as pictures, all else as shapes. */
async function figure(map, layers) {
  const {view} = map;
  const {origin_m: [x0, y0], width_m: width, height_m: height} = store.map;
  const left = Math.max(x0, view.x - view.width / 2 / view.scale);
  const right = Math.min(x0 + width, view.x + view.width / 2 / view.scale);
  const low = Math.max(y0, view.y - view.height / 2 / view.scale);
  const high = Math.min(y0 + height, view.y + view.height / 2 / view.scale);
  if (right <= left || high <= low) throw new Error('nothing of the map is in view');
  const scale = FIGURE_PX / (right - left);
  const w = FIGURE_PX;
  const scales = visibleLayers();
  const {field, ramps} = asOnPaper(() => ({field: map.fieldOf(left, right, low, high, 2 * scale), ramps: scales.map((it) => onWhite(layers.ramp(it)))}));
  const t = (high - low) * scale;
  const sx = (x) => ((x - left) * scale).toFixed(2);
  const sy = (y) => ((high - y) * scale).toFixed(2);
  const out = [];
  const text = (x, y, what, more = '') => out.push(`<text x="${x}" y="${y}" ${more}>${escaped(what)}</text>`);
  const line = (points, more) => out.push(`<polyline points="${points.map(([x, y]) => `${sx(x)},${sy(y)}`).join(' ')}" fill="none" ${more}/>`);

  out.push(`<clipPath id="map"><rect width="${w}" height="${t.toFixed(2)}"/></clipPath><g clip-path="url(#map)">`);
  out.push(`<image href="${await dataUrl(await field.convertToBlob())}" width="${w}" height="${t.toFixed(2)}" preserveAspectRatio="none"/>`);
  if (store.shows.paths) for (const {closed, points_m: points} of store.paths) line(closed ? [...points, points[0]] : points, 'stroke="#333" stroke-dasharray="7 4"');
  if (store.shows.trails && !store.past) {
    for (const trail of store.trails.values()) {
      const {points} = trail;
      line(Array.from({length: points.length / 2}, (_, i) => [points[2 * i], points[2 * i + 1]]), 'stroke="#666" stroke-width="1.2"');
    }
  }
  if (store.shows.tags) {
    for (const tag of store.tags) {
      if (tag.x_m === null || tag.x_m === undefined) continue;
      out.push(`<circle cx="${sx(tag.x_m)}" cy="${sy(tag.y_m)}" r="${(tag.range_m * scale).toFixed(2)}" fill="none" stroke="#888" stroke-dasharray="2 4"/>`,
               `<rect x="${sx(tag.x_m) - 5}" y="${sy(tag.y_m) - 5}" width="10" height="10" fill="#fff" stroke="#333"/>`);
      text(Number(sx(tag.x_m)) + 9, Number(sy(tag.y_m)) + 4, tag.name);
    }
  }
  if (store.shows.robots) {
    for (const robot of store.shownRobots.values()) {
      if (!robot.pose) continue;
      const {x_m: x, y_m: y, heading_deg: heading} = poseNow(robot, performance.now());
      out.push(`<path d="M11 0L-8 7.6L-4.3 0L-8 -7.6Z" transform="translate(${sx(x)} ${sy(y)}) rotate(${-heading})" fill="#111" stroke="#fff"/>`);
      text(Number(sx(x)) + 10, Number(sy(y)) - 9, `${robot.id}`);
    }
  }
  out.push('</g>', `<rect width="${w}" height="${t.toFixed(2)}" fill="none" stroke="#333"/>`);

  for (const [x, label] of ticksOf(left, right, scale)) {
    out.push(`<path d="M${sx(x)} ${t.toFixed(2)}v5" stroke="#333"/>`);
    text(sx(x), (t + 17).toFixed(2), label, 'text-anchor="middle"');
  }
  for (const [y, label] of ticksOf(low, high, scale)) {
    out.push(`<path d="M0 ${sy(y)}h-5" stroke="#333"/>`);
    text(-9, Number(sy(y)) + 4, label, 'text-anchor="end"');
  }
  text(w / 2, (t + 34).toFixed(2), 'x in m', 'text-anchor="middle"');
  text(0, 0, 'y in m', `text-anchor="middle" transform="translate(-38 ${(t / 2).toFixed(2)}) rotate(-90)"`);

  const top = t + MARGIN.bottom + 8;
  for (const [i, layer] of scales.entries()) {
    const x = (i % 4) * (SCALE_PX + 40);
    const y = top + Math.floor(i / 4) * 46;
    out.push(`<image href="${await dataUrl(await ramps[i].convertToBlob())}" x="${x}" y="${y + 6}" width="${SCALE_PX}" height="9" preserveAspectRatio="none"/>`);
    text(x, y, unitText(layer));
    text(x, y + 27, number(layer.ends[0]));
    text(x + SCALE_PX, y + 27, number(layer.ends[1]), 'text-anchor="end"');
  }
  const full = [w + MARGIN.left + MARGIN.right, top + Math.ceil(scales.length / 4) * 46 + MARGIN.top];
  return `<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="${full[0]}" height="${full[1].toFixed(0)}" viewBox="0 0 ${full[0]} ${full[1].toFixed(0)}" font-family='${FONT}' font-size="12" fill="#111">
<title>${escaped(`The map on ${shownAt().toISOString()}`)}</title>
<rect width="100%" height="100%" fill="#fff"/>
<g transform="translate(${MARGIN.left} ${MARGIN.top})">
${out.join('\n')}
</g>
</svg>
`;
}
