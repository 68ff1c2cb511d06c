// A row for each pheromone: shown or not, its colours, its scale; and what else is drawn.
import {store} from '../store.js';
import {byId, h, panel, setText} from '../dom.js';
import {PALETTES, paintRamp} from '../palettes.js';
import {number} from '../format.js';
import {fullLine, pheromoneOf} from '../robots.js';
import {densityLut} from '../density.js';

const SHOWS = {robots: 'Robots', antennas: 'Antennas', trails: 'Trails', paths: 'Paths', tags: 'Tags', goals: 'Goals', grid: 'Grid'};
const OWN = 'what each robot follows';

export class LayersPanel {
  constructor(onVisible, onChange) {
    this.onVisible = onVisible;
    this.onChange = onChange;
    this.panel = panel('layers', 'Pheromones');
    this.list = h('div');
    this.boxes = new Map();
    this.senses = h('select', {id: 'senses', onchange: () => this.showSenses(this.senses.value || null)});
    this.panel.body.append(this.list, h('div', {class: 'switches'}, Object.entries(SHOWS).map(([key, name]) => {
      const box = h('input', {type: 'checkbox', checked: store.shows[key], name: key, onchange: () => this.toggleShow(key)});
      this.boxes.set(key, box);
      return h('label', {}, box, name);
    })), h('label', {class: 'senses-of'}, 'Antennas show', this.senses));
    this.rows = new Map();
  }

  toggleShow(key) {
    store.shows[key] = !store.shows[key];
    this.boxes.get(key).checked = store.shows[key];
    this.changed();
  }

  toggleLayer(layer) {
    if (!layer) return;
    layer.visible = !layer.visible;
    this.onVisible();
    this.show();
    this.changed();
  }

  /** Of which pheromone robots' antennas and meters show what is sensed; null: of what each follows. */
  showSenses(name) {
    store.senses = name;
    this.show();
    this.changed();
  }

  changed() {
    this.onChange();
    store.emit('shown');
  }

  append(...elements) { this.panel.body.append(...elements); }

  /** After the list of layers, their palettes or the theme changed. */
  rebuild() {
    this.rows.clear();
    this.list.replaceChildren(...[...store.layers.values()].map((layer) => this.row(layer)));
    if (store.layers.size === 0) this.list.replaceChildren(h('p', {class: 'empty'}, 'No pheromones yet'));
    this.senses.replaceChildren(h('option', {value: ''}, OWN), ...[...store.laws.keys()].map((it) => h('option', {value: it}, it)));
    this.show();
    this.legend();
  }

  row(layer) {
    const law = store.laws.get(layer.name);
    const box = h('input', {type: 'checkbox', checked: layer.visible, 'aria-label': `Show ${layer.name}`, onchange: () => this.toggleLayer(layer)});
    const name = h('button', {type: 'button', class: 'name', title: `${factsOf(law)}\nAll antennas show “${layer.name}”, or again what each robot follows`,
                              onclick: () => this.showSenses(store.senses === layer.name ? null : layer.name)},
                   layer.name, h('small', {}, factsOf(law, true)));
    const ramp = this.ramp(layer);
    const swatch = h('button', {type: 'button', class: `ramp${layer.repels ? ' repels' : ''}`, title: 'Change the colours', 'aria-label': `Colours of ${layer.name}`, onclick: () => {
      layer.setPalette(PALETTES[(PALETTES.indexOf(layer.palette) + 1) % PALETTES.length]);
      localStorage.setItem(`palette.${layer.name}`, layer.palette);
      swatch.replaceChildren(this.ramp(layer));
      this.legend();
      this.onChange();
    }}, ramp);
    const scale = h('button', {type: 'button', class: 'scale', disabled: Boolean(layer.isBlend), onclick: () => {
      layer.setAuto(!layer.isAuto);
      this.show();
      this.changed();
    }});
    const element = h('div', {class: 'layer', 'data-layer': layer.name}, box, name, swatch, scale);
    this.rows.set(layer.name, {element, box, scale, layer});
    return element;
  }

  /** The scale's colours, of its whole range, whatever part of it is there now. */
  ramp(layer) {
    const canvas = h('canvas');
    paintRamp(canvas, layer.rampLut, layer.isSigned && !layer.repels ? layer.repelsLut : null);
    return canvas;
  }

  show() {
    for (const {element, box, scale, layer} of this.rows.values()) {
      box.checked = layer.visible;
      element.classList.toggle('active', layer.name === store.senses);
      setText(scale, layer.levels ? (layer.isAuto ? `auto ${number(layer.range)}` : endsOf(layer).join('–')) : '–');
      scale.title = layer.isBlend ? 'The weighted sum of its parts at their maxima'
        : layer.isAuto ? 'The colours end at what is on the map now. Click: at the maximum of its law'
          : 'The colours end at the maximum of its law. Click: at what is on the map now (auto)';
      scale.setAttribute('aria-pressed', String(layer.isAuto));
    }
    this.senses.value = store.senses ?? '';
    const signature = [...store.layers.values()].map((it) => `${it.name}${it.visible}${it.range}${it.isAuto}`).join() + this.antennas() + (store.density ? `${store.density.cellM} ${store.density.most}` : '');
    if (signature !== this.signature) this.legend();
    this.signature = signature;
  }

  // What the antennas show, and the end of their scale.
  antennas() {
    if (!store.shows.antennas || !store.shows.robots || !store.map || store.density) return '';
    const names = [...new Set([...store.shownRobots.values()].map(pheromoneOf))].filter((it) => store.laws.has(it)).sort();
    return names.slice(0, 3).map((it) => `${it} 0–${number(fullLine(store.laws.get(it), store.laws, store.map.cell_m))}`).join(', ');
  }

  density({cellM, most}) {
    const canvas = h('canvas');
    paintRamp(canvas, densityLut(store.layers.size, document.documentElement.dataset.theme));
    return h('div', {class: 'density', title: 'There are too many to draw each: zoom in'}, h('b', {}, 'Robots', h('small', {}, `in ${number(cellM)} m × ${number(cellM)} m`)),
             h('span', {class: 'ramp'}, canvas), h('span', {class: 'ticks'}, h('span', {}, '0'), h('span', {}, most % 2 ? '' : number(most / 2)), h('span', {}, number(most))));
  }

  // On the map, for whoever sees it from afar.
  legend() {
    const visible = [...store.layers.values()].filter((it) => it.visible && it.levels);
    const antennas = this.antennas();
    byId('legend').replaceChildren(...visible.slice(0, 6).map((layer) => {
      const ends = endsOf(layer);
      return h('div', {class: layer.repels ? 'repels' : ''},
               h('b', {}, layer.name, layer.repels ? h('small', {}, ' repels') : layer.isBlend ? h('small', {}, ' blend') : null), h('span', {class: `ramp${layer.repels ? ' repels' : layer.isSigned ? ' half-repels' : ''}`}, this.ramp(layer)),
               h('span', {class: 'ticks'}, h('span', {}, ends[0]), h('span', {}, number(middleOf(layer))), h('span', {}, ends[1], layer.isAuto ? ' auto' : '')));
    }), ...(store.density ? [this.density(store.density)] : []), ...(visible.length > 6 ? [h('div', {}, `and ${visible.length - 6} more`)] : []),
    ...(antennas ? [h('div', {class: 'antennas', title: 'Full: in the middle of a straight line of full nodes'}, h('b', {}, 'Antennas'), h('span', {}, `P of ${antennas} units`))] : []));
  }
}

const middleOf = ({ends: [low, high]}) => (low + high) / 2;
const endsOf = (layer) => layer.ends.map((it) => number(it).replace('-', '−'));

function factsOf(law, short = false) {
  if (!law) return '';
  if (law.blend) {
    const parts = law.blend.map(({type, weight}) => `${weight === 1 ? '' : `${number(weight).replace('-', '−')} `}${[...store.laws.values()].find((it) => it.type === type)?.name ?? type}`);
    return short ? 'blend' : `blend: ${parts.join(' + ').replaceAll('+ −', '− ')}`;
  }
  const time = law.tau_s ? `${law.evaporation === 'exponential' ? 'T½' : 'τ'} ${number(law.tau_s)} s` : 'τ ∞';
  return law.weight < 0 ? `repels${short ? '' : `, ${time}`}` : time;
}
