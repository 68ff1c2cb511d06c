// Robots on the map: heading, antennas with what they sense, and a trail that fades. A robot is drawn
// between its last two poses, so that ten reports a second look like movement.
import {store, keyOf} from './store.js';
import {css} from './palettes.js';
import {number} from './format.js';
import {fontOf, write} from './places.js';
import {densityOf, drawDensity} from './density.js';

const TRAIL_POINTS = 200;
const TRAIL_STEP_M = 0.02;   // less is no movement worth a point
const GLIDE_MS = 120;
const FRESH_S = 3;
export const MANY = 60;   // robots: what costs most is left out
const DENSE = 500;        // more of them in view are drawn as a density
const MARGIN_PX = 60;

export class Trail {
  constructor() {
    this.x = new Float32Array(TRAIL_POINTS);
    this.y = new Float32Array(TRAIL_POINTS);
    this.next = 0;
    this.length = 0;
  }

  static from(points) {
    const trail = new Trail();
    for (let i = 0; i < points.length; i += 2) trail.add(points[i], points[i + 1]);
    return trail;
  }

  add(x, y) {
    if (this.length > 0) {
      const last = (this.next + TRAIL_POINTS - 1) % TRAIL_POINTS;
      const moved = Math.hypot(x - this.x[last], y - this.y[last]);
      if (moved < TRAIL_STEP_M) return;
      if (moved > 2) this.length = 0;  // it was carried: no line across the map
    }
    this.x[this.next] = x;
    this.y[this.next] = y;
    this.next = (this.next + 1) % TRAIL_POINTS;
    this.length = Math.min(this.length + 1, TRAIL_POINTS);
  }

  /** x, y, ... from the oldest on. */
  get points() {
    return Array.from({length: 2 * this.length}, (_, i) => (i % 2 ? this.y : this.x)[this.at(i >> 1)]);
  }

  at(i) {  // 0: the oldest
    return (this.next + TRAIL_POINTS - this.length + i) % TRAIL_POINTS;
  }
}

export const isFresh = (client) => client.known !== false && client.silent_s !== null && client.silent_s < FRESH_S;

// How each state is shown: colour, and a shape of its own for who cannot tell colours.
const SHOWN = {
  'driving': 'good', 'going to its goal': 'good', 'at its goal': 'goal', 'halted': 'held', 'standing': 'held',
  'trail lost': 'warn', 'off the map': 'warn', 'refused': 'warn', 'only HELLO': 'warn', 'alarm': 'bad', 'silent': '',
};
const ORDER = Object.keys(SHOWN);

/** What a robot is doing; the server computes it (control/condition.h). Old recordings do not tell. */
export const stateOf = (robot) => robot.state?.is ?? (isFresh(robot) ? 'standing' : 'silent');
export const shownAs = (robot) => SHOWN[stateOf(robot)] ?? 'warn';
export const isHalted = (robot) => stateOf(robot) === 'halted';

/** "4 driving · 2 halted". */
export function countStates(robots) {
  const counts = new Map();
  for (const robot of robots) counts.set(stateOf(robot), (counts.get(stateOf(robot)) ?? 0) + 1);
  return [...counts].sort((a, b) => ORDER.indexOf(a[0]) - ORDER.indexOf(b[0])).map(([state, count]) => `${count} ${state}`).join(' · ');
}

/** The pheromone that a robot's antennas show: what it follows, unless one is chosen for all. */
export const pheromoneOf = (robot) => store.senses ?? robot.follows ?? null;
/** What it senses of that: {left, right}, in units. */
export const sensedOf = (robot) => robot.antennas?.pheromones?.[pheromoneOf(robot)];

/**
 * What an antenna senses in the middle of a straight line of full nodes: the end of the antennas'
 * scale. (Intensity is a sum over the nodes in reach; a wide patch of full nodes gives more.)
 */
export function fullLine(law, laws, cellM) {
  if (!law) return 1;
  if (law.blend) {
    const parts = law.blend.map(({type, weight}) => [[...laws.values()].find((it) => it.type === type), weight]);
    return parts.reduce((sum, [part, weight]) => sum + (part?.weight ? Math.abs(weight / part.weight) * fullLine(part, laws, cellM) : 0), 0) || 1;
  }
  const strength = (d) => (law.profile === 'gaussian' ? Math.exp(-(d * d) / (2 * law.sigma_m ** 2))
    : Math.max(0, Math.min(1, (law.core_m + law.sigma_m - d) / law.sigma_m)));
  let sum = strength(0);
  for (let i = 1; i * cellM <= law.reach_m + 1e-9; i += 1) sum += (law.directional ? 1 : 2) * strength(i * cellM);
  return sum * law.maximum * Math.abs(law.weight);
}

/** What share of the antennas' scale this is. */
export function shareOf(robot, side) {
  const sensed = sensedOf(robot)?.[side];
  if (!sensed) return 0;
  return Math.min(1, Math.abs(sensed) / fullLine(store.laws.get(pheromoneOf(robot)), store.laws, store.map?.cell_m ?? 0.1));
}

/** Takes a message of /clients. */
export function takeClients(message, now) {
  store.fieldTimeMs = message.field_time_ms ?? store.fieldTimeMs;
  const seen = new Set();
  for (const client of message.clients) {
    const key = keyOf(client);
    seen.add(key);
    const before = store.robots.get(key);
    client.key = key;
    if (client.pose) {
      const last = before?.pose ? glide(before, now) : client.pose;
      const jumps = Math.hypot(last.x_m - client.pose.x_m, last.y_m - client.pose.y_m) > 1;
      client.from = jumps ? client.pose : last;
      client.since = now;
      const moved = client.pose.x_m !== before?.pose?.x_m || client.pose.y_m !== before?.pose?.y_m ||
                    client.pose.heading_deg !== before?.pose?.heading_deg;
      client.movedAt = moved ? now : before?.movedAt ?? 0;
      if (!store.trails.has(key)) store.trails.set(key, new Trail());
      store.trails.get(key).add(client.pose.x_m, client.pose.y_m);
    }
    store.robots.set(key, client);
  }
  for (const key of store.robots.keys()) {
    if (seen.has(key)) continue;
    store.robots.delete(key);
    store.trails.delete(key);
  }
}

function glide(client, now) {
  const {pose, from} = client;
  const t = from ? Math.min(1, (now - client.since) / GLIDE_MS) : 1;
  if (t >= 1) return pose;
  const turn = ((pose.heading_deg - from.heading_deg + 540) % 360) - 180;
  return {x_m: from.x_m + (pose.x_m - from.x_m) * t, y_m: from.y_m + (pose.y_m - from.y_m) * t,
          heading_deg: from.heading_deg + turn * t};
}

export function isMoving(now) {
  if (store.past || store.density) return false;
  for (const client of store.robots.values()) if (client.pose && now - client.movedAt < GLIDE_MS) return true;
  return false;
}

/** Where a robot is drawn now. */
export const poseNow = (client, now) => (store.past ? client.pose : glide(client, now));

/** `before`: the density that was drawn last, if there was one. */
export function drawRobots(context, view, theme, now, before = null) {
  const robots = store.shownRobots;
  const inView = [...robots.values()].filter(({pose}) => pose && isInView(view, pose));
  store.density = inView.length > DENSE ? densityOf(inView.map((it) => it.pose), view, {before, edge: edgeOf(store.map)}) : null;
  if (store.density) drawDensity(context, view, theme, store.density, store.layers.size);
  const most = (robots.size > MANY ? 8 : 13) * store.typeScale;
  const size = Math.max(5 * store.typeScale, Math.min(most, view.scale * 0.16));
  const labels = inView.length <= MANY || view.scale > 90;
  // Where they would lie on the robot itself, they tell nothing.
  const hasAntennas = store.shows.antennas && antennaPx(robots, view) > 0.6 * size;
  const isOne = store.selectedRobots.length === 1;
  context.font = fontOf(11);
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  for (const client of store.density ? someSelected() : inView) {
    const pose = poseNow(client, now);
    const x = view.sx(pose.x_m);
    const y = view.sy(pose.y_m);
    const selected = store.group.has(client.key);
    const alone = selected && isOne;   // several are only marked
    context.globalAlpha = isFresh(client) || store.past ? 1 : 0.4;
    if (selected) {
      context.strokeStyle = theme.accent;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(x, y, size + 7, 0, 2 * Math.PI);
      context.stroke();
    }
    if (alone) drawReach(context, view, theme, client, pose);
    if (client.antennas && (selected || hasAntennas)) drawAntennas(context, view, theme, client, x, y, alone);
    drawBody(context, theme, x, y, (-pose.heading_deg * Math.PI) / 180, size, selected ? theme.accent : colourOf(client, theme), labels, shownAs(client) === 'held');
    if (labels || selected) {
      context.fillStyle = selected ? theme.accent : theme.ink;
      // Behind it, where its antennas and what they sense are not.
      const back = ((pose.heading_deg + 180) * Math.PI) / 180;
      context.textAlign = 'center';
      write(context, theme, String(client.id), x + (size + 9) * Math.cos(back), y - (size + 9) * Math.sin(back));
    }
  }
  context.globalAlpha = 1;
}

// On a density.
function someSelected() {
  const selected = store.selectedRobots.filter((it) => it.pose);
  return selected.length > DENSE ? [] : selected;
}

const edgeOf = (map) => (map ? [map.origin_m[0] + map.width_m, map.origin_m[1] + map.height_m] : undefined);

function isInView(view, {x_m, y_m}) {
  const x = view.sx(x_m);
  const y = view.sy(y_m);
  return x >= -MARGIN_PX && y >= -MARGIN_PX && x <= view.width + MARGIN_PX && y <= view.height + MARGIN_PX;
}

// How far from a robot its left antenna is, on screen.
function antennaPx(robots, view) {
  for (const {pose, antennas} of robots.values()) {
    if (pose && antennas) return Math.hypot(antennas.left.x_m - pose.x_m, antennas.left.y_m - pose.y_m) * view.scale;
  }
  return 0;
}

function colourOf(client, theme) {
  const shown = shownAs(client);
  return shown === 'warn' ? theme.warn : shown === 'bad' ? theme.bad : theme.ink;
}

// Hollow: it is held.
function drawBody(context, theme, x, y, angle, size, colour, outlined, hollow) {
  const cos = Math.cos(angle) * size;
  const sin = Math.sin(angle) * size;
  const point = (a, b) => [x + a * cos - b * sin, y + a * sin + b * cos];
  context.beginPath();
  context.moveTo(...point(1.15, 0));
  context.lineTo(...point(-0.85, 0.8));
  context.lineTo(...point(-0.45, 0));
  context.lineTo(...point(-0.85, -0.8));
  context.closePath();
  context.lineJoin = 'round';
  if (outlined) {
    context.lineWidth = 3;
    context.strokeStyle = theme.map;
    context.stroke();
  }
  context.fillStyle = hollow ? theme.map : colour;
  context.fill();
  if (hollow) {
    context.lineWidth = 1.6;
    context.strokeStyle = colour;
    context.stroke();
  }
}

// From where nodes count for a robot's antennas: around each, as far as the pheromone reaches; of one
// that is sensed ahead only, before the axle line.
function drawReach(context, view, theme, client, pose) {
  const law = store.laws.get(pheromoneOf(client));
  if (!client.antennas || !law?.reach_m) return;
  const heading = (pose.heading_deg * Math.PI) / 180;
  const x = view.sx(pose.x_m);
  const y = view.sy(pose.y_m);
  context.save();
  if (law.directional) {
    const far = 4 * (law.reach_m + Math.hypot(client.antennas.left.x_m - client.pose.x_m, client.antennas.left.y_m - client.pose.y_m)) * view.scale;
    const [cos, sin] = [Math.cos(heading) * far, -Math.sin(heading) * far];
    context.beginPath();
    context.moveTo(x - sin, y + cos);
    context.lineTo(x - sin + cos, y + cos + sin);
    context.lineTo(x + sin + cos, y - cos + sin);
    context.lineTo(x + sin, y - cos);
    context.clip();
  }
  context.strokeStyle = theme.accent;
  context.fillStyle = theme.accent;
  for (const side of ['left', 'right']) {
    const at = client.antennas[side];
    context.beginPath();
    context.arc(x + (at.x_m - client.pose.x_m) * view.scale, y - (at.y_m - client.pose.y_m) * view.scale, law.reach_m * view.scale, 0, 2 * Math.PI);
    context.globalAlpha = 0.06;
    context.fill();
    context.globalAlpha = 0.6;
    context.setLineDash([3, 4]);
    context.lineWidth = 1.2;
    context.stroke();
  }
  context.restore();
}

// The positions are those of the message's pose; on screen the robot is between two.
function drawAntennas(context, view, theme, client, x, y, hasValues) {
  const dx = x - view.sx(client.pose.x_m);
  const dy = y - view.sy(client.pose.y_m);
  const sensed = sensedOf(client);
  const hue = store.layers.get(pheromoneOf(client))?.hue;
  for (const side of ['left', 'right']) {
    const at = client.antennas[side];
    if (!at) continue;
    const ax = view.sx(at.x_m) + dx;
    const ay = view.sy(at.y_m) + dy;
    context.strokeStyle = theme['ink-3'];
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(ax, ay);
    context.stroke();
    const share = shareOf(client, side);
    context.beginPath();
    context.arc(ax, ay, 3 + 3.5 * Math.sqrt(share), 0, 2 * Math.PI);
    context.fillStyle = theme.map;
    context.fill();
    if (share > 0 && hue) {
      context.fillStyle = css(hue, 0.35 + 0.65 * share);
      context.fill();
    }
    context.strokeStyle = hue ? css(hue) : theme['ink-3'];
    context.lineWidth = 1.3;
    context.stroke();
    if (hasValues && sensed) {
      // Away from the robot, in the direction of the antenna.
      const away = Math.atan2(ay - y, ax - x);
      context.fillStyle = theme.ink;
      context.textAlign = Math.cos(away) > 0.3 ? 'left' : Math.cos(away) < -0.3 ? 'right' : 'center';
      write(context, theme, `${side === 'left' ? 'L' : 'R'} ${number(sensed[side])}`, ax + 11 * Math.cos(away), ay + 13 * Math.sin(away));
      context.textAlign = 'left';
    }
  }
}

/** Keys of the robots in a rectangle of the map, given by two corners. */
export function robotsIn(a, b) {
  const isBetween = (x, from, to) => x >= Math.min(from, to) && x <= Math.max(from, to);
  return [...store.shownRobots.values()].filter(({pose}) => pose && isBetween(pose.x_m, a.x, b.x) && isBetween(pose.y_m, a.y, b.y)).map((it) => it.key);
}

export function robotAt(view, point, reachPx = 16) {
  let best = null;
  let least = reachPx / view.scale;
  for (const client of store.shownRobots.values()) {
    if (!client.pose) continue;
    const distance = Math.hypot(client.pose.x_m - point.x, client.pose.y_m - point.y);
    if (distance < least) { least = distance; best = client; }
  }
  return best;
}
