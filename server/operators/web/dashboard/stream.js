// The stream: a client of the Foxglove WebSocket protocol that comes back by itself.
//
//   const stream = new Stream(url, (state, detail) => ...);
//   stream.watch('/status', (payload) => ...);           // a topic, or a function of it
//   stream.pause('/pheromone_delta/trail');              // nothing more of it, until resume()
//   stream.record(wants, (channel, time, payload) => ...);  // other topics, too, until record(null)
//
// States: connecting, live, stale (open, but silent), lost (detail: when the next attempt is).

const PROTOCOLS = ['foxglove.sdk.v1', 'foxglove.websocket.v1'];
const STALE_MS = 4000;   // the server tells its status every second
const DEAD_MS = 9000;
const READING_MS = 120000;   // a server reads a whole recording before it says anything of it
const LONGEST_WAIT_MS = 5000;
const MESSAGE_DATA = 1;
const TIME = 2;
const PLAYBACK_STATE = 5;

export class Stream {
  constructor(url, onState) {
    this.url = url;
    this.onState = onState;
    this.watches = [];
    this.paused = new Set();
    this.channels = new Map();        // topic -> channel
    this.subscriptions = new Map();   // id -> {channel, isRecorded, handler}
    this.recording = null;            // {wants, take}
    this.nextId = 1;
    this.attempts = 0;
    this.session = '';
    this.onSession = () => {};
    this.onChannel = () => {};
    this.onInfo = () => {};
    this.onStatus = () => {};
    this.onRefused = () => {};        // the connection was not even opened
    this.onTime = () => {};           // nanoseconds
    this.onPlayback = () => {};       // of a recording: {phase, time, speed, sought, id}
    this.received = 0;                // bytes
    setInterval(() => this.look(), 1000);
  }

  watch(match, handler) {
    this.watches.push({match: typeof match === 'string' ? (topic) => topic === match : match, handler});
  }

  /** From another address from now on. */
  go(url) {
    this.url = url;
    this.attempts = 0;
    this.connect();
  }

  connect() {
    clearTimeout(this.timer);
    this.close();
    this.setState('connecting');
    const socket = new WebSocket(this.url, PROTOCOLS);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.heard = performance.now();
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      this.heard = performance.now();
      if (typeof event.data === 'string') {
        this.take(JSON.parse(event.data));
      } else {
        this.received += event.data.byteLength;
        this.takeData(event.data);
      }
      if (this.state !== 'live') { this.attempts = 0; this.setState('live'); }
    };
    socket.onclose = () => {
      if (socket !== this.socket) return;
      if (this.state === 'connecting') this.onRefused();
      this.retry();
    };
  }

  close() {
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    this.channels.clear();
    this.subscriptions.clear();
  }

  retry() {
    this.close();
    const wait = Math.min(LONGEST_WAIT_MS, 500 * 2 ** this.attempts) * (0.8 + 0.4 * Math.random());
    this.attempts += 1;
    this.setState('lost', performance.now() + wait);
    this.timer = setTimeout(() => this.connect(), wait);
  }

  // A server that stands still keeps its connections open.
  look() {
    if (!this.socket) return;
    const silent = performance.now() - this.heard;
    if (silent > (this.state === 'connecting' && this.socket.readyState === WebSocket.OPEN ? READING_MS : DEAD_MS)) this.retry();
    else if (silent > STALE_MS && this.state === 'live') this.setState('stale');
  }

  setState(state, detail) {
    this.state = state;
    this.onState(state, detail);
  }

  take(message) {
    switch (message.op) {
      case 'serverInfo':
        this.onSession(message.sessionId !== this.session, message.sessionId);
        this.session = message.sessionId;
        this.onInfo(message);
        break;
      case 'advertise':
        for (const channel of message.channels) {
          this.channels.set(channel.topic, channel);
          this.onChannel(channel.topic);
          this.subscribe(channel);
        }
        break;
      case 'unadvertise':
        for (const [topic, channel] of this.channels) {
          if (!message.channelIds.includes(channel.id)) continue;
          this.channels.delete(topic);
          for (const [id, it] of this.subscriptions) if (it.channel.topic === topic) this.subscriptions.delete(id);
        }
        break;
      case 'status':
        if (message.level === 2) console.warn(`stream: ${message.message}`);
        this.onStatus(message);
        break;
    }
  }

  subscribe(channel) {
    if (!this.isWanted(channel.topic)) return;
    for (const it of this.subscriptions.values()) if (it.channel.topic === channel.topic) return;
    const id = this.nextId;
    this.nextId += 1;
    this.subscriptions.set(id, {channel, isRecorded: this.isRecorded(channel.topic), handler: this.watchOf(channel.topic)?.handler});
    this.send({op: 'subscribe', subscriptions: [{id, channelId: channel.id}]});
  }

  unsubscribe(id) {
    this.subscriptions.delete(id);
    this.send({op: 'unsubscribe', subscriptionIds: [id]});
  }

  watchOf(topic) { return this.watches.find((it) => it.match(topic)); }

  isRecorded(topic) { return Boolean(this.recording?.wants(topic)); }

  isWanted(topic) { return this.isRecorded(topic) || Boolean(this.watchOf(topic) && !this.paused.has(topic)); }

  pause(topic) {
    this.paused.add(topic);
    this.dropUnwanted();
  }

  dropUnwanted() {
    for (const [id, it] of this.subscriptions) if (!this.isWanted(it.channel.topic)) this.unsubscribe(id);
  }

  /** `take` is given what comes of the topics that `wants` says, from now on; null: nothing more. */
  record(wants, take) {
    this.recording = wants ? {wants, take} : null;
    for (const it of this.subscriptions.values()) it.isRecorded = false;
    this.refresh();
  }

  /** After what is wanted has changed. A recording is told what seldom changes, as each new subscriber. */
  refresh() {
    this.dropUnwanted();
    for (const [id, it] of this.subscriptions) if (!it.isRecorded && this.isRecorded(it.channel.topic)) this.unsubscribe(id);
    for (const channel of this.channels.values()) this.subscribe(channel);
  }

  resume(topic) {
    this.paused.delete(topic);
    const channel = this.channels.get(topic);
    if (channel) this.subscribe(channel);
  }

  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  sendBytes(bytes) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(bytes);
  }

  takeData(buffer) {
    const view = new DataView(buffer);
    const op = buffer.byteLength > 0 ? view.getUint8(0) : 0;
    if (op === TIME && buffer.byteLength >= 9) this.onTime(view.getBigUint64(1, true));
    if (op === PLAYBACK_STATE && buffer.byteLength >= 19) {
      this.onPlayback({phase: view.getUint8(1), time: view.getBigUint64(2, true), speed: view.getFloat32(10, true),
                       sought: view.getUint8(14) !== 0, id: new TextDecoder().decode(new Uint8Array(buffer, 19))});
    }
    if (buffer.byteLength < 13 || view.getUint8(0) !== MESSAGE_DATA) return;
    const to = this.subscriptions.get(view.getUint32(1, true));
    if (!to) return;
    const payload = new Uint8Array(buffer, 13);
    to.handler?.(payload, to.channel.topic);
    if (to.isRecorded && this.isRecorded(to.channel.topic)) this.recording.take(to.channel, view.getBigUint64(5, true), payload);
  }
}
