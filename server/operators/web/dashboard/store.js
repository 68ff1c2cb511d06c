// What the page knows, and who wants to hear of changes.
//
//   store.on('robots', draw);  store.emit('robots');

class Store {
  constructor() {
    this.listeners = new Map();
    this.map = null;            // of GET /api/v1/laws: origin_m, width_m, height_m, cell_m
    this.laws = new Map();      // name -> law
    this.layers = new Map();    // name -> Layer (raster.js)
    this.robots = new Map();    // "link/id" -> client, as in GET /api/v1/clients, with antennas
    this.trails = new Map();    // "link/id" -> Trail (robots.js)
    this.tags = [];
    this.nets = [];
    this.netDetails = new Map();
    this.links = new Map();
    this.status = null;
    this.engine = null;
    this.events = [];
    this.peaks = new Map();     // name -> the most that an antenna has sensed
    this.selected = null;       // {kind: 'robot' | 'tag', key}
    this.active = null;         // the pheromone that tools use and that robots' senses show
    this.chosen = false;        // by hand, not by itself
    this.shows = {robots: true, antennas: true, trails: true, tags: true, goals: true, grid: true};
    this.past = null;           // a moment of the time line, or null: live
    this.isReplay = false;      // the page shows a recording
    this.fieldTimeMs = 0;
  }

  on(topic, listener) {
    if (!this.listeners.has(topic)) this.listeners.set(topic, []);
    this.listeners.get(topic).push(listener);
  }

  emit(topic, value) {
    for (const listener of this.listeners.get(topic) ?? []) listener(value);
  }

  select(selected) {
    this.selected = selected;
    this.emit('selected');
  }

  get shownRobots() {
    return this.past ? this.past.robots : this.robots;
  }
}

export const keyOf = (client) => `${client.link}/${client.id}`;
export const store = new Store();
