// All robots, and the selected one with its commands.
import {store} from '../store.js';
import {api} from '../api.js';
import {commands} from '../commands.js';
import {h, pairs, panel, setText, toast} from '../dom.js';
import {ago, metres, number} from '../format.js';
import {RobotCharts} from '../charts.js';
import {robotText} from '../describe.js';
import {countStates, isFresh, shareOf, shownAs, stateOf} from '../robots.js';

const SEARCH_FROM = 9;      // robots; fewer are seen at once
const UPDATES_AT_ONCE = 60; // rows besides those that are in view

/** Whether a word of the search is the beginning of a robot's number, or of a word of its link or state. */
function isOf(robot, word) {
  if (/^\d+$/.test(word)) return String(robot.id).startsWith(word);
  const text = `robot ${robot.link} ${stateOf(robot)}`.toLowerCase();
  return [robot.link.toLowerCase(), ...text.split(/[^\p{L}\p{N}]+/u)].some((it) => it.startsWith(word));
}

export class RobotsPanel {
  constructor(tools, onFollow, memory) {
    this.memory = memory;
    this.tools = tools;
    this.onFollow = onFollow;
    this.panel = panel('robots', 'Robots');
    this.card = h('div', {class: 'card', id: 'robot-card', hidden: true});
    this.search = h('input', {type: 'search', id: 'robot-search', placeholder: 'Find: number, link or state', 'aria-label': 'Find robots by number, link or state',
                              hidden: true, oninput: () => this.show()});
    this.list = h('div', {class: 'rows', id: 'robot-rows', onscroll: () => this.show()});
    this.none = h('p', {class: 'empty'});
    this.rows = new Map();
    this.turn = 0;
    this.panel.body.append(this.search, this.list, this.none, this.card);
    this.makeCard();
  }

  makeCard() {
    const act = (id, name, title, go) => h('button', {type: 'button', id, title, onclick: go}, name);
    this.title = h('h3');
    this.facts = h('div', {class: 'about'});
    this.follows = h('select', {'aria-label': 'Pheromone to follow', id: 'follow-type'});
    this.followsTypes = '';
    this.buttons = [
      act('go-here', 'Go here …', 'Then click on the map', () => this.tools.sendTo(store.selected.key)),
      act('cancel-goal', 'Cancel goal', 'Forget the goal', () => this.post('goto', {cancel: true}, 'Goal cancelled')),
      act('halt', 'Halt', 'Stop this robot (H)', () => this.command('halt')),
      act('resume', 'Resume', 'Drive on (U)', () => this.command('resume')),
      act('follow', 'Follow', 'Follow this pheromone', () => this.command('follow', [Number(this.follows.value)])),
    ];
    this.goal = ['x', 'y'].map((it) => h('input', {type: 'number', step: 'any', required: true, id: `goal-${it}`, placeholder: `${it} in m`, 'aria-label': `${it} of the goal, in metres`}));
    this.goButton = h('button', {type: 'submit', id: 'go-to', title: 'Send this robot to these coordinates'}, 'Go');
    const [x, y] = this.goal;
    const goal = h('form', {class: 'actions', onsubmit: (event) => {
      event.preventDefault();
      this.post('goto', {x_m: x.valueAsNumber, y_m: y.valueAsNumber}, `goes to ${metres(x.valueAsNumber)}, ${metres(y.valueAsNumber)}`);
    }}, x, y, this.goButton);
    this.reason = h('p', {class: 'empty'});
    this.chartHolder = h('div', {class: 'robot-charts'});
    this.charts = new RobotCharts(this.chartHolder);
    this.card.append(h('header', {}, this.title,
                       act('follow-view', 'Centre', 'Keep this robot in the middle (F)', () => this.onFollow(store.selected.key)),
                       act('deselect', '×', 'Close (Esc)', () => store.select(null))),
                     this.facts, h('div', {class: 'actions'}, this.buttons.slice(0, 4)),
                     h('div', {class: 'actions'}, this.buttons[4], this.follows), goal, this.reason, this.chartHolder);
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
    this.search.hidden = robots.length < SEARCH_FROM && !this.search.value;
    const words = this.search.value.toLowerCase().split(/\s+/).filter((it) => it);
    const shown = robots.filter((it) => words.every((word) => isOf(it, word)));
    if (shown.length !== this.rows.size || shown.some((it) => !this.rows.has(it.key))) this.rebuild(shown);
    for (const robot of this.due(shown)) this.update(robot);
    setText(this.none, robots.length === 0 ? 'No robot has been heard yet' : shown.length === 0 ? `None of ${robots.length} robots` : '');
    this.none.hidden = !this.none.textContent;
    this.showCard();
  }

  /** Those in view, and of the others some in turn: a thousand rows are not written each time. */
  due(robots) {
    const height = this.list.scrollHeight / Math.max(1, robots.length);
    const first = Math.floor(this.list.scrollTop / height) || 0;
    const last = Math.ceil((this.list.scrollTop + this.list.clientHeight) / height) || 0;
    const others = [...robots.slice(0, first), ...robots.slice(last)];
    if (others.length <= UPDATES_AT_ONCE) return robots;
    this.turn = this.turn >= others.length ? 0 : this.turn;
    const some = others.slice(this.turn, this.turn + UPDATES_AT_ONCE);
    this.turn += UPDATES_AT_ONCE;
    return [...robots.slice(first, last), ...some];
  }

  rebuild(robots) {
    this.rows.clear();
    const many = new Set(robots.map((it) => it.link)).size > 1;
    this.list.replaceChildren(...robots.map((robot) => {
      const dot = h('i', {class: 'dot'});
      const meters = ['left', 'right'].map(() => h('i'));
      const end = h('span', {class: 'end', 'aria-hidden': 'true'});
      const words = h('span', {class: 'only-read'});
      const element = h('button', {type: 'button', class: 'row', 'data-robot': robot.key, onclick: () =>
        store.select(store.selected?.key === robot.key ? null : {kind: 'robot', key: robot.key})},
        dot, h('span', {}, `Robot ${robot.id}`, many ? h('span', {class: 'dim'}, `  ${robot.link}`) : null, words),
        h('span', {class: 'pair', title: 'What the left and the right antenna sense'}, meters.map((it) => h('span', {class: 'meter'}, it))), end);
      this.rows.set(robot.key, {element, dot, meters, end, words});
      return element;
    }));
  }

  update(robot) {
    const {element, dot, meters, end, words} = this.rows.get(robot.key);
    const state = stateOf(robot);
    dot.className = `dot ${shownAs(robot)}`;
    element.title = robot.state?.reason ? `${state}: ${robot.state.reason}` : state;
    setText(words, robotText(robot));
    element.classList.toggle('selected', store.selected?.key === robot.key);
    ['left', 'right'].forEach((side, i) => {
      meters[i].style.transform = `scaleX(${shareOf(robot, side).toFixed(3)})`;
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
      h('tr', {}, h('th', {}, 'senses, in units'), h('th', {}, 'P_L (left)'), h('th', {}, 'P_R (right)')),
      senses.map(([name, {left, right}]) => h('tr', {}, h('td', {}, name === selected.follows ? `${name} (follows)` : name), h('td', {}, number(left)), h('td', {}, number(right)))))] : []));
    const types = [...store.laws.values()].map((it) => `${it.type} ${it.name}`).join();
    if (types !== this.followsTypes) {
      this.followsTypes = types;
      this.follows.replaceChildren(...[...store.laws.values()].map((it) => h('option', {value: it.type}, it.name)));
    }
    this.chartHolder.hidden = store.isReplay;   // of recordings the page remembers nothing
    if (!store.isReplay) this.charts.show(selected, this.memory.moments);
    const able = api.refusal === '' && !store.past;
    for (const it of [...this.buttons, this.goButton, ...this.goal]) it.disabled = !able;
    this.buttons[1].hidden = !goal;
    this.follows.disabled = !able;
    setText(this.reason, api.reason ? `Commands: ${api.reason}` : 'Commands need the token: “Unlock” above.');
    this.reason.hidden = api.refusal === '';
  }
}
