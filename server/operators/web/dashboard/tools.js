// The tools of the map: look, measure, path, brush, eraser, and "go here" for the selected robots. All that
// change something need the token and the present, and say so while one of them is missing: who sees
// the past must not change what is not seen.
import {api} from './api.js';
import {store} from './store.js';
import {byId, h, icon, toast} from './dom.js';
import {clock, metres, number} from './format.js';
import {commands} from './commands.js';
import {robotAt, robotsIn} from './robots.js';
import {fontOf, tagAt, tagKey, write} from './places.js';

const SEND_EVERY_MS = 150;
const MOST_POINTS = 1000;   // the server takes 1024
const CLICK_PX = 4;         // less is not a rectangle

const REVERSALS = {
  undo: {title: 'Undo the last edit of the map (Ctrl+Z)', done: 'Undid', icon: ['M9 14L4 9l5-5', 'M4 9h10a6 6 0 0 1 0 12h-3']},
  redo: {title: 'Redo the edit undone last (Ctrl+Shift+Z)', done: 'Redid', icon: ['M15 14l5-5-5-5', 'M20 9H10a6 6 0 0 0 0 12h3']},
};

const TOOLS = [
  {name: 'look', key: 'v', title: 'Move the map, select robots and tags; Shift: several robots (V)',
   icon: ['M5 3l14 8-6 1.8L10 19z']},
  {name: 'measure', key: 'm', title: 'Measure distances (M)',
   icon: ['M3.5 15.5L15.5 3.5l5 5-12 12z', 'M7 12l2 2', 'M10 9l2.5 2.5', 'M13 6l2 2']},
  {name: 'path', key: 'p', title: 'Draw a path (P)', changes: true,
   icon: ['M4 18c6 0 3-11 9-11h3', 'M18.5 7a2 2 0 1 0-.01 0', 'M4 20.5a2 2 0 1 0-.01-4']},
  {name: 'brush', key: 'b', title: 'Paint pheromone (B)', changes: true,
   icon: ['M20 4L10 14', 'M9.5 13.5c-3 0-4 2-4 4 0 1.5-1 2-2 2 4 1.5 8 .5 8-3 0-1.5-.8-2.5-2-3z']},
  {name: 'eraser', key: 'e', title: 'Erase pheromone (E)', changes: true,
   icon: ['M4.5 15.5l9-9 6 6-7 7h-4z', 'M9 11l6 6', 'M12 19.5h8']},
];

export class Tools {
  constructor(map) {
    this.map = map;
    this.settings = {radius: 0.15, share: 1};
    this.points = [];    // of the path
    this.strokes = [];   // of brush and eraser, until they are sent
    this.hover = null;
    this.band = null;    // {from, to}: a rectangle that selects robots
    this.buttons = new Map();
    for (const tool of TOOLS) {
      const button = h('button', {type: 'button', 'aria-label': tool.title, 'data-tool': tool.name,
                                  onclick: () => this.choose(tool.name)}, icon(...tool.icon));
      this.buttons.set(tool.name, button);
      byId('tools').append(button);
    }
    this.reversals = Object.entries(REVERSALS).map(([request, {title, icon: paths}]) =>
      h('button', {type: 'button', id: request, title, 'aria-label': title, onclick: () => this.reverse(request)}, icon(...paths)));
    byId('tools').append(...this.reversals);
    map.overlay = (context, view, theme) => this.draw(context, view, theme);
    store.on('laws', () => this.showOptions());
    store.on('past', () => this.tokenChanged());
    this.tokenChanged();
    this.choose('look');
  }

  /** Why nothing can be changed now; empty: it can. */
  get refusal() { return api.refusal || (store.past ? 'not while the time line shows the past: "Go live" first' : ''); }

  tokenChanged() {
    const {refusal} = this;
    for (const tool of TOOLS) {
      const button = this.buttons.get(tool.name);
      button.disabled = Boolean(tool.changes) && refusal !== '';
      button.title = button.disabled ? `${tool.title} – ${refusal}` : tool.title;
    }
    for (const button of this.reversals) {
      button.disabled = refusal !== '';
      button.title = REVERSALS[button.id].title + (button.disabled ? ` – ${refusal}` : '');
    }
    const needs = this.current === 'goto' || TOOLS.some((it) => it.changes && it.name === this.current);
    if (refusal && needs) this.choose('look');
  }

  choose(name) {
    if (this.buttons.get(name)?.disabled) {
      toast(this.buttons.get(name).title.replace(/ \(.\)/, ''), true);
      return;
    }
    this.cancel();
    this.current = name;
    this.map.stage.dataset.tool = name;
    for (const [it, button] of this.buttons) button.setAttribute('aria-pressed', String(it === name));
    this.map.view.tool = this[name]();
    this.map.view.cursor();
    this.showOptions();
    this.map.invalidate('top');
  }

  keydown(key) {
    const tool = TOOLS.find((it) => it.key === key);
    if (tool) { this.choose(tool.name); return true; }
    if (this.current === 'path' && key === 'enter') { this.finishPath(); return true; }
    if ((this.current === 'path' || this.current === 'measure') && key === 'backspace') {
      this.points.pop();
      this.showOptions();
      this.map.invalidate('top');
      return true;
    }
    if (key === 'escape') {
      if (this.current !== 'look') this.choose('look');
      else store.select(null);
      return true;
    }
    if (key === '[' || key === ']') {
      this.settings.radius = Math.min(2, Math.max(0.02, this.settings.radius * (key === ']' ? 1.25 : 0.8)));
      this.showOptions();
      this.map.invalidate('top');
      return true;
    }
    return false;
  }

  // What is under the cursor, with the values of the shown layers.
  readout(point) {
    const line = byId('readout');
    if (!point) { line.textContent = ''; return; }
    const values = [...store.layers.values()].filter((it) => it.visible)
      .map((it) => [it.name, it.valueAt(point.x, point.y)]).filter(([, value]) => value);
    line.textContent = [`${metres(point.x)}, ${metres(point.y)}`,
                        ...values.map(([name, value]) => `${name} ${number(value)}`)].join('   ');
  }

  hovers(point) {
    this.hover = point;
    this.readout(point);
    if (this.current !== 'look') this.map.invalidate('top');
  }

  look() {
    return {
      hover: (point) => {
        this.hovers(point);
        this.map.view.cursor(point && (robotAt(this.map.view, point) || tagAt(this.map.view, point)));
      },
      click: (point, {shiftKey, ctrlKey, metaKey}) => {
        const robot = robotAt(this.map.view, point);
        if (shiftKey || ctrlKey || metaKey) {
          if (robot) store.toggleRobot(robot.key);
          return;
        }
        const tag = robot ? null : tagAt(this.map.view, point);
        store.select(robot ? {kind: 'robot', key: robot.key} : tag ? {kind: 'tag', key: tagKey(tag)} : null);
      },
      // With Shift, a rectangle; otherwise the map is moved.
      drags: (event) => event.shiftKey,
      down: (point) => { this.band = {from: point, to: point}; },
      move: (point) => {
        if (!this.band) return;   // the tool was chosen anew meanwhile
        this.band.to = point;
        this.map.invalidate('top');
      },
      up: (point, event) => {
        if (!this.band) return;
        const {from} = this.band;
        this.band = null;
        const {scale} = this.map.view;
        if (Math.hypot(point.x - from.x, point.y - from.y) * scale > CLICK_PX) store.selectRobots([...new Set([...store.group, ...robotsIn(from, point)])]);
        else this.map.view.tool.click(point, event);
        this.map.invalidate('top');
      },
      cancel: () => {
        this.band = null;
        this.map.invalidate('top');
      },
    };
  }

  measure() {
    return {
      cursor: 'draw',
      hover: (point) => {
        this.hovers(point);
        this.showOptions();
      },
      click: (point) => {
        if (this.points.length < MOST_POINTS) this.points.push(point);
        this.showOptions();
        this.map.invalidate('top');
      },
      double: () => {
        this.points = [];
        this.showOptions();
      },
    };
  }

  path() {
    return {
      cursor: 'draw',
      hover: (point) => this.hovers(point),
      click: (point) => {
        if (this.points.length < MOST_POINTS) this.points.push(point);
        this.showOptions();
        this.map.invalidate('top');
      },
      double: () => {
        this.points.pop();   // the second click of the two
        this.finishPath();
      },
    };
  }

  /** Of the pheromone that the tools change: the one that was chosen, or the first. */
  get law() { return store.paintable.find((it) => it.name === store.tool) ?? store.paintable[0]; }

  /** Of a path without a mouse: "1, 2; 3.5, 2". */
  addPoints(text) {
    const numbers = (text.match(/[-−]?\d+(\.\d+)?/g) ?? []).map((it) => Number(it.replace('−', '-')));
    if (numbers.length === 0 || numbers.length % 2 !== 0) {
      toast(`Found ${numbers.length} numbers, expected x, y of each point, in metres: 1, 2; 3.5, 2`, true);
      return;
    }
    for (let i = 0; i < numbers.length; i += 2) this.points.push({x: numbers[i], y: numbers[i + 1]});
    this.points.length = Math.min(this.points.length, MOST_POINTS);
    this.showOptions();
    byId('path-points').focus();
    this.map.invalidate('top');
  }

  async finishPath() {
    const points = this.points;
    if (points.length < 2) { toast('A path has at least two points', true); return; }
    const {law} = this;
    if (!law) { toast('Choose a pheromone first', true); return; }
    this.points = [];
    this.map.invalidate('top');
    const paint = await this.send({request: 'paint', law, settings: this.settings}, points);
    if (paint) toast(`Path of ${points.length} points: ${changeOf(law, paint.changed, isLost(paint))}`);
    this.showOptions();
  }

  stroke(request) {
    const last = () => this.strokes.at(-1);
    return {
      cursor: 'draw',
      hover: (point) => this.hovers(point),
      down: (point) => {
        const {law} = this;
        if (!law) { toast('Choose a pheromone first', true); return; }
        this.strokes.push({request, law, settings: {...this.settings}, points: [point], done: 0, open: true, changed: 0});
        this.map.invalidate('top');
      },
      move: (point) => {
        this.hovers(point);
        if (!last()?.open) return;
        const before = last().points.at(-1);
        if (Math.hypot(point.x - before.x, point.y - before.y) * this.map.view.scale > 3) last().points.push(point);
        this.pump();
        this.map.invalidate('top');
      },
      up: () => this.endStroke(),
      cancel: () => {
        if (last()?.open) last().points.length = last().done;   // it was the first finger of a pinch
        this.endStroke();
      },
    };
  }

  brush() { return this.stroke('paint'); }
  eraser() { return this.stroke('erase'); }

  goto() {
    return {
      cursor: 'draw',
      hover: (point) => this.hovers(point),
      click: (point) => {
        this.choose('look');
        if (!this.refusal) commands.goTo(this.targets, point);
      },
    };
  }

  sendTo(keys) {
    this.targets = [...keys];
    this.choose('goto');
  }

  endStroke() {
    for (const stroke of this.strokes) stroke.open = false;
    this.pump();
    this.map.invalidate('top');
  }

  // Sends what was drawn since the last time, one request at a time, also after another tool was
  // chosen. A stroke's first point waits for the second one, or the end: it may be a pinch.
  pump() {
    this.sending ??= this.sendStrokes().finally(() => {
      this.sending = null;
      this.map.invalidate('top');
    });
  }

  async sendStrokes() {
    for (let stroke = this.strokes[0]; stroke; stroke = this.strokes[0]) {
      const points = stroke.points.slice(Math.max(0, stroke.done - 1), stroke.done + MOST_POINTS);
      if (stroke.points.length > stroke.done && (stroke.points.length > 1 || !stroke.open)) {
        stroke.done += points.length - (stroke.done > 0 ? 1 : 0);
        const sent = await this.send(stroke, points);
        if (sent) {
          stroke.edit = sent.edit ?? stroke.edit;
          stroke.changed += sent.changed;
          stroke.lost ||= isLost(sent);
        } else {
          stroke.open = false;
          stroke.points.length = stroke.done;
        }
      } else if (!stroke.open) {
        this.strokes.shift();
        if (stroke.done) toast(`${stroke.request === 'paint' ? 'Painted' : 'Erased'}: ${changeOf(stroke.law, stroke.changed, stroke.lost)}`);
        continue;
      } else {
        break;   // until it moves or ends
      }
      if (stroke.open) await new Promise((resolve) => setTimeout(resolve, SEND_EVERY_MS));
    }
  }

  // The parts of a stroke are undone together.
  async send({request, law, settings, edit}, points) {
    const body = {pheromone: law.name, points_m: points.map((it) => [round(it.x), round(it.y)]), radius_m: round(settings.radius)};
    if (edit) body.continues = edit;
    if (request === 'paint') body.units = Number((law.maximum * settings.share).toPrecision(6));
    try {
      return await api.post(request, body);
    } catch (error) {
      toast(`Not ${request === 'paint' ? 'painted' : 'erased'}: ${error.message}`, true);
      return null;
    }
  }

  cancel() {
    this.points = [];
    this.band = null;
    this.endStroke();
  }

  /** Undoes or redoes the last edit of the map, after what was drawn was sent. */
  async reverse(request) {
    if (this.refusal) { toast(`Not possible – ${this.refusal}`, true); return; }
    this.endStroke();
    await this.sending;
    try {
      const {what, time_s: made, changed} = await api.post(request, {});
      toast(`${REVERSALS[request].done}: ${what}, made at ${clock(made * 1000)}: ${nodesOf(changed)} changed`);
    } catch (error) {
      toast(error.message, true);
    }
  }

  showOptions() {
    const box = byId('options');
    box.hidden = !this.current || this.current === 'look';
    if (box.hidden) return;
    if (this.current === 'goto') {
      box.replaceChildren(h('span', {}, 'Click where ', h('b', {}, this.targets.length === 1 ? this.targets[0] : `the middle of ${this.targets.length} robots`), ' is to go'),
                          h('button', {type: 'button', onclick: () => this.choose('look')}, 'Cancel'));
      return;
    }
    if (this.current === 'measure') {
      const points = this.hover ? [...this.points, this.hover] : this.points;
      box.replaceChildren(h('output', {id: 'measured'}, this.points.length ? lengthOf(points) : 'Click points; double-click begins anew'),
                          h('button', {type: 'button', disabled: this.points.length === 0, onclick: () => { this.points = []; this.showOptions(); this.map.invalidate('top'); }}, 'Clear'));
      return;
    }
    const {law} = this;
    const select = h('select', {'aria-label': 'Pheromone', onchange: (event) => {
      store.tool = event.target.value;
      this.showOptions();
      store.emit('shown');
    }}, store.paintable.map((it) => h('option', {value: it.name, selected: it === law}, it.name)));
    const slider = (name, title, from, to, step, text) => {
      const output = h('output', {}, text(this.settings[name]));
      return h('label', {}, title, h('input', {type: 'range', min: from, max: to, step, value: this.settings[name], name,
        oninput: (event) => {
          this.settings[name] = Number(event.target.value);
          output.textContent = text(this.settings[name]);
          this.map.invalidate('top');
        }}), output);
    };
    box.replaceChildren(
      select, slider('radius', 'Radius', 0.02, 2, 0.01, (it) => metres(it)),
      ...(this.current === 'eraser' ? [] : [slider('share', 'Level', 0.02, 1, 0.02, (it) => number(it * (law?.maximum ?? 1)))]),
      ...(this.current === 'path'
        ? [h('span', {class: 'hint'}, this.points.length ? `${this.points.length} points` : 'Click points; Enter or double-click lays the path'),
           h('form', {class: 'points', onsubmit: (event) => { event.preventDefault(); this.addPoints(event.target.firstChild.value); }},
             h('input', {type: 'text', id: 'path-points', size: 12, placeholder: 'x, y; x, y', 'aria-label': 'Points in metres: x, y; x, y', autocomplete: 'off'}),
             h('button', {type: 'submit'}, 'Add')),
           h('button', {type: 'button', class: 'primary', id: 'finish-path', disabled: this.points.length < 2, onclick: () => this.finishPath()}, 'Lay path')]
        : []));
  }

  drawMeasure(context, view, theme) {
    const points = this.hover && this.points.length ? [...this.points, this.hover] : this.points;
    if (points.length === 0) return;
    context.strokeStyle = theme.accent;
    context.lineWidth = 2;
    context.beginPath();
    points.forEach((it, i) => context[i ? 'lineTo' : 'moveTo'](view.sx(it.x), view.sy(it.y)));
    context.stroke();
    context.font = fontOf(12);
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    points.forEach((it, i) => {
      context.beginPath();
      context.arc(view.sx(it.x), view.sy(it.y), 3.5, 0, 2 * Math.PI);
      context.fillStyle = theme.accent;
      context.fill();
      const last = points[i - 1];
      if (!last || Math.hypot(it.x - last.x, it.y - last.y) * view.scale < 40) return;
      context.fillStyle = theme.ink;
      write(context, theme, metres(Math.hypot(it.x - last.x, it.y - last.y)), view.sx((it.x + last.x) / 2), view.sy((it.y + last.y) / 2) - 10);
    });
  }

  draw(context, view, theme) {
    if (this.band) drawBand(context, view, theme, this.band);
    if (this.current === 'look') return;
    if (this.current === 'measure') { this.drawMeasure(context, view, theme); return; }
    const radius = this.settings.radius * view.scale;
    const colour = this.current === 'eraser' ? theme.bad : theme.accent;
    context.strokeStyle = colour;
    context.lineCap = 'round';
    context.lineJoin = 'round';
    const path = this.current === 'path' && this.hover && this.points.length ? [...this.points, this.hover] : this.points;
    for (const points of [path, ...this.strokes.map((it) => it.points)]) {
      if (points.length === 0) continue;
      context.globalAlpha = 0.3;
      context.lineWidth = Math.max(2, 2 * radius);
      context.beginPath();
      points.forEach((it, i) => context[i ? 'lineTo' : 'moveTo'](view.sx(it.x), view.sy(it.y)));
      if (points.length === 1) context.lineTo(view.sx(points[0].x) + 0.01, view.sy(points[0].y));
      context.stroke();
      context.globalAlpha = 1;
    }
    context.lineWidth = 1.5;
    for (const it of this.current === 'path' ? this.points : []) {
      context.beginPath();
      context.arc(view.sx(it.x), view.sy(it.y), 4, 0, 2 * Math.PI);
      context.fillStyle = theme.map;
      context.fill();
      context.stroke();
    }
    if (this.hover) {
      context.beginPath();
      context.arc(view.sx(this.hover.x), view.sy(this.hover.y), this.current === 'goto' ? 9 : Math.max(2, radius), 0, 2 * Math.PI);
      context.stroke();
    }
  }
}

function drawBand(context, view, theme, {from, to}) {
  const box = [view.sx(from.x), view.sy(from.y), (to.x - from.x) * view.scale, (from.y - to.y) * view.scale];
  context.strokeStyle = theme.accent;
  context.fillStyle = theme.accent;
  context.lineWidth = 1;
  context.globalAlpha = 0.12;
  context.fillRect(...box);
  context.globalAlpha = 1;
  context.strokeRect(...box);
}

/** "1.20 m at 45°, 3.40 m in all": of the last part, its direction as headings are told, and of all. */
function lengthOf(points) {
  if (points.length < 2) return '0.00 m';
  const parts = points.slice(1).map((it, i) => Math.hypot(it.x - points[i].x, it.y - points[i].y));
  const [a, b] = points.slice(-2);
  const heading = ((Math.atan2(b.y - a.y, b.x - a.x) * 180) / Math.PI + 360) % 360;
  const all = parts.length > 1 ? `, ${metres(parts.reduce((sum, it) => sum + it))} in all` : '';
  return `${metres(parts.at(-1))} at ${heading.toFixed(0)}°${all}`;
}

const isLost = ({changed, edit}) => changed > 0 && edit === null;
const changeOf = (law, changed, lost) =>
  `${nodesOf(changed)} of “${law.name}” changed${lost ? '; too large to be undone, like all edits before it' : ''}`;
const nodesOf = (count) => `${count} node${count === 1 ? '' : 's'}`;
const round = (x) => Math.round(x * 1e6) / 1e6;
