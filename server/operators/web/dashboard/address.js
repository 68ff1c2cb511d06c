// What is shown, in the page's address, so that a reload, a bookmark or a colleague gets the same: the
// part of the map, layers, what else is drawn, what antennas show, the selection. What is as by default
// is left out.
//
//   #at=5.00,4.20,75&hide=trail&show=guide&auto=path&off=grid&antennas=path&selected=robot+radio-a/1,radio-b/2
import {store} from './store.js';

const WRITE_AFTER_MS = 400;
const TRAILS_KEY = 'pheromone.trails';

const list = (text) => new Set((text ?? '').split(',').filter((it) => it));

export class Address {
  constructor(view) {
    this.view = view;
    this.wanted = new URLSearchParams(location.hash.slice(1));
    this.hidden = list(this.wanted.get('hide'));
    this.shown = list(this.wanted.get('show'));
    this.auto = list(this.wanted.get('auto'));
    for (const key of list(this.wanted.get('off'))) if (key in store.shows) store.shows[key] = false;
    store.isWall = this.wanted.has('wall');
    store.senses = this.wanted.get('antennas');
    store.tool = this.wanted.get('tool');
    const [, kind, key] = /^(robot|tag) (.+)$/.exec(this.wanted.get('selected') ?? '') ?? [];
    if (kind === 'tag') store.select({kind, key: `tag ${key}`});
    else if (kind) store.selectRobots([...list(key)]);
    addEventListener('hashchange', () => location.reload());   // typed in, or a bookmark of this page
    for (const topic of ['shown', 'selected']) store.on(topic, () => this.changed());
  }

  /** To be called once the map is known. */
  applyView() {
    const [x, y, scale] = (this.wanted.get('at') ?? '').split(',').map(Number);
    this.wanted.delete('at');
    if (scale > 0 && Number.isFinite(x + y + scale)) this.view.set(x, y, scale);
  }

  /** To be called with each layer that is new. */
  applyTo(layer) {
    layer.visible = layer.isBlend ? this.shown.has(layer.name) : !this.hidden.has(layer.name);
    if (!layer.isBlend && this.auto.has(layer.name)) layer.setAuto(true);
  }

  changed() {
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.write();
    }, WRITE_AFTER_MS);
  }

  write() {
    if (store.isReplay || !store.map) return;   // what is shown of a recording is not what is live
    const layers = [...store.layers.values()];
    const names = (which) => layers.filter(which).map((it) => it.name).join(',');
    const {view} = this;
    const state = {
      at: view.fitted ? '' : [view.x.toFixed(2), view.y.toFixed(2), Number(view.scale.toPrecision(4))].join(','),
      hide: names((it) => !it.isBlend && !it.visible), show: names((it) => it.isBlend && it.visible), auto: names((it) => it.isAuto),
      off: Object.keys(store.shows).filter((it) => !store.shows[it]).join(','), antennas: store.senses ?? '', tool: store.tool === store.paintable[0]?.name ? '' : store.tool ?? '',
      wall: store.isWall ? '1' : '',
      selected: store.selected ? (store.selected.kind === 'tag' ? store.selected.key : `robot ${[...store.group].join(',')}`) : '',
    };
    this.hidden = list(state.hide);
    this.shown = list(state.show);
    this.auto = list(state.auto);
    const hash = new URLSearchParams(Object.entries(state).filter(([, it]) => it)).toString().replaceAll('%2C', ',').replaceAll('%2F', '/');
    history.replaceState(null, '', location.pathname + location.search + (hash ? `#${hash}` : ''));
  }
}

/** Keeps the trails over a reload, as long as it is the same run of the server. */
export function keepTrails(sessionOf) {
  addEventListener('pagehide', () => {
    if (store.isReplay) return;
    const trails = [...store.trails].map(([key, it]) => [key, it.points.map((x) => Math.round(x * 1000) / 1000)]);
    try {
      sessionStorage.setItem(TRAILS_KEY, JSON.stringify({session: sessionOf(), trails}));
    } catch { /* there is no room: they begin anew */ }
  });
}

/** [key, [x, y, ...]] of each trail that was kept in this run of the server. */
export function keptTrails(session) {
  try {
    const kept = JSON.parse(sessionStorage.getItem(TRAILS_KEY));
    return kept?.session === session ? kept.trails : [];
  } catch { return []; }
}
