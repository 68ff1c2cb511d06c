// Which part of the map is on screen: x to the right and y up in metres, pixels from the top left.
// Mouse, touch and pen gestures are turned into calls of the tool in hand.

const LEAST_SCALE = 0.02;  // pixels a metre
const MOST_SCALE = 5000;
const CLICK_PX = 4;

export class View {
  constructor(element, onChange) {
    this.element = element;
    this.onChange = onChange;
    this.scale = 50;
    this.x = 0;              // the middle of the screen, in metres
    this.y = 0;
    this.width = 1;
    this.height = 1;
    this.fitted = true;      // follows the size of the window until moved by hand
    this.pointers = new Map();
    this.tool = null;        // {drags, down, move, up, click, hover, cancel}: each may be missing
    new ResizeObserver(() => this.resize()).observe(element);
    element.addEventListener('wheel', (event) => this.wheel(event), {passive: false});
    element.addEventListener('pointerdown', (event) => this.down(event));
    element.addEventListener('pointermove', (event) => this.move(event));
    element.addEventListener('pointerup', (event) => this.up(event));
    element.addEventListener('pointercancel', (event) => this.up(event, true));
    element.addEventListener('pointerleave', () => this.tool?.hover?.(null));
    element.addEventListener('dblclick', (event) => this.tool?.double?.(this.toMap(event)));
    element.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  resize() {
    const box = this.element.getBoundingClientRect();
    this.width = Math.max(1, box.width);
    this.height = Math.max(1, box.height);
    if (this.fitted) this.fit();
    else this.onChange();
  }

  setMap(map) {
    this.map = map;
    this.fit();
  }

  fit() {
    this.fitted = true;
    if (this.map) {
      const left = this.width > 700 ? 70 : 20;
      const {origin_m: [x, y], width_m: width, height_m: height} = this.map;
      this.scale = Math.max(LEAST_SCALE, Math.min((this.width - left * 2) / width, (this.height - 60) / height));
      this.x = x + width / 2;
      this.y = y + height / 2;
    }
    this.onChange();
  }

  sx(x) { return (x - this.x) * this.scale + this.width / 2; }
  sy(y) { return (this.y - y) * this.scale + this.height / 2; }

  toMap(event) {
    const box = this.element.getBoundingClientRect();
    return {x: (event.clientX - box.left - this.width / 2) / this.scale + this.x,
            y: this.y - (event.clientY - box.top - this.height / 2) / this.scale};
  }

  pan(dx, dy) {
    this.fitted = false;
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.onChange();
  }

  /** About a point of the map, which stays where it is. */
  zoom(factor, about = {x: this.x, y: this.y}) {
    const scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    const by = this.scale / scale;
    this.x = about.x + (this.x - about.x) * by;
    this.y = about.y + (this.y - about.y) * by;
    this.scale = scale;
    this.fitted = false;
    this.onChange();
  }

  set(x, y, scale) {
    Object.assign(this, {x, y, scale: Math.min(MOST_SCALE, Math.max(LEAST_SCALE, scale)), fitted: false});
    this.onChange();
  }

  centre(x, y) {
    this.x = x;
    this.y = y;
    this.fitted = false;
    this.onChange();
  }

  wheel(event) {
    event.preventDefault();
    const step = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
    this.zoom(Math.exp(-Math.max(-120, Math.min(120, step)) * 0.0022), this.toMap(event));
  }

  down(event) {
    if (event.target.closest('button, label, input, select, form, .options')) return;
    this.element.focus({preventScroll: true});
    this.element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (this.pointers.size === 1) {
      this.moved = 0;
      this.pinched = false;
      this.pans = !this.tool?.down || event.button === 1 || event.button === 2 || this.tool.drags?.(event) === false;
      if (!this.pans) this.tool.down(this.toMap(event));
    } else {
      if (!this.pans) this.tool.cancel?.();
      this.pans = true;
      this.pinched = true;
    }
    this.cursor();
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) {
      if (event.pointerType !== 'touch') this.tool?.hover?.(this.toMap(event));
      return;
    }
    const before = this.spread();
    const dx = event.clientX - last.x;
    const dy = event.clientY - last.y;
    last.x = event.clientX;
    last.y = event.clientY;
    this.moved += Math.hypot(dx, dy);
    if (!this.pans) {
      this.tool.move?.(this.toMap(event));
    } else if (this.pointers.size === 1) {
      if (this.moved > CLICK_PX) this.pan(dx, dy);
    } else {
      const after = this.spread();
      this.pan(after.x - before.x, after.y - before.y);
      this.zoom(after.size / before.size, this.toMap({clientX: after.x, clientY: after.y}));
    }
  }

  up(event, cancelled = false) {
    if (!this.pointers.delete(event.pointerId)) return;
    if (this.pointers.size > 0) return;
    if (!this.pans) {
      if (cancelled) this.tool.cancel?.();
      else this.tool.up?.(this.toMap(event), event);
    } else if (!cancelled && !this.pinched && this.moved <= CLICK_PX && event.button === 0) {
      this.tool?.click?.(this.toMap(event), event);
    }
    this.pans = false;
    this.cursor();
  }

  spread() {
    const [a, b] = [...this.pointers.values()];
    if (!b) return {x: a.x, y: a.y, size: 1};
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y))};
  }

  cursor(over = false) {
    const drags = this.pointers.size > 0 && this.pans;
    this.element.dataset.cursor = drags ? 'grabbing' : this.tool?.cursor ?? (over ? 'pick' : 'grab');
  }
}
