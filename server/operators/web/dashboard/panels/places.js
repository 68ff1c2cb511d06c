// Tags with what is written on them, and live Petri nets.
import {store} from '../store.js';
import {api} from '../api.js';
import {h, pairs, panel, setText} from '../dom.js';
import {duration, metres, number} from '../format.js';
import {signOf, tagKey} from '../places.js';

const EMPTY_SYMBOLS = {robots: new Map(), strings: new Map(), mappings: new Map()};
const NET_RECORD = -32;
const signClass = ({green, waiting}) => `sign ${green ? 'go' : waiting ? 'stop waits' : 'stop'}`;

/** A term of a block as words; the namespaces are those of server/core/tags/README.md. */
function textOf([space, value], author, symbols) {
  const string = (number) => symbols.strings.get(`${symbols.mappings.get(author) ?? author}/${number}`) ?? symbols.strings.get(`${author}/${number}`);
  if (space > 0) {
    const tail = string(value);
    return tail ?? `${space}:${value}`;
  }
  switch (space) {
    case 0: return string(value) ?? `string ${value}`;
    case -1: return `“${string(value) ?? `string ${value}`}”`;
    case -2: return `‘${String.fromCodePoint(Math.max(0, Math.min(value, 0x10ffff)))}’`;
    case -3: return String(value);
    case -4: return number(new Float32Array(new Int32Array([value]).buffer)[0]);
    case -5: return new Date((value >>> 0) * 1000).toISOString().replace('.000', '');
    case -6: return new Date(value * 86400000).toISOString().slice(0, 10);
    case -7: return new Date(value).toISOString().slice(11, 19);
    case -17: return symbols.robots.get(value) ?? `robot ${value}`;
    case -18: return store.tags.find((it) => it.number === value)?.name ?? `tag ${value}`;
    default: return `${space}:${value}`;
  }
}

export class PlacesPanel {
  constructor() {
    this.tags = panel('tags', 'Tags', true);
    this.nets = panel('nets', 'Nets', true);
    this.list = h('div', {class: 'rows', id: 'tag-rows'});
    this.card = h('div', {class: 'card', id: 'tag-card', hidden: true});
    this.tags.body.append(this.list, this.card);
    this.symbols = EMPTY_SYMBOLS;
    this.contents = null;
    this.opened = new Set();   // nets whose marking is shown
    store.on('selected', () => this.load());
  }

  show() {
    this.tags.element.hidden = store.tags.length === 0;
    setText(this.tags.count, String(store.tags.length || ''));
    this.list.replaceChildren(...store.tags.slice(0, 60).map((tag) => {
      const sign = signOf(tag.name);
      return h('button', {type: 'button', class: `row two${store.selected?.key === tagKey(tag) ? ' selected' : ''}`, 'data-tag': tag.name, onclick: () =>
        store.select(store.selected?.key === tagKey(tag) ? null : {kind: 'tag', key: tagKey(tag)})},
        sign ? h('i', {class: signClass(sign)}, sign.green ? '▲' : '–') : h('i', {class: `dot${tag.used ? ' good' : ''}`}),
        h('span', {}, tag.name), h('span', {class: 'end'}, `${tag.used} of ${tag.slots}`));
    }));
    this.showCard();
  }

  get selected() {
    return store.selected?.kind === 'tag' ? store.tags.find((it) => tagKey(it) === store.selected.key) : null;
  }

  /** The blocks of the selected tag. */
  async load() {
    const tag = this.selected;
    if (!tag || tag.blocks) {   // as replays have them
      this.contents = tag;
      this.symbols = tag ? EMPTY_SYMBOLS : this.symbols;
      this.show();
      return;
    }
    try {
      await this.loadSymbols();
      const page = await api.get(`tags?first=${tag.number}&contents=1`);
      this.contents = page.tags.find((it) => it.number === tag.number) ?? null;
    } catch {
      this.contents = null;
    }
    this.show();
  }

  async loadSymbols() {
    const symbols = {robots: new Map(), strings: new Map(), mappings: new Map()};
    for (let first = 0; first !== null;) {
      const page = await api.get(`symbols?first=${first}`);
      for (const row of page.rows) {
        if (row.kind === 'robot') symbols.robots.set(row.robot, row.text);
        else if (row.kind === 'string') symbols.strings.set(`${row.robot}/${row.number}`, row.text);
        else symbols.mappings.set(row.robot, row.number);
      }
      first = page.next;
    }
    this.symbols = symbols;
  }

  showCard() {
    const tag = this.selected;
    this.card.hidden = !tag;
    if (!tag) return;
    const blocks = this.contents?.number === tag.number ? this.contents.blocks : [];
    const sign = signOf(tag.name);
    this.card.replaceChildren(
      h('header', {}, h('h3', {}, `Tag ${tag.name}`), h('button', {type: 'button', title: 'Close (Esc)', onclick: () => store.select(null)}, '×')),
      pairs([
        tag.x_m !== null && ['Position', `${metres(tag.x_m)}, ${metres(tag.y_m)}`],
        tag.range_m !== null && ['Range', metres(tag.range_m)],
        sign && ['Semaphore', `${sign.green ? 'go' : 'stop'}${sign.waiting ? `, robot ${sign.waiting} waits` : ''}`, sign.green ? 'good' : sign.waiting ? 'warn' : ''],
        ['Blocks', `${tag.used} of ${tag.slots}, generation ${tag.generation}`]]),
      ...blocks.map((it) => this.block(it)));
  }

  block(block) {
    const text = (term) => textOf(term, block.author, this.symbols);
    const author = this.symbols.robots.get(block.author) ?? block.author;
    const facts = [`slot ${block.slot}`, `by ${author}`, block.time_s ? new Date(block.time_s * 1000).toISOString().slice(0, 16).replace('T', ' ') : null,
                   block.lease_s !== null ? `leased for ${duration(block.lease_s)}` : null, block.privileged ? 'privileged' : null];
    return h('div', {class: 'block'},
             h('div', {class: 'fact'}, block.subject[0] === NET_RECORD ? 'a record of a net' : [text(block.subject), text(block.predicate), text(block.object)].join(' ')),
             h('small', {}, facts.filter((it) => it).join(' · ')));
  }

  showNets() {
    this.nets.element.hidden = store.nets.length === 0;
    setText(this.nets.count, String(store.nets.length || ''));
    this.nets.body.replaceChildren(...store.nets.map((net) => {
      const most = Math.max(net.A.concentration, net.B.concentration, 1e-9);
      const meter = (value) => {
        const bar = h('i');
        bar.style.transform = `scaleX(${(value / most).toFixed(3)})`;
        return h('span', {class: 'meter'}, bar);
      };
      const detail = store.netDetails.get(net.name);
      const advice = {'00': 'no advice', '01': 'advises A', '10': 'advises B'}[net.advice] ?? net.advice;
      return h('div', {class: 'net'}, h('h3', {}, net.name, h('small', {}, advice)),
        h('div', {class: 'bars'}, h('span', {}, 'A'), meter(net.A.concentration), h('span', {}, number(net.A.concentration)),
          h('span', {}, 'B'), meter(net.B.concentration), h('span', {}, number(net.B.concentration))),
        pairs([['Firings', String(net.firings)], ['Deposits', String(net.deposits)], net.source !== null && ['Source', String(net.source)],
               net.exceptions > 0 && ['Exceptions', String(net.exceptions), 'bad']]),
        detail ? this.netTags(detail) : null, detail ? this.marking(net.name, detail.marking) : null);
    }));
  }

  /** What the net does at each of its tags: the sign that robots read, who waits, what it answered last. */
  netTags(net) {
    const last = ({robot, outcome, amount}) => `${outcome === 'refused' ? 'refused' : 'accepted'} robot ${robot}${amount ? `, ${number(amount)}` : ''}`;
    return h('ul', {class: 'net-tags'}, net.tags.map((it) => h('li', {},
      it.fires.length ? h('i', {class: signClass(it), title: it.green ? 'go' : 'stop'}, it.green ? '▲' : '–') : h('i', {class: 'dot'}),
      h('span', {title: it.fires.length ? `Fires ${it.fires.join(', ')}` : ''}, it.tag),
      h('span', {}, it.waiting ? `robot ${it.waiting} waits` : it.last ? last(it.last) : '–'))));
  }

  // A net may have a hundred places; which of them have tokens is for whoever wrote it.
  marking(name, marking) {
    const places = Object.entries(marking ?? {});
    const tokens = places.reduce((sum, [, n]) => sum + n, 0);
    return h('details', {open: this.opened.has(name), ontoggle: (event) => this.opened[event.target.open ? 'add' : 'delete'](name)},
      h('summary', {}, `Marking: ${tokens} token${tokens === 1 ? '' : 's'} on ${places.length} place${places.length === 1 ? '' : 's'}`),
      h('p', {class: 'marks'}, places.map(([place, n]) => h('span', {}, place, n > 1 ? h('b', {}, ` ×${n}`) : null))));
  }
}
