// The line below the map: looking back at the last minutes, and the server's recording of traffic.
import {store} from './store.js';
import {api} from './api.js';
import {byId, h, setText, toast} from './dom.js';
import {bytes, clock, duration} from './format.js';

const STEPS = 1000;
const SPEEDS = [1, 4, 16];

export class Timeline {
  constructor(history, map) {
    this.history = history;
    this.map = map;
    this.playing = false;
    this.speed = 1;
    this.slider = h('input', {type: 'range', min: 0, max: STEPS, value: STEPS, 'aria-label': 'Time', id: 'scrub',
                              oninput: () => this.scrub()});
    this.liveButton = h('button', {type: 'button', class: 'live-button', id: 'live', title: 'Back to the present (L)', onclick: () => this.live()}, 'Live');
    this.playButton = h('button', {type: 'button', id: 'play', title: 'Play from here, or pause (Space)', onclick: () => this.toggle()}, 'Pause');
    this.speedButton = h('button', {type: 'button', class: 'speed plain', title: 'Speed of playing', onclick: () => {
      this.speed = SPEEDS[(SPEEDS.indexOf(this.speed) + 1) % SPEEDS.length];
      this.show();
    }}, '1×');
    this.when = h('span', {class: 'when'});
    this.record = h('button', {type: 'button', class: 'rec', id: 'record', onclick: () => this.toggleRecording()}, h('i'), h('span'));
    this.recordFacts = h('span', {class: 'rec-facts'});
    this.past = h('b');
    this.banner = h('div', {class: 'replay-banner', id: 'past-banner', role: 'status', hidden: true},
      h('span', {class: 'replay-words'}, this.past, ' The map is not live, and its tools are off.'),
      h('button', {type: 'button', class: 'primary', onclick: () => this.live()}, 'Go live'));
    byId('stage').before(this.banner);
    byId('timeline').append(this.liveButton, this.playButton, this.speedButton, this.slider, this.when, this.recordFacts, this.record);
    setInterval(() => this.tick(), 250);
    this.show();
  }

  get at() { return store.past?.at ?? null; }

  scrub() {
    const share = this.slider.valueAsNumber / STEPS;
    if (share >= 1) { this.live(); return; }
    const start = this.history.start;
    this.playing = false;
    this.go(start + share * (Date.now() - start));
  }

  go(at) {
    this.want = at;
    store.goTo(this.history.at(at));
    if (!store.past) return;
    for (const layer of store.layers.values()) layer.show?.(store.past.pictures.get(layer.name) ?? null);
    this.map.invalidate();
    this.show();
    store.emit('robots');
  }

  live() {
    this.playing = false;
    store.goTo(null);
    for (const layer of store.layers.values()) layer.show?.(null);
    this.map.invalidate();
    this.show();
    store.emit('robots');
  }

  toggle() {
    if (!store.past) this.go(Date.now() - 1);
    else this.playing = !this.playing;
    this.show();
  }

  tick() {
    if (store.past && this.playing) {
      const next = this.want + 250 * this.speed;
      if (next >= Date.now() - 300) this.live();
      else this.go(next);
    }
    this.show();
  }

  show() {
    const past = store.past;
    const now = Date.now();
    const start = this.history.start;
    if (document.activeElement !== this.slider || this.playing || !past) {
      this.slider.value = past ? Math.round(((past.at - start) / Math.max(1, now - start)) * STEPS) : STEPS;
    }
    this.banner.hidden = !past;
    document.documentElement.toggleAttribute('data-past', Boolean(past));
    if (past) setText(this.past, `The past: ${clock(past.at)}, ${duration((now - past.at) / 1000)} ago.`);
    this.liveButton.setAttribute('aria-pressed', String(!past));
    setText(this.liveButton, past ? 'Go live' : byId('link-state').dataset.state === 'live' ? '● Live' : 'No data');
    setText(this.playButton, past && !this.playing ? 'Play' : 'Pause');
    setText(this.speedButton, `${this.speed}×`);
    setText(this.when, past ? `−${duration((now - past.at) / 1000)}` : `last ${duration((now - start) / 1000)}`);
  }

  showRecording() {
    const capture = store.status?.capture;
    const on = Boolean(capture?.recording);
    this.record.classList.toggle('on', on);
    setText(this.record.lastChild, on ? 'Stop recording' : 'Record');
    this.record.disabled = api.refusal !== '' || !capture;
    this.record.title = api.refusal === '' ? 'Record all traffic to files, for Wireshark and pheromonectl replay' : `Recording: ${api.refusal}`;
    setText(this.recordFacts, on ? `${bytes(capture.bytes)}, ${capture.records} records${capture.lost ? `, ${capture.lost} lost` : ''}`
      : capture?.error ?? '');
  }

  async toggleRecording() {
    if (this.record.disabled) return;
    const action = store.status?.capture?.recording ? 'stop' : 'start';
    try {
      const capture = await api.post('capture', {action});
      if (store.status) store.status.capture = capture;
      this.showRecording();
      store.emit('recording');
      toast(action === 'start' ? `Recording to ${capture.file ?? capture.folder}` : 'Recording stopped');
    } catch (error) {
      toast(`Recording: ${error.message}`, true);
    }
  }
}
