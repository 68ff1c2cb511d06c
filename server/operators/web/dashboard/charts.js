// Links and the engine over the last ten minutes, and one robot over the last two: what the pointer is
// on is told beside the title, and now otherwise.
import {store} from './store.js';
import {h} from './dom.js';
import {hueOf, css} from './palettes.js';
import {FONT} from './places.js';
import {pheromoneOf} from './robots.js';
import {ago, bytes, percent, number} from './format.js';

const POINTS = 600;   // one a second
const SPANS = [60, 120, 300];
const MOST_LINES = 6; // more could not be told apart
const DASHES = [[], [6, 3], [2, 3], [8, 3, 2, 3], [12, 4], [4, 6]];   // nothing is told by colour alone
const ROBOT_SPAN_S = 120;

class Chart {
  /** The axis reaches `least`, at least: what is nearly nothing is to look like it. */
  constructor(dock, title, format, least, heading = 'h2') {
    this.at = null;   // the number of the moment that the pointer is on
    this.format = format;
    this.least = least;
    this.heading = h(heading, {}, title);
    this.holder = h('div', {class: 'chart'});
    this.element = h('div', {}, this.heading, this.holder);
    this.title = title;
    dock.append(this.element);
    this.names = [];
    this.times = [];
    this.values = new Map();
    new ResizeObserver(() => this.resize()).observe(this.holder);
  }

  /** Another quantity: what was shown goes. */
  become(title, format, least) {
    if (this.title === title) return;
    Object.assign(this, {title, format, least, times: [], values: new Map()});
    this.plot?.destroy();
    this.plot = null;
  }

  /** One value for each name, in this second; null: none. */
  add(timeS, values) {
    for (const name of Object.keys(values)) {
      if (!this.values.has(name) && this.values.size < MOST_LINES) this.values.set(name, this.times.map(() => null));
    }
    this.times.push(timeS);
    for (const [name, list] of this.values) list.push(values[name] ?? null);
    if (this.times.length > POINTS) {
      this.times.shift();
      for (const list of this.values.values()) list.shift();
    }
    this.draw();
  }

  /** All at once. */
  set(title, times, values, isOther) {
    if (isOther) {
      this.plot?.destroy();
      this.plot = null;
    }
    Object.assign(this, {title, times, values: new Map(values)});
    if (this.at !== null) this.at = Math.min(this.at, times.length - 1);
    this.draw();
  }

  /** Seconds shown: as much as there is, in a few steps. */
  get span() {
    const have = this.times.length ? this.times.at(-1) - this.times[0] : 0;
    return SPANS.find((it) => it >= have) ?? POINTS;
  }

  get data() { return [this.times, ...this.values.values()]; }

  draw() {
    if (this.holder.clientWidth < 40 || this.values.size === 0) return;
    if (!this.plot || this.names.length !== this.values.size) this.make();
    else this.plot.setData(this.data);
    this.showValues();
  }

  showValues() {
    const now = [...this.values].map(([name, list]) => [name, list.at(this.at ?? -1) ?? null]);
    const when = this.at === null ? [] : [h('span', {class: 'at'}, `−${ago(this.times.at(-1) - this.times[this.at])}`)];
    this.heading.replaceChildren(this.title, ...when, ...now.map(([name, value], i) => {
      const swatch = h('span', {class: 'swatch'}, now.length > 1 ? `${name} ${this.format(value)}` : this.format(value));
      swatch.classList.toggle('dashed', i > 0);
      swatch.style.setProperty('--c', this.colour(i));
      return swatch;
    }));
  }

  colour(i) {
    return css(hueOf(i, document.documentElement.dataset.theme === 'dark' ? 'dark' : 'light'));
  }

  make() {
    this.plot?.destroy();
    this.names = [...this.values.keys()];
    this.at = null;
    const style = getComputedStyle(document.documentElement);
    const tiny = parseInt(style.getPropertyValue('--tiny'), 10);
    const axis = {
      stroke: style.getPropertyValue('--ink-3').trim(),
      grid: {stroke: style.getPropertyValue('--line-soft').trim(), width: 1},
      ticks: {show: false},
      font: `${tiny}px ${FONT}`,
    };
    this.plot = new uPlot({
      width: this.holder.clientWidth, height: Math.max(40, this.holder.clientHeight),
      padding: [6, 8, 0, 0], legend: {show: false}, cursor: {y: false, drag: {x: false, y: false}, points: {size: 6}},
      hooks: {setCursor: [(plot) => { this.at = plot.cursor.left >= 0 ? plot.cursor.idx : null; this.showValues(); }]},
      scales: {x: {time: false, range: (_, __, max) => [max - this.span, max]}, y: {range: (_, min, max) => [Math.min(0, min ?? 0), Math.max((max ?? 0) * 1.15, this.least)]}},
      axes: [
        {...axis, size: 8 + tiny, gap: 2, values: (plot, at) => at.map((it) => ago(plot.scales.x.max - it)).map((it) => `−${it}`),
         splits: (plot) => (this.holder.clientWidth > 300 ? [0.8, 0.6, 0.4, 0.2] : [0.8, 0.4]).map((it) => plot.scales.x.max - it * this.span)},
        {...axis, size: 4.6 * tiny, gap: 3, space: 26, values: (_, at) => at.map((it) => this.format(it))},
      ],
      series: [{}, ...this.names.map((label, i) => ({label, stroke: this.colour(i), width: 1.5, dash: DASHES[i], points: {show: false}, spanGaps: false}))],
    }, this.data, this.holder);
  }

  themeChanged() {
    if (!this.plot) return;
    this.make();
    this.draw();
  }

  resize() {
    if (this.plot && this.holder.clientWidth >= 40) {
      this.plot.setSize({width: this.holder.clientWidth, height: Math.max(40, this.holder.clientHeight)});
    } else {
      this.draw();
    }
  }
}

export class Charts {
  constructor(dock) {
    this.latency = new Chart(dock, 'Answer time', (ms) => (ms === null ? '–' : ms >= 1 ? `${number(ms)} ms` : `${number(ms * 1000)} µs`), 0.1);
    this.errors = new Chart(dock, 'Errors a second', (n) => (n === null ? '–' : number(n)), 1);
    this.traffic = new Chart(dock, 'Channel in use', percent, 0.1);
    this.lastErrors = new Map();
    this.wereUp = new Set();   // links: of what was never there, nothing is shown
  }

  /** Once a second, while the stream is live. */
  tick(nowMs, hasLatency = true) {
    const timeS = nowMs / 1000;
    for (const link of store.links.values()) if (link.up) this.wereUp.add(link.name);
    const links = [...store.links.values()].filter((it) => this.wereUp.has(it.name));
    // Only of a channel with a rate is a share known; bytes are known of all.
    const shares = links.every((it) => it.utilisation !== null);
    if (links.length > 0) this.traffic.become(...(shares ? ['Channel in use', percent, 0.1] : ['Bytes a second', (n) => (n === null ? '–' : bytes(n)), 100]));
    const traffic = {};
    const errors = {};
    for (const link of links) {
      traffic[link.name] = !link.up ? null : shares ? link.utilisation : link.bytes_per_s;
      const sum = link.errors;
      const last = this.lastErrors.get(link.name);
      const elapsed = last ? timeS - last.timeS : 0;
      errors[link.name] = elapsed > 0.2 && sum >= last.sum ? (sum - last.sum) / elapsed : null;
      this.lastErrors.set(link.name, {timeS, sum});
    }
    if (links.length > 0) {
      this.traffic.add(timeS, traffic);
      this.errors.add(timeS, errors);
    }
    const latency = hasLatency && latencyOf(store.engine);
    if (latency) this.latency.add(timeS, latency);
  }

  /** What was shown goes: another time begins. */
  clear() {
    this.lastErrors.clear();
    this.wereUp.clear();
    for (const chart of [this.latency, this.errors, this.traffic]) {
      chart.times = [];
      chart.values = new Map();
      chart.plot?.destroy();
      chart.plot = null;
      chart.heading.replaceChildren(chart.title);
    }
  }

  themeChanged() {
    for (const chart of [this.latency, this.errors, this.traffic]) chart.themeChanged();
  }
}

/** Milliseconds of the engine's statistics. */
function latencyOf(engine) {
  const found = engine?.latency_us;
  if (!found) return null;
  return Object.fromEntries(['p50', 'p99'].map((it) => [it, typeof found[it] === 'number' ? found[it] / 1000 : null]));
}

/** How far a point is from the nearest of the configured paths (GET /api/v1/paths). */
export function distanceFrom(paths, {x_m: x, y_m: y}) {
  let least = Infinity;
  for (const {closed, points_m: points} of paths) {
    for (let i = closed ? 0 : 1; i < points.length; i += 1) {
      const [[ax, ay], [bx, by]] = [points.at(i - 1), points[i]];
      const square = (bx - ax) ** 2 + (by - ay) ** 2;
      const t = square > 0 ? Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / square)) : 0;
      least = Math.min(least, Math.hypot(ax + t * (bx - ax) - x, ay + t * (by - ay) - y));
    }
  }
  return least;
}

/**
 * One robot: what its antennas sense, how fast it is, and how far from the path of the pheromone that
 * it follows, if that has one; from what the page remembers (history.js).
 */
export class RobotCharts {
  constructor(holder) {
    this.sensed = new Chart(holder, 'Senses', (x) => (x === null ? '–' : number(x)), 0.1, 'h4');
    this.speed = new Chart(holder, 'Speed', (x) => (x === null ? '–' : `${number(x)} m/s`), 0.1, 'h4');
    this.away = new Chart(holder, 'From the path', (x) => (x === null ? '–' : `${number(x)} m`), 0.1, 'h4');
    this.key = '';
  }

  show(robot, moments) {
    const pheromone = pheromoneOf(robot);
    const key = `${robot.key} ${pheromone}`;
    const from = (store.past?.at ?? Date.now()) - ROBOT_SPAN_S * 1000;
    const seen = moments.filter((it) => it.at >= from && (!store.past || it.at <= store.past.at) && it.robots.has(robot.key));
    const times = seen.map((it) => it.at / 1000);
    const side = (name) => seen.map((it) => it.robots.get(robot.key).antennas?.pheromones?.[pheromone]?.[name] ?? null);
    const speed = seen.map((it, i) => {
      const [a, b] = [seen[i - 1]?.robots.get(robot.key).pose, it.robots.get(robot.key).pose];
      return a && b ? Math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) / (times[i] - times[i - 1]) : null;
    });
    this.sensed.set(pheromone ? `Senses ${pheromone}` : 'Senses', times, [['P_L', side('left')], ['P_R', side('right')]], key !== this.key);
    this.speed.set('Speed', times, [['speed', speed]], key !== this.key);
    const paths = store.paths.filter((it) => it.pheromone === pheromone);
    this.away.element.hidden = paths.length === 0;
    if (paths.length) {
      const away = seen.map((it) => it.robots.get(robot.key).pose).map((it) => (it ? distanceFrom(paths, it) : null));
      this.away.set('From the path', times, [['distance', away]], key !== this.key);
    }
    this.key = key;
  }

  themeChanged() {
    this.sensed.themeChanged();
    this.speed.themeChanged();
    this.away.themeChanged();
  }
}
