// What the page knows, and who wants to hear of changes.
//
//   store.on('robots', draw);  store.emit('robots');

class Store {
  constructor() {
    this.listeners = new Map();
    this.map = null;            // of GET /api/v1/laws: origin_m, width_m, height_m, cell_m
    this.laws = new Map();      // name -> law
    this.layers = new Map();    // name -> Layer (raster.js)
    this.paths = [];            // of GET /api/v1/paths: the configured curves
    this.robots = new Map();    // "link/id" -> client, as in GET /api/v1/clients, with antennas
    this.trails = new Map();    // "link/id" -> Trail (robots.js)
    this.tags = [];
    this.nets = [];
    this.netDetails = new Map();
    this.links = new Map();
    this.status = null;
    this.engine = null;
    this.selected = null;       // {kind: 'robot' | 'tag', key}: whose card is shown
    this.group = new Set();     // keys of the robots that are selected, this one among them
    this.tool = null;           // the pheromone that path, brush and eraser change
    this.senses = null;         // the pheromone that all robots' antennas show; null: each what it follows
    this.shows = {robots: true, antennas: true, trails: true, paths: true, tags: true, goals: true, grid: true};
    this.past = null;           // a moment of the time line, or null: live
    this.isWall = false;        // large type, the map alone
    this.isReplay = false;      // the page shows a recording
    this.fieldTimeMs = 0;
    this.density = null;        // of robots on the map (density.js), or null: each is drawn
    this.typeScale = 1;         // of what is written on the map (appearance.js)
  }

  on(topic, listener) {
    if (!this.listeners.has(topic)) this.listeners.set(topic, []);
    this.listeners.get(topic).push(listener);
  }

  /** The pheromones that path, brush and eraser can change. */
  get paintable() { return [...this.laws.values()].filter((it) => !it.blend); }

  /** A moment of the time line, or null; for whoever needs to know when it becomes past or present. */
  goTo(past) {
    const was = Boolean(this.past);
    this.past = past;
    if (was !== Boolean(past)) this.emit('past');
  }

  emit(topic, value) {
    for (const listener of this.listeners.get(topic) ?? []) listener(value);
  }

  /** One robot, one tag, or null. */
  select(selected) {
    this.group = new Set(selected?.kind === 'robot' ? [selected.key] : []);
    this.selected = selected;
    this.emit('selected');
  }

  /** These robots and no others; the last one is the one in view. */
  selectRobots(keys) {
    this.group = new Set(keys);
    this.selected = keys.length ? {kind: 'robot', key: keys.at(-1)} : null;
    this.emit('selected');
  }

  /** One more robot, or one less. */
  toggleRobot(key) {
    const others = [...this.group].filter((it) => it !== key);
    this.selectRobots(this.group.has(key) ? others : [...others, key]);
  }

  /** Those of the group that are there. */
  get selectedRobots() { return [...this.group].map((it) => this.shownRobots.get(it)).filter((it) => it); }

  get shownRobots() {
    return this.past ? this.past.robots : this.robots;
  }
}

export const keyOf = (client) => `${client.link}/${client.id}`;
export const store = new Store();
