// Places on the map: tags with their range, semaphores of nets at their tags, and robots' goals.
import {store} from './store.js';

export const tagKey = (tag) => `tag ${tag.number}`;

/** The sign of the net at a tag: {green, waiting, net}, or nothing. */
export function signOf(name) {
  for (const net of store.netDetails.values()) {
    const tag = net.tags?.find((it) => it.tag === name && it.fires.length > 0);
    if (tag) return {green: tag.green, waiting: tag.waiting, net: net.name};
  }
  return undefined;
}

export function drawPlaces(context, view, theme) {
  if (store.shows.tags) for (const tag of store.tags) drawTag(context, view, theme, tag);
  if (store.shows.goals) for (const client of store.shownRobots.values()) drawGoal(context, view, theme, client);
}

/** As in theme.css. */
export const FONT = 'Inter, "Segoe UI", system-ui, "Liberation Sans", sans-serif';

/** For what is written on the map. */
export const fontOf = (px) => `${Math.round(px * store.typeScale)}px ${FONT}`;

/** Text that stays legible on whatever is below it. */
export function write(context, theme, text, x, y) {
  context.strokeStyle = theme.map;
  context.lineWidth = 3;
  context.lineJoin = 'round';
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}

function drawTag(context, view, theme, tag) {
  if (tag.x_m === null || tag.x_m === undefined) return;
  const x = view.sx(tag.x_m);
  const y = view.sy(tag.y_m);
  const range = tag.range_m * view.scale;
  if (x < -range || y < -range || x > view.width + range || y > view.height + range) return;
  const selected = store.selected?.kind === 'tag' && store.selected.key === tagKey(tag);
  context.strokeStyle = selected ? theme.accent : theme['ink-3'];
  context.globalAlpha = selected ? 1 : 0.55;
  context.lineWidth = selected ? 1.6 : 1;
  context.setLineDash([2, 4]);
  context.beginPath();
  context.arc(x, y, range, 0, 2 * Math.PI);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
  const sign = signOf(tag.name);
  if (sign) drawSign(context, theme, x, y, sign);
  else drawSlots(context, theme, x, y, tag, selected);
  if (range > 12 || store.tags.length < 30) {
    context.fillStyle = selected ? theme.accent : theme['ink-2'];
    context.font = fontOf(11);
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    write(context, theme, sign?.waiting ? `${tag.name}: robot ${sign.waiting} waits` : tag.name, x + 11, y);
  }
}

// A square that is as full as the tag.
function drawSlots(context, theme, x, y, tag, selected) {
  const half = 5.5;
  context.fillStyle = theme.map;
  context.fillRect(x - half, y - half, 2 * half, 2 * half);
  const full = tag.slots ? (tag.used / tag.slots) * 2 * half : 0;
  context.fillStyle = selected ? theme.accent : theme['ink-2'];
  context.fillRect(x - half, y + half - full, 2 * half, full);
  context.strokeStyle = selected ? theme.accent : theme['ink-2'];
  context.lineWidth = 1.4;
  context.strokeRect(x - half, y - half, 2 * half, 2 * half);
}

// Told apart by shape as well as by colour: go is round with an arrow, stop square with a bar. Stop is
// no alarm, and so not red; amber only while a robot waits there.
function drawSign(context, theme, x, y, {green, waiting}) {
  context.fillStyle = green ? '#0b8a68' : waiting ? '#a86a00' : '#5b6b76';
  context.beginPath();
  if (green) context.arc(x, y, 7.5, 0, 2 * Math.PI);
  else context.roundRect(x - 7, y - 7, 14, 14, 2.5);
  context.fill();
  context.strokeStyle = theme.map;
  context.lineWidth = 1.5;
  context.stroke();
  context.fillStyle = '#fff';
  context.beginPath();
  if (green) {
    context.moveTo(x, y - 4);
    context.lineTo(x + 3.6, y + 2.6);
    context.lineTo(x - 3.6, y + 2.6);
  } else {
    context.rect(x - 4, y - 1.4, 8, 2.8);
  }
  context.fill();
}

function drawGoal(context, view, theme, client) {
  if (!client.goal) return;
  const x = view.sx(client.goal.x_m);
  const y = view.sy(client.goal.y_m);
  const radius = Math.max(5, client.goal.tolerance_m * view.scale);
  context.strokeStyle = theme.accent;
  context.lineWidth = 1.4;
  if (client.pose) {
    context.globalAlpha = 0.6;
    context.setLineDash([5, 5]);
    context.beginPath();
    context.moveTo(view.sx(client.pose.x_m), view.sy(client.pose.y_m));
    context.lineTo(x, y);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.moveTo(x - radius - 4, y); context.lineTo(x - radius + 3, y);
  context.moveTo(x + radius - 3, y); context.lineTo(x + radius + 4, y);
  context.moveTo(x, y - radius - 4); context.lineTo(x, y - radius + 3);
  context.moveTo(x, y + radius - 3); context.lineTo(x, y + radius + 4);
  context.stroke();
}

export function tagAt(view, point) {
  let best = null;
  let least = 13 / view.scale;
  for (const tag of store.tags) {
    if (tag.x_m === null) continue;
    const distance = Math.hypot(tag.x_m - point.x, tag.y_m - point.y);
    if (distance < least) { least = distance; best = tag; }
  }
  return best;
}
