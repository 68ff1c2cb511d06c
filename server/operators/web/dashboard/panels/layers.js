// A row for each pheromone: shown or not, which tools use, its scale; and what else is drawn.
import {store} from '../store.js';
import {byId, h, panel, setText} from '../dom.js';
import {PALETTES, paintRamp} from '../palettes.js';
import {number} from '../format.js';

const SHOWS = {robots: 'Robots', antennas: 'Antennas', trails: 'Trails', tags: 'Tags', goals: 'Goals', grid: 'Grid'};

export class LayersPanel {
  constructor(onVisible, onChange) {
    this.onVisible = onVisible;
    this.onChange = onChange;
    this.panel = panel('layers', 'Pheromones');
    this.list = h('div');
    this.boxes = new Map();
    this.panel.body.append(this.list, h('div', {class: 'switches'}, Object.entries(SHOWS).map(([key, name]) => {
      const box = h('input', {type: 'checkbox', checked: true, name: key, onchange: () => this.toggleShow(key)});
      this.boxes.set(key, box);
      return h('label', {}, box, name);
    })));
    this.rows = new Map();
  }

  toggleShow(key) {
    store.shows[key] = !store.shows[key];
    this.boxes.get(key).checked = store.shows[key];
    this.onChange();
  }

  toggleLayer(layer) {
    if (!layer) return;
    layer.visible = !layer.visible;
    this.onVisible(layer);
    this.show();
  }

  /** After the list of layers, their palettes or the theme changed. */
  rebuild() {
    this.rows.clear();
    this.list.replaceChildren(...[...store.layers.values()].map((layer) => this.row(layer)));
    if (store.layers.size === 0) this.list.replaceChildren(h('p', {class: 'empty'}, 'No pheromones yet'));
    this.show();
    this.legend();
  }

  row(layer) {
    const law = store.laws.get(layer.name);
    const box = h('input', {type: 'checkbox', checked: layer.visible, 'aria-label': `Show ${layer.name}`, onchange: () => this.toggleLayer(layer)});
    const facts = law?.blend ? 'blend' : law?.tau_s ? `${law.evaporation === 'exponential' ? 'T½' : 'τ'} ${number(law.tau_s)} s` : law ? 'τ ∞' : '';
    const name = h('button', {type: 'button', class: 'name', title: `Use “${layer.name}” for tools and for what robots show`, onclick: () => {
      store.active = layer.name;
      store.chosen = true;
      store.emit('active');
    }}, layer.name, h('small', {}, facts));
    const ramp = h('canvas');
    paintRamp(ramp, layer.lut);
    const swatch = h('button', {type: 'button', class: 'ramp', title: 'Change the colours', 'aria-label': `Colours of ${layer.name}`, onclick: () => {
      layer.setPalette(PALETTES[(PALETTES.indexOf(layer.palette) + 1) % PALETTES.length]);
      localStorage.setItem(`palette.${layer.name}`, layer.palette);
      paintRamp(ramp, layer.lut);
      this.legend();
      this.onChange();
    }}, ramp);
    const scale = h('span', {class: 'scale', title: 'Full colour means this level'});
    const element = h('div', {class: 'layer', 'data-layer': layer.name}, box, name, swatch, scale);
    this.rows.set(layer.name, {element, box, scale, layer});
    return element;
  }

  show() {
    for (const {element, box, scale, layer} of this.rows.values()) {
      box.checked = layer.visible;
      element.classList.toggle('active', layer.name === store.active);
      setText(scale, layer.levels ? `0–${number(layer.scale)}` : '–');
    }
    const signature = [...store.layers.values()].map((it) => `${it.name}${it.visible}${it.scale}`).join() + store.active;
    if (signature !== this.signature) this.legend();
    this.signature = signature;
  }

  // On the map, for whoever sees it from afar.
  legend() {
    const visible = [...store.layers.values()].filter((it) => it.visible && it.levels);
    const shown = visible.length <= 4 ? visible : visible.filter((it) => it.name === store.active);
    byId('legend').replaceChildren(...shown.map((layer) => {
      const canvas = h('canvas');
      paintRamp(canvas, layer.lut);
      return h('div', {}, h('b', {}, layer.name), canvas,
               h('span', {class: 'ticks'}, ...[0, 0.5, 1].map((it) => h('span', {}, number(it * layer.scale)))));
    }));
  }
}
