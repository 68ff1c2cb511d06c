// A picture of the room under the map, such as a floor plan or a photograph from the ceiling: chosen from
// this machine's files, placed by its lower left corner and its width. It is kept in this browser alone,
// and never sent to the server.
import {store} from './store.js';
import {dataUrl, h, toast} from './dom.js';

const KEY = 'floorplan';
const PLACES = {x: 'x', y: 'y', width: 'Width'};

export class FloorPlan {
  constructor(onChange) {
    this.onChange = onChange;
    this.image = null;
    this.place = {x: 0, y: 0, width: 1, opacity: 0.6};
    this.file = h('input', {type: 'file', id: 'floorplan-file', accept: 'image/png,image/jpeg,image/webp,image/gif', 'aria-label': 'Picture under the map',
                            onchange: () => this.choose(this.file.files[0])});
    this.inputs = Object.fromEntries(Object.entries(PLACES).map(([key, name]) => [key, h('input', {
      type: 'number', step: 0.01, name: `floorplan-${key}`, 'aria-label': `${name} of the floor plan, in metres`, oninput: () => this.change()})]));
    this.opacity = h('input', {type: 'range', min: 0.1, max: 1, step: 0.05, name: 'floorplan-opacity', 'aria-label': 'Opacity of the floor plan', oninput: () => this.change()});
    this.settings = h('div', {class: 'plan', hidden: true},
      ...Object.entries(PLACES).map(([key, name]) => h('label', {}, name, this.inputs[key], 'm')), this.opacity,
      h('button', {type: 'button', id: 'floorplan-remove', onclick: () => this.remove()}, 'Remove'));
    this.element = h('details', {class: 'floorplan'}, h('summary', {}, 'Picture under the map'), this.file, this.settings);
    this.restore();
  }

  async restore() {
    try {
      const kept = JSON.parse(localStorage.getItem(KEY));
      if (!kept) return;
      const image = new Image();
      image.src = kept.url;
      await image.decode();
      await this.use(image, kept.place);
      this.url = kept.url;
    } catch { localStorage.removeItem(KEY); }
  }

  async choose(file) {
    if (!file || !store.map) return;
    const {origin_m: [x, y], width_m: width} = store.map;
    try {
      await this.use(file, {x, y, width, opacity: 0.6});
    } catch {
      toast(`${file.name} is not a picture that this browser can show`, true);
      return;
    }
    this.url = await dataUrl(file);
    this.keep();
  }

  async use(source, place) {
    this.image = await createImageBitmap(source);
    this.place = place;
    for (const key of Object.keys(PLACES)) this.inputs[key].value = place[key];
    this.opacity.value = place.opacity;
    this.settings.hidden = false;
    this.onChange();
  }

  change() {
    const read = Object.fromEntries(Object.entries(this.inputs).map(([key, it]) => [key, it.valueAsNumber]));
    if (!Object.values(read).every(Number.isFinite) || read.width <= 0) return;
    this.place = {...read, opacity: this.opacity.valueAsNumber};
    this.keep();
    this.onChange();
  }

  keep() {
    if (!this.url) return;
    try {
      localStorage.setItem(KEY, JSON.stringify({url: this.url, place: this.place}));
    } catch {
      localStorage.removeItem(KEY);
      if (!this.told) toast('The picture is too large to be kept: it is shown until the page is closed', true);
      this.told = true;
    }
  }

  remove() {
    this.image = null;
    this.url = null;
    this.file.value = '';
    this.settings.hidden = true;
    localStorage.removeItem(KEY);
    this.onChange();
  }

  draw(context, view) {
    if (!this.image) return;
    const {x, y, width, opacity} = this.place;
    const height = (width * this.image.height) / this.image.width;
    context.globalAlpha = opacity;
    context.imageSmoothingEnabled = true;
    context.drawImage(this.image, view.sx(x), view.sy(y + height), width * view.scale, height * view.scale);
    context.globalAlpha = 1;
  }
}
