// In words what the map shows, for who does not see it.
import {store} from './store.js';
import {metres, number} from './format.js';
import {countStates, sensedOf, stateOf} from './robots.js';

const MOST_PLACES = 12;   // more than that nobody listens to

/** ", driving, left 2.4, right 2.1", after a robot's name. */
export function robotText(robot) {
  const sensed = sensedOf(robot);
  return [stateOf(robot), robot.state?.reason, sensed && `left ${number(sensed.left)}`, sensed && `right ${number(sensed.right)}`]
    .filter((it) => it).map((it) => `, ${it}`).join('');
}

export function mapText() {
  if (!store.map) return 'Map';
  const robots = [...store.shownRobots.values()];
  const layers = [...store.layers.values()].filter((it) => it.visible && it.levels);
  const placed = robots.filter((it) => it.pose);
  return [
    `Map, ${number(store.map.width_m)} m by ${number(store.map.height_m)} m${store.past ? ', in the past' : store.isReplay ? ', of a recording' : ''}`,
    robots.length ? `${robots.length} robot${robots.length === 1 ? '' : 's'}: ${countStates(robots)}` : 'No robots',
    ...(placed.length <= MOST_PLACES ? placed : placed.filter((it) => store.group.has(it.key)))
      .map((it) => `Robot ${it.id} at ${metres(it.pose.x_m)}, ${metres(it.pose.y_m)}, heading ${it.pose.heading_deg.toFixed(0)}°${robotText(it)}`),
    layers.length ? `Pheromones shown: ${layers.map((it) => it.name).join(', ')}` : 'No pheromone is shown',
    store.tags.length ? `${store.tags.length} tags` : '',
  ].filter((it) => it).join('. ');
}
