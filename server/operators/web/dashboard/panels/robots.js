// All robots, and those that are selected, with their commands.
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
const MOST_ROWS = 500;      // of more, the search finds the others
const MOST_NUMBERS = 30;    // of a group

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
    this.all = h('button', {type: 'button', id: 'select-all', title: 'Select all robots of this list (Ctrl+A); single ones: Ctrl+click', hidden: true, onclick: () => this.selectAll()}, 'Select all');
    this.list = h('div', {class: 'rows', id: 'robot-rows', onscroll: () => this.show()});
    this.none = h('p', {class: 'empty'});
    this.rows = new Map();
    this.found = [];   // by the search; the first of them have rows
    this.order = [];   // keys of all robots as they were sorted last
    this.turn = 0;
    this.panel.body.append(h('div', {class: 'find'}, this.search, this.all), this.list, this.none, this.card);
    this.makeCard();
  }

  makeCard() {
    const act = (id, name, title, go) => h('button', {type: 'button', id, title, onclick: go}, name);
    this.title = h('h3');
    this.facts = h('div', {class: 'about'});
    this.follows = h('select', {'aria-label': 'Pheromone to follow', id: 'follow-type'});
    this.followsTypes = '';
    this.buttons = [
      act('go-here', 'Go here …', 'Then click on the map', () => this.tools.sendTo(store.group)),
      act('cancel-goal', 'Cancel goal', 'Forget the goal', () => this.act(() => commands.cancelGoals(store.group))),
      act('halt', 'Halt', 'Stop (H)', () => this.command('halt')),
      act('resume', 'Resume', 'Drive on (U)', () => this.command('resume')),
      act('follow', 'Follow', 'Follow this pheromone', () => this.command('follow', [Number(this.follows.value)])),
    ];
    this.goal = ['x', 'y'].map((it) => h('input', {type: 'number', step: 'any', required: true, id: `goal-${it}`, placeholder: `${it} in m`, 'aria-label': `${it} of the goal, in metres`}));
    this.goButton = h('button', {type: 'submit', id: 'go-to', title: 'Send this robot to these coordinates'}, 'Go');
    const [x, y] = this.goal;
    const goal = h('form', {class: 'actions', onsubmit: (event) => {
      event.preventDefault();
      this.act(() => commands.goTo(store.group, {x: x.valueAsNumber, y: y.valueAsNumber}));
    }}, x, y, this.goButton);
    this.reason = h('p', {class: 'empty'});
    this.chartHolder = h('div', {class: 'robot-charts'});
    this.charts = new RobotCharts(this.chartHolder);
    this.centre = act('follow-view', 'Centre', 'Keep this robot in the middle (F)', () => this.follow());
    this.card.append(h('header', {}, this.title, this.centre,
                       act('deselect', '×', 'Close (Esc)', () => store.select(null))),
                     this.facts, h('div', {class: 'actions'}, this.buttons.slice(0, 4)),
                     h('div', {class: 'actions'}, this.buttons[4], this.follows), goal, this.reason, this.chartHolder);
  }

  command(command, args = []) { this.act(() => commands.send(store.group, command, args)); }

  /** Also keys come here, which nobody disables. */
  act(go) {
    const {refusal} = this.tools;
    if (refusal) toast(`Nothing is sent: ${refusal}`, true);
    else if (store.selectedRobots.length === 0) toast('Nothing is sent: no robot that is there is selected', true);
    else go();
  }

  /** The one that is selected stays in the middle. */
  follow() {
    const [robot, ...others] = store.selectedRobots;
    if (robot && others.length === 0) this.onFollow(robot.key);
  }

  selectAll() { store.selectRobots(this.found.map((it) => it.key)); }

  /** A row was clicked: with Ctrl one robot more or less, with Shift all from the last one on. */
  pick(key, {ctrlKey, metaKey, shiftKey}) {
    const keys = [...this.rows.keys()];
    const [from, to] = [keys.indexOf(store.selected?.key), keys.indexOf(key)];
    if (ctrlKey || metaKey) store.toggleRobot(key);
    else if (shiftKey && from >= 0) store.selectRobots([...store.group, ...keys.slice(Math.min(from, to), Math.max(from, to) + 1).filter((it) => it !== key), key]);
    else store.select(store.group.size === 1 && store.selected.key === key ? null : {kind: 'robot', key});
  }

  show() {
    const robots = this.sorted();
    setText(this.panel.count, countStates(robots));
    this.search.hidden = robots.length < SEARCH_FROM && !this.search.value;
    const words = this.search.value.toLowerCase().split(/\s+/).filter((it) => it);
    this.found = robots.filter((it) => words.every((word) => isOf(it, word)));
    const shown = this.found.slice(0, MOST_ROWS);
    this.all.hidden = this.found.length < 2;
    setText(this.all, words.length ? `Select these ${this.found.length}` : 'Select all');
    if (shown.length !== this.rows.size || shown.some((it) => !this.rows.has(it.key))) this.rebuild(shown);
    for (const robot of this.due(shown)) this.update(robot);
    setText(this.none, robots.length === 0 ? 'No robot has been heard yet' : shown.length === 0 ? `None of ${robots.length} robots`
      : shown.length < this.found.length ? `The first ${shown.length} of ${this.found.length}: the search finds others` : '');
    this.none.hidden = !this.none.textContent;
    this.showCard();
  }

  // Sorting thousands takes as long as drawing them.
  sorted() {
    const robots = store.shownRobots;
    if (robots.size !== this.order.length || this.order.some((it) => !robots.has(it))) {
      this.order = [...robots.values()].sort((a, b) => a.link.localeCompare(b.link) || a.id - b.id).map((it) => it.key);
    }
    return this.order.map((it) => robots.get(it));
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
      const element = h('button', {type: 'button', class: 'row', 'data-robot': robot.key, onclick: (event) => this.pick(robot.key, event)},
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
    element.classList.toggle('selected', store.group.has(robot.key));
    element.setAttribute('aria-pressed', String(store.group.has(robot.key)));
    ['left', 'right'].forEach((side, i) => {
      meters[i].style.transform = `scaleX(${shareOf(robot, side).toFixed(3)})`;
    });
    setText(end, state === 'driving' ? '' : state === 'silent' && robot.silent_s !== null ? `silent ${ago(robot.silent_s)}` : state);
  }

  showCard() {
    const robots = store.selectedRobots;
    this.card.hidden = robots.length === 0;
    if (robots.length === 0) return;
    const isOne = robots.length === 1;
    if (isOne) this.showOne(robots[0]);
    else this.showGroup(robots);
    const types = [...store.laws.values()].map((it) => `${it.type} ${it.name}`).join();
    if (types !== this.followsTypes) {
      this.followsTypes = types;
      this.follows.replaceChildren(...[...store.laws.values()].map((it) => h('option', {value: it.type}, it.name)));
    }
    this.centre.hidden = !isOne;
    this.chartHolder.hidden = store.isReplay || !isOne;   // of recordings the page remembers nothing
    if (!this.chartHolder.hidden) this.charts.show(robots[0], this.memory.moments);
    const able = api.refusal === '' && !store.past;
    for (const it of [...this.buttons, this.goButton, ...this.goal]) it.disabled = !able;
    this.buttons[1].hidden = robots.every((it) => !it.goal);
    this.follows.disabled = !able;
    setText(this.reason, api.reason ? `Commands: ${api.reason}` : 'Commands need the token: “Unlock” above.');
    this.reason.hidden = api.refusal === '';
  }

  showGroup(robots) {
    setText(this.title, `${robots.length} robots`);
    const goals = robots.filter((it) => it.goal).length;
    this.facts.replaceChildren(pairs([
      ['State', countStates(robots)],
      ['Robots', robots.slice(0, MOST_NUMBERS).map((it) => it.id).join(', ') + (robots.length > MOST_NUMBERS ? ` and ${robots.length - MOST_NUMBERS} more` : '')],
      goals > 0 && ['Goals', `${goals} of ${robots.length}`],
    ]));
  }

  showOne(selected) {
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
  }
}
