// What has happened, with what an operator has to see to: filtered, acknowledged, and each leads to
// where it happened.
import {store} from '../store.js';
import {api} from '../api.js';
import {h, setText} from '../dom.js';
import {clock} from '../format.js';

const MOST_EVENTS = 500;
const SAME_MS = 2000;
const MARKS = {warning: 'warn', error: 'bad', fatal: 'bad'};
const FILTERS = {all: 'All', trouble: 'Warnings', operator: 'Operators', robot: 'Robots', link: 'Links'};
const ACKNOWLEDGED = 'events.acknowledged';

/** Where something happened: a robot ("robot radio-a 7"), a point of the map; or nothing. */
function placeOf(text) {
  const robot = /\brobot (\S+) (\d+)\b/.exec(text);
  if (robot && store.robots.has(`${robot[1]}/${robot[2]}`)) return {robot: `${robot[1]}/${robot[2]}`};
  const point = /\((-?\d+(?:\.\d+)?(?:e-?\d+)?), (-?\d+(?:\.\d+)?(?:e-?\d+)?)\)/.exec(text);
  return point ? {x: Number(point[1]), y: Number(point[2])} : null;
}

export class EventList {
  constructor(dock, onPlace) {
    this.onPlace = onPlace;
    this.events = [];   // the newest first: {timeMs, level, text, name}
    this.acknowledged = Number(localStorage.getItem(ACKNOWLEDGED) ?? 0);   // up to this time
    this.list = h('ol', {class: 'events', id: 'events', tabindex: '0', 'aria-label': 'Events'});
    this.count = h('span', {id: 'event-count'});
    this.filter = h('select', {id: 'event-filter', 'aria-label': 'Events shown', onchange: () => this.show()},
                    Object.entries(FILTERS).map(([value, name]) => h('option', {value}, name)));
    this.seen = h('button', {type: 'button', id: 'acknowledge', class: 'plain', title: 'Warnings up to now are seen', onclick: () => this.acknowledge()}, 'Acknowledge');
    dock.append(h('div', {class: 'event-panel'}, h('div', {class: 'event-head'}, h('h2', {}, 'Events'), this.count, this.filter, this.seen), this.list));
    this.show();
  }

  get unseen() { return this.events.filter((it) => this.isUnseen(it)).length; }

  isUnseen(event) { return Boolean(MARKS[event.level]) && event.timeMs > this.acknowledged; }

  acknowledge() {
    this.acknowledged = Math.max(this.acknowledged, ...this.events.map((it) => it.timeMs));
    localStorage.setItem(ACKNOWLEDGED, this.acknowledged);
    this.show();
  }

  /** What happened before this page was opened; the stream tells the latest again, in other milliseconds. */
  async loadOlder() {
    try {
      const {events} = await api.get('events');
      const known = [...this.events];
      for (const {time_s: timeS, topic, on, subject, text} of events) {
        const what = {link: `link ${subject} is ${on ? 'up' : 'down'}`, capture: `recording ${on ? 'started' : 'stopped'}`,
                      health: on ? 'the log is durable again' : 'the log is not durable', arrival: `robot ${subject}`, net: `net ${subject}`,
                      configuration: 'another configuration is in effect', operator: subject}[topic] ?? topic;
        const event = {timeMs: timeS * 1000, level: on || topic === 'capture' ? 'info' : 'warning', name: topic,
                       text: [what, text].filter((it) => it).join(topic === 'arrival' ? ' ' : ': ')};
        if (!known.some((it) => it.text === event.text && Math.abs(it.timeMs - event.timeMs) < SAME_MS)) this.insert(event);
      }
      this.show();
    } catch { /* then only what comes is shown */ }
  }

  clear() {
    this.events = [];
    this.show();
  }

  add(event) {
    this.insert(event);
    this.show();
  }

  insert({timeMs, level, text, name}) {
    const event = {timeMs: timeMs || Date.now(), level, text, name};
    if (this.events.some((it) => it.timeMs === event.timeMs && it.text === text)) return;   // told again after a lost connection
    const at = this.events.findIndex((it) => it.timeMs <= event.timeMs);
    this.events.splice(at < 0 ? this.events.length : at, 0, event);
    this.events.length = Math.min(this.events.length, MOST_EVENTS);
  }

  isShown({level, name}) {
    const wanted = this.filter.value;
    return wanted === 'all' || (wanted === 'trouble' ? Boolean(MARKS[level]) : name === wanted || (wanted === 'robot' && name === 'arrival'));
  }

  row(event) {
    const mark = MARKS[event.level] ?? (event.name === 'operator' ? 'held' : '');
    const place = placeOf(event.text);
    const text = place ? h('button', {type: 'button', class: 'jump', title: 'Show where', onclick: () => this.onPlace(place)}, event.text)
      : h('span', {}, event.text);
    text.classList.add(...[MARKS[event.level]].filter((it) => it));
    return h('li', {class: this.isUnseen(event) ? 'unseen' : '', 'data-name': event.name},
             h('time', {}, clock(event.timeMs)), h('i', {class: `dot ${mark}`}), text, MARKS[event.level] ? h('span', {class: 'only-read'}, event.level) : null);
  }

  show() {
    const shown = this.events.filter((it) => this.isShown(it));
    const {unseen} = this;
    setText(this.count, [shown.length < this.events.length ? `${shown.length} of ${this.events.length}` : String(this.events.length || ''),
                         unseen ? `${unseen} new warning${unseen === 1 ? '' : 's'}` : ''].filter((it) => it).join(', '));
    this.count.classList.toggle('warn', unseen > 0);
    this.seen.disabled = unseen === 0;
    this.list.replaceChildren(...(shown.length ? shown.map((it) => this.row(it)) : [h('li', {class: 'empty'}, this.events.length ? 'None of this kind' : 'Nothing yet')]));
    store.emit('events');
  }
}
