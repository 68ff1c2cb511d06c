// A recording of the server, shown by the whole page in place of the present: another address of the
// stream, with its own time line. The server plays it (server/operators/web/stream/playback_messages.h).
//
//   const replay = new Replay(stream, {onEnter, onLeave, onSeek});
//   replay.enter('20261124-0930.pcapng');  replay.toggle();  replay.seek(ms);  replay.leave();
import {store} from './store.js';
import {api} from './api.js';
import {byId, h, setText, toast} from './dom.js';
import {clock, duration} from './format.js';

const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32];
const STEPS = 2000;
const LEAP_MS = 5000;         // of an arrow key
const SEEK_EVERY_MS = 150;    // while the slider is dragged
const PLAYBACK_REQUEST = 3;
const PHASES = ['playing', 'paused', 'buffering', 'ended'];
const READ_ONLY = 'not while a recording is replayed: "Back to live" first';

const day = (ms) => new Date(ms).toLocaleDateString('en-GB', {day: 'numeric', month: 'short', year: 'numeric'});
const PLAY = '▶';
const PAUSE = '❚❚';

export class Replay {
  constructor(stream, {onEnter, onLeave, onSeek}) {
    Object.assign(this, {stream, onEnter, onLeave, onSeek, live: stream.url});
    this.reset();
    this.makeBanner();
    this.makeBar();
    stream.onInfo = (info) => this.takeInfo(info);
    stream.onTime = (ns) => this.takeTime(ns);
    stream.onPlayback = (state) => this.takeState(state);
    stream.onStatus = (status) => this.takeStatus(status);
    stream.onRefused = () => this.takeStatus({level: 1, message: 'The server does not answer, or replays too many recordings at once.'});
  }

  get active() { return Boolean(this.name); }

  reset() {
    Object.assign(this, {name: null, begin: 0n, end: 0n, at: 0n, phase: 'buffering', speed: 1, wanted: null,
                         number: 0, latest: '', problem: '', sentAt: 0, plays: true});
  }

  makeBanner() {
    this.title = h('b');
    this.detail = h('span');
    this.trouble = h('span', {class: 'trouble', role: 'alert'});
    this.banner = h('div', {class: 'replay-banner', id: 'replay-banner', role: 'status', hidden: true},
      h('span', {class: 'replay-words'}, this.title, ' ', this.detail, ' ', this.trouble),
      h('button', {type: 'button', class: 'primary', id: 'back-to-live', title: 'Back to the present (L)', onclick: () => this.leave()}, 'Back to live'));
    byId('stage').before(this.banner);
  }

  makeBar() {
    const button = (id, title, text, go) => h('button', {type: 'button', id, title, 'aria-label': /\w/.test(text) ? null : title, onclick: go}, text);
    this.play = button('replay-play', 'Play or pause (Space)', PAUSE, () => this.toggle());
    this.speeds = h('select', {id: 'replay-speed', 'aria-label': 'Speed', title: 'Speed', onchange: () => {
      this.speed = Number(this.speeds.value);
      this.ask();
    }}, SPEEDS.map((it) => h('option', {value: it, selected: it === 1}, `${it}×`)));
    this.slider = h('input', {type: 'range', min: 0, max: STEPS, value: 0, id: 'replay-scrub', 'aria-label': 'Time of the recording',
      oninput: () => this.drag(), onchange: () => this.drop(),
      onkeydown: (event) => { if (this.keydown(event.key.toLowerCase())) event.preventDefault(); }});
    this.clock = h('time', {class: 'replay-clock', id: 'replay-clock'});
    this.length = h('span', {class: 'dim'});
    this.bar = h('div', {class: 'replay-bar', id: 'replay-bar', hidden: true},
      button('replay-back', 'Five seconds back (←)', '−5 s', () => this.leap(-LEAP_MS)), this.play,
      button('replay-on', 'Five seconds on (→)', '+5 s', () => this.leap(LEAP_MS)),
      this.speeds, this.clock, this.slider, this.length);
    byId('timeline').append(this.bar);
  }

  enter(name) {
    this.reset();
    this.name = name;
    store.isReplay = true;
    this.speeds.value = '1';
    api.refusal = READ_ONLY;
    document.documentElement.dataset.replay = 'on';
    this.banner.hidden = this.bar.hidden = false;
    this.onEnter(name);
    this.stream.go(`${this.live}replay/${encodeURIComponent(name)}`);
    this.show();
  }

  leave() {
    if (!this.active) return;
    this.reset();
    store.isReplay = false;
    api.refusal = '';
    delete document.documentElement.dataset.replay;
    this.banner.hidden = this.bar.hidden = true;
    this.onLeave();
    this.stream.go(this.live);
  }

  // ---- what the server says ----

  takeInfo(info) {
    if (!this.active || !info.dataStartTime) return;
    const ns = ({sec, nsec}) => BigInt(sec) * 1000000000n + BigInt(nsec);
    const isAgain = this.end !== 0n;   // the connection was lost meanwhile
    const {at} = this;
    this.begin = ns(info.dataStartTime);
    this.end = ns(info.dataEndTime);
    this.at = this.begin;
    this.problem = '';
    if (isAgain) this.ask({seek: at});
    this.show();
  }

  takeTime(ns) {
    if (!this.active || this.isWaiting) return;
    this.at = ns;
    this.show();
  }

  takeState({phase, time, id}) {
    if (!this.active) return;
    if (id && id !== this.latest) return;   // a newer request is under way
    this.phase = PHASES[phase] ?? 'paused';
    if (this.phase !== 'buffering') this.plays = this.phase === 'playing';
    if (!this.isWaiting || this.phase !== 'buffering') {
      this.wanted = null;
      this.at = time;
    }
    this.show();
  }

  takeStatus({level, message}) {
    if (!this.active || level === 0) return;
    this.problem = message;
    if (level === 2) toast(message, true);
    this.show();
  }

  // ---- what is asked of it ----

  get isWaiting() { return this.wanted !== null; }
  get shown() { return this.wanted ?? this.at; }

  /** Play or pause, at the speed that is chosen; `seek` in ns. */
  ask({play = this.plays, seek = null} = {}) {
    this.plays = play;
    this.number += 1;
    this.latest = `page-${this.number}`;
    const id = new TextEncoder().encode(this.latest);
    const bytes = new Uint8Array(19 + id.length);
    const view = new DataView(bytes.buffer);
    view.setUint8(0, PLAYBACK_REQUEST);
    view.setUint8(1, play ? 0 : 1);
    view.setFloat32(2, this.speed, true);
    view.setUint8(6, seek === null ? 0 : 1);
    view.setBigUint64(7, seek ?? 0n, true);
    view.setUint32(15, id.length, true);
    bytes.set(id, 19);
    if (seek !== null) {
      this.wanted = seek;
      this.onSeek();
    }
    this.phase = seek !== null ? 'buffering' : play ? 'playing' : 'paused';
    this.stream.sendBytes(bytes);
    this.show();
  }

  toggle() {
    if (this.phase === 'ended') this.ask({play: true, seek: this.begin});
    else this.ask({play: !this.plays});
  }

  /** To a moment of the recording, in milliseconds since 1970. */
  seek(ms) { this.seekNs(BigInt(Math.round(ms * 1000)) * 1000n); }

  seekNs(ns) {
    const at = ns < this.begin ? this.begin : ns > this.end ? this.end : ns;
    this.ask({seek: at});
  }

  leap(ms) { this.seekNs(this.shown + BigInt(ms) * 1000000n); }

  get dragged() {
    return this.begin + (BigInt(this.slider.valueAsNumber) * (this.end - this.begin)) / BigInt(STEPS);
  }

  // While it is dragged, a few times a second; where it is dropped, at last.
  drag() {
    this.wanted = this.dragged;
    const now = performance.now();
    if (now - this.sentAt >= SEEK_EVERY_MS) this.drop();
    else this.show();
  }

  drop() {
    this.sentAt = performance.now();
    this.seekNs(this.dragged);
  }

  /** Whether it took a key. */
  keydown(key) {
    if (!this.active) return false;
    const go = {' ': () => this.toggle(), arrowleft: () => this.leap(-LEAP_MS), arrowright: () => this.leap(LEAP_MS),
                home: () => this.seekNs(this.begin), end: () => this.seekNs(this.end), l: () => this.leave()}[key];
    go?.();
    return Boolean(go);
  }

  show() {
    if (!this.active) return;
    const ms = (ns) => Number(ns / 1000000n);
    const isKnown = this.end !== 0n;
    setText(this.title, `Replay of ${this.name} – not live`);
    const what = !isKnown ? (this.problem ? '' : 'reading …') : {playing: '', paused: 'paused', buffering: 'seeking …', ended: 'ended'}[this.phase];
    setText(this.detail, [isKnown ? day(ms(this.shown)) : '', what].filter((it) => it).join(', '));
    setText(this.trouble, this.problem);
    setText(this.play, this.plays ? PAUSE : PLAY);
    setText(this.clock, isKnown ? clock(ms(this.shown)) : '–');
    setText(this.length, isKnown ? `${duration(ms(this.shown - this.begin) / 1000)} of ${duration(ms(this.end - this.begin) / 1000)}` : '');
    const span = this.end - this.begin;
    const step = span > 0n ? Number(((this.shown - this.begin) * BigInt(STEPS)) / span) : 0;
    if (this.slider.valueAsNumber !== step && this.wanted === null) this.slider.value = step;
    this.slider.setAttribute('aria-valuetext', this.clock.textContent);
  }
}
