// All robots, and the selected one with its commands.
import {store} from '../store.js';
import {api} from '../api.js';
import {commands} from '../commands.js';
import {h, pairs, panel, setText, toast} from '../dom.js';
import {ago, metres, number} from '../format.js';
import {countStates, isFresh, shareOf, shownAs, stateOf} from '../robots.js';

const MOST_ROWS = 60;

export class RobotsPanel {
  constructor(tools, onFollow) {
    this.tools = tools;
    this.onFollow = onFollow;
    this.panel = panel('robots', 'Robots');
    this.card = h('div', {class: 'card', id: 'robot-card', hidden: true});
    this.list = h('div', {class: 'rows', id: 'robot-rows'});
    this.more = h('p', {class: 'empty'});
    this.rows = new Map();
    this.panel.body.append(this.list, this.more, this.card);
    this.makeCard();
  }

  makeCard() {
    const act = (id, name, title, go) => h('button', {type: 'button', id, title, onclick: go}, name);
    this.title = h('h3');
    this.facts = h('div');
    this.follows = h('select', {'aria-label': 'Pheromone to follow', id: 'follow-type'});
    this.followsTypes = '';
    this.buttons = [
      act('go-here', 'Go here …', 'Then click on the map', () => this.tools.sendTo(store.selected.key)),
      act('cancel-goal', 'Cancel goal', 'Forget the goal', () => this.post('goto', {cancel: true}, 'Goal cancelled')),
      act('halt', 'Halt', 'Stop this robot (H)', () => this.command('halt')),
      act('resume', 'Resume', 'Drive on (U)', () => this.command('resume')),
      act('follow', 'Follow', 'Follow this pheromone', () => this.command('follow', [Number(this.follows.value)])),
    ];
    this.reason = h('p', {class: 'empty'});
    this.card.append(h('header', {}, this.title,
                       act('follow-view', 'Centre', 'Keep this robot in the middle (F)', () => this.onFollow(store.selected.key)),
                       act('deselect', '×', 'Close (Esc)', () => store.select(null))),
                     this.facts, h('div', {class: 'actions'}, this.buttons.slice(0, 4)),
                     h('div', {class: 'actions'}, this.buttons[4], this.follows), this.reason);
  }

  async post(path, body, done) {
    const robot = store.robots.get(store.selected?.key);
    if (!robot) return;
    try {
      await api.post(path, {link: robot.link, id: robot.id, ...body});
      toast(`Robot ${robot.id}: ${done}`);
    } catch (error) {
      toast(`Robot ${robot.id}: ${error.message}`, true);
    }
  }

  command(command, args = []) {
    if (store.robots.has(store.selected?.key)) commands.send(store.selected.key, command, args);
  }

  show() {
    const robots = [...store.shownRobots.values()].sort((a, b) => a.link.localeCompare(b.link) || a.id - b.id);
    setText(this.panel.count, countStates(robots));
    const shown = robots.slice(0, MOST_ROWS);
    if (shown.length !== this.rows.size || shown.some((it) => !this.rows.has(it.key))) this.rebuild(shown);
    for (const robot of shown) this.update(robot);
    setText(this.more, robots.length === 0 ? 'No robot has been heard yet' : robots.length > MOST_ROWS ? `and ${robots.length - MOST_ROWS} more, on the map` : '');
    this.more.hidden = !this.more.textContent;
    this.showCard();
  }

  rebuild(robots) {
    this.rows.clear();
    const many = new Set(robots.map((it) => it.link)).size > 1;
    this.list.replaceChildren(...robots.map((robot) => {
      const dot = h('i', {class: 'dot'});
      const meters = ['left', 'right'].map(() => h('i'));
      const end = h('span', {class: 'end'});
      const element = h('button', {type: 'button', class: 'row', 'data-robot': robot.key, onclick: () =>
        store.select(store.selected?.key === robot.key ? null : {kind: 'robot', key: robot.key})},
        dot, h('span', {}, `Robot ${robot.id}`, many ? h('span', {class: 'dim'}, `  ${robot.link}`) : null),
        h('span', {class: 'pair', title: 'What the left and the right antenna sense'}, meters.map((it) => h('span', {class: 'meter'}, it))), end);
      this.rows.set(robot.key, {element, dot, meters, end});
      return element;
    }));
  }

  update(robot) {
    const {element, dot, meters, end} = this.rows.get(robot.key);
    const state = stateOf(robot);
    dot.className = `dot ${shownAs(robot)}`;
    element.title = robot.state?.reason ? `${state}: ${robot.state.reason}` : state;
    element.setAttribute('aria-label', `Robot ${robot.id}, ${element.title}`);
    element.classList.toggle('selected', store.selected?.key === robot.key);
    const sensed = robot.antennas?.pheromones?.[store.active];
    ['left', 'right'].forEach((side, i) => {
      meters[i].style.transform = `scaleX(${shareOf(sensed?.[side]).toFixed(3)})`;
    });
    setText(end, state === 'driving' ? '' : state === 'silent' && robot.silent_s !== null ? `silent ${ago(robot.silent_s)}` : state);
  }

  showCard() {
    const selected = store.selected?.kind === 'robot' ? store.shownRobots.get(store.selected.key) : null;
    this.card.hidden = !selected;
    if (!selected) return;
    setText(this.title, `Robot ${selected.id} on ${selected.link}`);
    const {pose, goal, last_command: command, last_event: event} = selected;
    const senses = Object.entries(selected.antennas?.pheromones ?? {});
    const state = selected.state;
    this.facts.replaceChildren(pairs([
      ['State', `${stateOf(selected)}${state?.reason ? `, ${state.reason}` : ''}${state?.since_s > 0 ? `, for ${ago(state.since_s)}` : ''}`,
       shownAs(selected) === 'good' ? 'good' : shownAs(selected) === 'bad' ? 'bad' : 'warn'],
      state && state.told_by === 'server' && ['Known from', 'its poses; it has not told'],
      ['Position', pose ? `${metres(pose.x_m)}, ${metres(pose.y_m)}` : 'unknown'],
      pose && ['Heading', `${pose.heading_deg.toFixed(0)}°${pose.source === 'tracker' ? ', by tracker' : ''}`],
      goal && ['Goal', `${metres(goal.x_m)}, ${metres(goal.y_m)}`],
      command && ['Last command', `${command.command}: ${command.outcome}${command.reason ? `, ${command.reason}` : ''}`,
                  command.outcome === 'accepted' ? 'good' : command.outcome === 'pending' ? '' : 'warn'],
      event && ['Last event', `${event.event}`],
      selected.requests !== undefined && ['Requests', String(selected.requests)],
      selected.refusals > 0 && ['Refused', String(selected.refusals), 'warn'],
      selected.repeats > 0 && ['Repeated', String(selected.repeats)],
      ['Last heard', isFresh(selected) ? 'now' : `${ago(selected.silent_s)} ago`, isFresh(selected) ? '' : 'warn'],
    ]), ...(senses.length ? [h('table', {class: 'senses'},
      h('tr', {}, h('th', {}, 'senses'), h('th', {}, 'P_L'), h('th', {}, 'P_R')),
      senses.map(([name, {left, right}]) => h('tr', {}, h('td', {}, name), h('td', {}, number(left)), h('td', {}, number(right)))))] : []));
    const types = [...store.laws.values()].map((it) => `${it.type} ${it.name}`).join();
    if (types !== this.followsTypes) {
      this.followsTypes = types;
      this.follows.replaceChildren(...[...store.laws.values()].map((it) => h('option', {value: it.type}, it.name)));
    }
    const able = api.refusal === '' && !store.past;
    for (const button of this.buttons) button.disabled = !able;
    this.buttons[1].hidden = !goal;
    this.follows.disabled = !able;
    setText(this.reason, api.reason ? `Commands: ${api.reason}` : 'Commands need the token: “Unlock” above.');
    this.reason.hidden = api.refusal === '';
  }
}
