// Puts the page together: the stream fills the store, and the store is drawn.
import {api} from './api.js';
import {commands} from './commands.js';
import {store} from './store.js';
import {byId, h, icon, setText, toast} from './dom.js';
import {Stream} from './stream.js';
import {decodeTiles} from './tiles.js';
import {decodeLog} from './protobuf.js';
import {Blend, Layer} from './raster.js';
import {SwarmMap} from './map.js';
import {Tools} from './tools.js';
import {MANY, Trail, countStates, isHalted, poseNow, stateOf, takeClients} from './robots.js';
import {Address, keepTrails, keptTrails} from './address.js';
import {McapButton, exportButtons} from './export.js';
import {FloorPlan} from './floorplan.js';
import {Charts} from './charts.js';
import {History} from './history.js';
import {Timeline} from './timeline.js';
import {Replay} from './replay.js';
import {LayersPanel} from './panels/layers.js';
import {RobotsPanel} from './panels/robots.js';
import {PlacesPanel} from './panels/places.js';
import {EventList} from './panels/events.js';
import {HealthPanel} from './panels/health.js';
import {setUpHelp, setUpToken} from './dialogs.js';
import {setUpTheme, setUpWall} from './appearance.js';
import {setUpKeys} from './keys.js';
import {mapText} from './describe.js';
import {setUpSheet} from './sheet.js';
import {duration} from './format.js';

const DELTA = '/pheromone_delta/';
const PANELS_EVERY_MS = 400;
const MAP_TEXT_EVERY_MS = 2000;
const OLDER_EVENTS_MS = 1500;   // the stream tells recent ones by itself, if it has any
const text = new TextDecoder();
const asJson = (payload) => JSON.parse(text.decode(payload));

const map = new SwarmMap();
const address = new Address(map.view);
const tools = new Tools(map);
const charts = new Charts(byId('dock'));
const events = new EventList(byId('dock'), showPlace);
const memory = new History();
const timeline = new Timeline(memory, map);
let following = null;
let trailsDrawn = 0;

const layers = new LayersPanel(() => {
  subscribeLayers();
  map.invalidate('base');
}, () => { map.invalidate(); panelsDue.add('robots'); });
map.plan = new FloorPlan(() => map.invalidate('base'));
const robots = new RobotsPanel(tools, (key) => {
  following = following === key ? null : key;
  follow();
}, memory);
const places = new PlacesPanel();
const health = new HealthPanel((name) => replay.enter(name));
byId('side').append(layers.panel.element, robots.panel.element, places.tags.element, places.nets.element,
                    health.links.element, health.server.element, health.recordings.element);
const showSide = setUpSheet([robots, places]);
const theme = setUpTheme(() => {
  map.readTheme();
  for (const layer of store.layers.values()) layer.setTheme(theme.name);
  layers.rebuild();
  charts.themeChanged();
  robots.charts.themeChanged();
});
map.readTheme();
const wall = setUpWall(() => {
  map.invalidate();
  store.emit('shown');
});
const showToken = setUpToken();
const showHelp = setUpHelp();

// ---- the stream -------------------------------------------------------------------------------

const stream = new Stream(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`, showState);
const mcap = new McapButton(stream);
layers.append(exportButtons(map, layers, mcap), map.plan.element);

stream.watch((topic) => topic.startsWith(DELTA), (payload, topic) => {
  const layer = layerOf(topic.slice(DELTA.length));
  const message = decodeTiles(payload);
  const first = !layer.levels;
  layer.take(message);
  if (first) layers.rebuild();
  if (layer.isNeeded) map.invalidate('base');
});
stream.watch('/clients', (payload) => {
  takeClients(asJson(payload), performance.now());
  commands.look();
  if (!replay.active) memory.record();
  panelsDue.add('robots');
  if (store.selected?.kind === 'robot' && !store.past) robots.showCard();   // the same as on the map
  if (!store.past) map.invalidate('top');
  const now = performance.now();
  if (!store.past && now - trailsDrawn > (store.robots.size > MANY ? 300 : 90)) {
    trailsDrawn = now;
    map.invalidate('trails');
  }
  follow();
});
stream.watch((topic) => topic.startsWith('/link/'), (payload) => {
  const link = asJson(payload);
  store.links.set(link.name, link);
  panelsDue.add('links');
});
stream.watch('/nets', (payload) => {
  store.nets = asJson(payload).nets;
  panelsDue.add('nets');
});
// The API is of the present: in a replay, tags come by the stream.
stream.watch((topic) => topic === '/tag_list' && replay.active, (payload) => {
  store.tags = asJson(payload).tags;
  places.load();
  map.invalidate('top');
});
stream.watch('/tag_changes', () => panelsDue.add('tags'));
stream.watch('/status', (payload) => {
  store.status = asJson(payload);
  panelsDue.add('status');
  if (!replay.active) charts.tick(Date.now());
  else if (replay.phase === 'playing') charts.tick(Number(replay.at / 1000000n), false);
});
stream.watch('/laws', (payload) => takeLaws(asJson(payload)));
stream.watch('/paths', (payload) => {
  store.paths = asJson(payload).paths;
  map.invalidate('base');
});
stream.watch('/stats/engine', (payload) => { store.engine = asJson(payload); });
stream.watch('/events', (payload) => events.add(decodeLog(payload)));

stream.onSession = (isNew, session) => {
  if (!isNew) return;
  mcap.end();
  store.links.clear();
  store.trails.clear();
  for (const [key, points] of keptTrails(session)) store.trails.set(key, Trail.from(points));
  store.netDetails.clear();
  memory.clear();
  timeline.live();
};
const replay = new Replay(stream, {
  onEnter() {
    showSide(false);
    beginAnew();
  },
  onLeave() { beginAnew(); },
  onSeek() {
    store.trails.clear();
    store.robots.clear();
    charts.clear();
    map.invalidate('trails', 'top');
  },
});

// Another server, as it were: nothing that is shown is of it.
function beginAnew() {
  mcap.end();
  commands.forget();
  timeline.live();
  for (const it of [store.layers, store.robots, store.trails, store.links, store.laws, store.netDetails]) it.clear();
  Object.assign(store, {tags: [], nets: [], paths: [], status: null, engine: null, tool: null, senses: null});
  stream.paused.clear();
  store.select(null);
  charts.clear();
  events.clear();
  map.readTheme();
  layers.rebuild();
  places.showNets();
  places.show();
  health.showLinks();
  byId('veil').dataset.lost = '';
  map.invalidate();
}
stream.onChannel = (topic) => {
  if (topic.startsWith(DELTA)) layerOf(topic.slice(DELTA.length));
};

// Of those that are shown, or are part of a blend that is.
function subscribeLayers() {
  const all = [...store.layers.values()];
  for (const layer of all) {
    if (layer.isBlend) continue;
    layer.isNeeded = layer.visible || all.some((it) => it.isBlend && it.visible && it.parts.some((part) => part.layer === layer));
    if (layer.isNeeded) stream.resume(DELTA + layer.name);
    else stream.pause(DELTA + layer.name);
  }
  stream.refresh();
}

function layerOf(name) {
  let layer = store.layers.get(name);
  if (!layer) {
    layer = new Layer(name, store.layers.size);
    layer.isNeeded = true;
    addLayer(layer);
  }
  return layer;
}

function addLayer(layer) {
  layer.palette = localStorage.getItem(`palette.${layer.name}`) ?? 'hue';
  layer.setTheme(theme.name);
  address.applyTo(layer);
  store.layers.set(layer.name, layer);
  layers.rebuild();
}

function takeLaws(laws) {
  store.map = laws.map;
  store.laws = new Map(laws.pheromones.map((it) => [it.name, it]));
  if (!store.laws.has(store.tool)) store.tool = null;
  if (!store.laws.has(store.senses)) store.senses = null;
  const named = (type) => laws.pheromones.find((it) => it.type === type)?.name;
  for (const law of laws.pheromones) {
    if (law.blend) {
      const parts = law.blend.map(({type, weight}) => ({layer: layerOf(named(type)), weight}));
      addLayer(new Blend(law.name, store.layers.get(law.name)?.index ?? store.layers.size, parts));
    } else {
      layerOf(law.name).setLaw(law);
    }
  }
  subscribeLayers();
  if (JSON.stringify(map.view.map) !== JSON.stringify(laws.map)) {
    map.view.setMap(laws.map);
    address.applyView();
  }
  store.emit('laws');
  layers.rebuild();
}

async function loadTags() {
  if (replay.active) return;
  const all = [];
  try {
    for (let first = 1; first !== null;) {
      const page = await api.get(`tags?first=${first}`);
      all.push(...page.tags);
      first = page.next;
    }
    store.tags = all;
    await places.load();
    map.invalidate('top');
  } catch { /* the next change tells again */ }
}

async function loadNets() {
  places.showNets();
  if (replay.active) return;   // the API is of the present
  for (const net of store.nets) {
    try {
      store.netDetails.set(net.name, await api.get(`nets?net=${encodeURIComponent(net.name)}`));
    } catch { store.netDetails.delete(net.name); }
  }
  places.showNets();
  places.show();
  map.invalidate('top');
}

// ---- what is shown ------------------------------------------------------------------------------

function showState(state, retryAt) {
  const box = byId('link-state');
  const told = {connecting: 'Connecting …', live: replay.active ? 'Replay' : store.past ? 'The past' : 'Live', stale: 'No data', lost: 'Connection lost'}[state];
  const reconnecting = state === 'connecting' && box.dataset.state === 'lost';
  box.dataset.state = reconnecting ? 'lost' : state;
  setText(box.lastElementChild, told);
  if (state === 'live' && byId('veil').dataset.lost !== 'no') {
    byId('veil').dataset.lost = 'no';
    loadTags();
    health.loadRecordings();
    setTimeout(() => { if (!replay.active) events.loadOlder(); }, OLDER_EVENTS_MS);
  } else if (state !== 'live' && state !== 'connecting') {
    byId('veil').dataset.lost = state;
  }
  showState.retryAt = retryAt;
  showVeil();
}

function showVeil() {
  const veil = byId('veil');
  const lost = veil.dataset.lost;
  veil.hidden = !lost || lost === 'no';
  if (veil.hidden) { veil.replaceChildren(); return; }
  const wait = Math.max(0, Math.ceil(((showState.retryAt ?? 0) - performance.now()) / 1000));
  const detail = lost === 'stale' ? 'The server is silent. What you see may be old.'
    : wait > 0 ? `What you see is old. Retrying in ${wait} s …` : 'What you see is old. Retrying …';
  if (veil.textContent !== 'Connection lost' + detail) {
    veil.replaceChildren(h('div', {}, h('h2', {}, 'Connection lost'), h('p', {}, detail)));
  }
}

const facts = new Map();
function fact(name, value) {
  if (!facts.has(name)) {
    const dd = h('dd');
    facts.set(name, dd);
    byId('facts').append(h('div', {}, h('dt', {}, name), dd));
  }
  setText(facts.get(name), value);
}

const panelsDue = new Set(['robots']);
function showPanels() {
  const due = new Set(panelsDue);
  panelsDue.clear();
  if (due.has('robots')) {
    robots.show();
    layers.show();
    fact('Robots', countStates(store.robots.values()) || '0');
    showHalted();
    fact('Map time', duration(store.fieldTimeMs / 1000));
  }
  if (due.has('links')) health.showLinks();
  if (due.has('status') && store.status) {
    health.showServer();
    timeline.showRecording();
    if (!replay.active) fact('Links', `${store.status.links_up} of ${store.status.links} up`);
  }
  if (due.has('tags')) loadTags();
  if (due.has('nets')) loadNets();
}
setInterval(showPanels, PANELS_EVERY_MS);
setInterval(showVeil, 500);
setInterval(() => byId('top').setAttribute('aria-label', mapText()), MAP_TEXT_EVERY_MS);

/** Of an event: a robot, or a point of the map. */
function showPlace({robot, x, y}) {
  const pose = store.shownRobots.get(robot)?.pose;
  if (robot) store.select({kind: 'robot', key: robot});
  if (robot ? pose : true) map.view.centre(pose?.x_m ?? x, pose?.y_m ?? y);
}

function follow() {
  const robot = following && store.robots.get(following);
  if (robot?.pose && !store.past) {
    const pose = poseNow(robot, performance.now());
    map.view.centre(pose.x_m, pose.y_m);
  }
}

store.on('robots', () => panelsDue.add('robots'));
store.on('past', () => showState(stream.state, showState.retryAt));
store.on('shown', () => { if (stream.recording) stream.refresh(); });   // what is recorded is what is shown
store.on('events', () => fact('New warnings', String(events.unseen)));
store.on('selected', () => {
  if (following && store.selected?.key !== following) following = null;
  robots.show();
  map.invalidate('trails', 'top');
});

api.onToken = () => {
  showToken();
  tools.tokenChanged();
  byId('halt-all').disabled = !api.token;
  byId('halt-all').title = !api.token ? 'Halting needs the token: "Unlock"'
    : replay.active ? 'Halt every robot that is running now, not those of the recording (Shift+H)' : 'Halt every robot (Shift+H)';
  timeline.showRecording();
  health.showServer();
  robots.show();
};
api.onToken();

async function haltAll() {
  if (!api.token) { toast('Halting needs the token: "Unlock" above', true); return; }
  commands.forget();
  try {
    const {links, down} = await api.post('halt', {});
    const missed = down.map((it) => `${it.name} is down: its robots were not told`);
    toast([`Halt sent on ${links.length} of ${links.length + down.length} link${links.length + down.length === 1 ? '' : 's'}`, ...missed].join('; '), missed.length > 0);
  } catch (error) {
    toast(`NOT halted: ${error.message}`, true);
  }
}
byId('halt-all').addEventListener('click', haltAll);

// While anybody is halted, and of whom it is not sure.
function showHalted() {
  const all = [...store.robots.values()];
  const halted = all.filter(isHalted);
  const unsure = all.filter((it) => stateOf(it) === 'alarm' && /halt/.test(it.state?.reason ?? ''));
  const silent = all.filter((it) => stateOf(it) === 'silent');
  const namesOf = (robots) => robots.map((it) => `robot ${it.id}`).join(', ');
  const box = byId('halted');
  box.hidden = replay.active || halted.length + unsure.length === 0;
  setText(box.firstElementChild, `${halted.length} of ${all.length} halted` +
    (unsure.length ? `; not yet: ${namesOf(unsure)}` : '') + (silent.length ? `; silent: ${namesOf(silent)}` : ''));
  byId('resume-all').disabled = api.refusal !== '';
  byId('resume-all').title = api.refusal ? 'Resuming needs the token: "Unlock"' : 'Every halted robot drives on';
}

byId('resume-all').addEventListener('click', () => {
  commands.send([...store.robots.values()].filter(isHalted).map((it) => it.key), 'resume');
});
byId('zoom').append(...[['Zoom in (+)', ['M12 6v12', 'M6 12h12'], () => map.view.zoom(1.4)],
                        ['Zoom out (−)', ['M6 12h12'], () => map.view.zoom(1 / 1.4)],
                        ['Fit (0)', ['M5 9V5h4', 'M19 9V5h-4', 'M5 15v4h4', 'M19 15v4h-4'], () => map.view.fit()],
                        ['Wall mode: large type, the map alone (W)', ['M3.5 5h17v11h-17z', 'M9 20h6'], () => wall.toggle()]]
  .map(([title, paths, go]) => h('button', {type: 'button', title, 'aria-label': title, onclick: go}, icon(...paths))));

setUpKeys({map, tools, robots, layers, timeline, replay, theme, wall, haltAll, showHelp});
keepTrails(() => stream.session);
stream.connect();

// For measurements and tests.
window.pheromone = {map, store, stream, memory, replay};
