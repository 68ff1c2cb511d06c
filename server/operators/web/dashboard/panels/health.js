// The server: journal, disk, memory, links, recordings.
import {store} from '../store.js';
import {api} from '../api.js';
import {h, pairs, panel, setText, toast} from '../dom.js';
import {bytes, count, duration, percent} from '../format.js';

export class HealthPanel {
  constructor(onReplay) {
    this.onReplay = onReplay;
    this.links = panel('links', 'Links');
    this.server = panel('server', 'Server');
    this.recordings = panel('recordings', 'Recordings', false);
    this.facts = h('div');
    this.snapshot = h('button', {type: 'button', id: 'snapshot', title: 'Write the state to the journal’s folder now', onclick: () => this.makeSnapshot()}, 'Snapshot');
    this.server.body.append(this.facts, h('div', {class: 'actions'}, this.snapshot));
    this.recordings.element.addEventListener('toggle', () => this.loadRecordings());
    store.on('recording', () => this.loadRecordings());
  }

  async makeSnapshot() {
    try {
      const made = await api.post('snapshot', {});
      toast(`Snapshot ${made.snapshot}`);
    } catch (error) {
      toast(`Snapshot: ${error.message}`, true);
    }
  }

  showLinks() {
    const links = [...store.links.values()];
    const isRecorded = links.some((it) => it.kind === 'recorded');   // bytes alone: not whether it was up
    const working = links.filter((it) => (isRecorded ? it.bytes_per_s > 0 : it.up));
    const here = links.filter((it) => it.role !== 'elsewhere');   // others have their modem at another node
    setText(this.links.count, here.length ? `${working.length} of ${here.length} ${isRecorded ? 'with traffic' : 'up'}` : '');
    this.links.body.replaceChildren(...links.map((link) => {
      const used = link.utilisation === null ? `${bytes(link.bytes_per_s)}/s` : percent(link.utilisation);
      const bar = h('i');
      bar.style.transform = `scaleX(${Math.min(1, link.utilisation ?? 0).toFixed(3)})`;
      const row = h('div', {class: 'row link', title: `${link.kind} ${link.address}: ${link.state}, ${count(link.errors)} errors`},
                    h('i', {class: `dot ${working.includes(link) ? (link.silent ? 'warn' : 'good') : isRecorded || !here.includes(link) ? '' : 'bad'}`}),
                    h('span', {}, link.name, ' ', h('span', {class: 'dim'}, isRecorded ? (working.includes(link) ? '' : 'no traffic') : link.up ? link.kind : link.state)),
                    h('span', {class: `meter${link.utilisation > 0.8 ? ' warn' : ''}`, title: 'Share of the channel in use'}, bar),
                    h('span', {class: 'end'}, used));
      return link.up || !link.last_error || !here.includes(link) ? row : [row, h('p', {class: 'trouble'}, link.last_error)];
    }).flat());
  }

  showServer() {
    const {status, engine} = store;
    if (!status) return;
    const lag = status.durable_sequence === null
      ? null : status.sequence - status.durable_sequence;   // null: there is no journal
    const isPast = store.isReplay;   // a recording knows nothing of the process
    const healthy = status.health?.healthy !== false;
    setText(this.server.count, healthy ? '' : 'trouble');
    this.facts.replaceChildren(pairs([
      !isPast && ['State', healthy ? 'healthy' : 'trouble', healthy ? 'good' : 'bad'],
      ['Log', `${count(status.sequence)} entries`],
      !isPast && ['Not yet on disk', lag === null ? 'nothing is kept: no journal' : lag === 0 ? 'none' : count(lag), lag > 1000 ? 'warn' : ''],
      ['Field', `${bytes(status.field.used_bytes)} of ${bytes(status.field.limit_bytes)}`],
      !isPast && ['Memory', bytes(status.process.resident_bytes)],
      !isPast && ['Up for', duration(status.uptime_s)],
      ['Version', status.version],
      engine?.viewers && ['Viewers', String(engine.viewers.connected)],
    ]), ...(status.warning ?? status.health?.problem ? [h('p', {class: 'warning'}, status.warning ?? status.health.problem)] : []));
    this.snapshot.disabled = api.refusal !== '';
    this.snapshot.title = api.refusal === '' ? 'Write the state to the journal’s folder now' : `Snapshot: ${api.refusal}`;
  }

  replayButton({name, recording}) {
    const title = recording ? `Replay ${name}, up to now` : `Replay ${name}`;
    return h('button', {type: 'button', class: 'replay', 'data-capture': name, title, onclick: () => this.onReplay(name)}, 'Replay');
  }

  /** The files of the server's recordings, if it serves them. */
  async loadRecordings() {
    if (!this.recordings.element.open) return;
    try {
      const {captures} = await api.get('captures');
      setText(this.recordings.count, String(captures.length || ''));
      this.recordings.body.replaceChildren(captures.length === 0 ? h('p', {class: 'empty'}, 'None yet') : h('ul', {class: 'files'},
        captures.slice(-20).reverse().map((it) => h('li', {}, h('a', {href: `/api/v1/captures/${encodeURIComponent(it.name)}`, download: it.name}, it.name),
                                                     h('span', {class: 'dim'}, bytes(it.bytes)),
                                                     it.name.endsWith('.pcapng') ? this.replayButton(it) : null))));
    } catch {
      this.recordings.body.replaceChildren(h('p', {class: 'empty'}, 'This server does not serve them'));
    }
  }
}
