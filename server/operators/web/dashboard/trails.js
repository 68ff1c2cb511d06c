// The trails' canvas on the page's side: it tells the worker what to draw, one picture at a time, and
// moves the last picture with the map until the next one is there.
import {store} from './store.js';

export class TrailsCanvas {
  constructor(element) {
    this.element = element;
    this.worker = new Worker(new URL('./trails_worker.js', import.meta.url));
    const canvas = element.transferControlToOffscreen();
    this.worker.postMessage({canvas}, [canvas]);
    this.drawn = null;     // the view of the picture on screen
    this.isDrawing = false;
    this.next = null;      // what to draw after that
    this.worker.onmessage = ({data}) => {
      this.drawn = data;
      this.isDrawing = false;
      if (this.view) this.place(this.view);
      this.next?.();
    };
  }

  draw(view, ratio, theme) {
    this.next = null;
    if (this.isDrawing) {
      this.next = () => this.draw(view, ratio, theme);
      return;
    }
    const {points, ends, selected} = pack();
    this.isDrawing = true;
    this.worker.postMessage({
      points, ends, selected, colours: {ink: theme.ink, accent: theme.accent},
      view: {x: view.x, y: view.y, scale: view.scale, width: view.width, height: view.height, ratio},
    }, [points.buffer]);
  }

  /** With each frame. */
  place(view) {
    this.view = view;
    if (!this.drawn) return;
    const {x, y, scale} = this.drawn;
    const transform = x === view.x && y === view.y && scale === view.scale ? ''
      : `translate(${(x - view.x) * view.scale}px, ${(view.y - y) * view.scale}px) scale(${view.scale / scale})`;
    if (transform !== this.transform) this.element.style.transform = transform;
    this.transform = transform;
  }
}

/** All points of all trails, each from its oldest on; of the past, and of a density, none. */
function pack() {
  const trails = store.shows.trails && !store.past && !store.density ? store.trails : new Map();
  let length = 0;
  for (const trail of trails.values()) length += trail.length;
  const points = new Float32Array(2 * length);
  const ends = [];
  let selected = -1;
  let at = 0;
  for (const [key, trail] of trails) {
    if (store.selected?.key === key) selected = ends.length;
    for (let i = 0; i < trail.length; i += 1) {
      const from = trail.at(i);
      points[at] = trail.x[from];
      points[at + 1] = trail.y[from];
      at += 2;
    }
    ends.push(at / 2);
  }
  return {points, ends, selected};
}
