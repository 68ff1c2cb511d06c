// The token, and the help.
import {api} from './api.js';
import {byId, h, setText} from './dom.js';

const KEYS = [
  ['V', 'look: drag to move, click a robot or a tag'], ['Shift+drag  Shift+click  Ctrl+A', 'select several robots'], ['P  B  E  M', 'path, brush, eraser, measure'],
  ['[  ]', 'smaller, larger brush'], ['Enter  Backspace  Esc', 'lay the path, remove its last point, cancel'],
  ['1 … 9', 'show or hide a pheromone'], ['R T A G', 'show or hide robots, trails, antennas, grid'],
  ['Arrows  +  −  0', 'move, zoom, fit'], ['Space  L', 'pause or play, back to live'],
  ['←  →  Home  End', 'in a replay: five seconds back or on, its beginning and end (Shift: move the map)'],
  ['Ctrl+Z  Ctrl+Shift+Z', 'undo, redo the last edit of the map'],
  ['N', 'next robot (Shift: previous)'], ['F', 'follow the selected robot'],
  ['H  U', 'halt, resume the selected robots'], ['Shift+H', 'halt all'], ['D', 'light or dark'], ['W', 'wall mode: large type, the map alone'], ['?', 'this help'],
];

export function setUpHelp() {
  const dialog = h('dialog', {id: 'help-dialog'},
    h('h2', {}, 'Keyboard and mouse'),
    h('dl', {class: 'keys'}, KEYS.flatMap(([keys, what]) => [
      h('dt', {}, keys.split('  ').map((it) => [h('kbd', {}, it), ' ']).flat()), h('dd', {}, what)])),
    h('div', {class: 'actions'}, h('button', {type: 'button', onclick: () => dialog.close()}, 'Close')));
  document.body.append(dialog);
  const show = () => (dialog.open ? dialog.close() : dialog.showModal());
  byId('help').addEventListener('click', show);
  return show;
}

export function setUpToken() {
  const input = h('input', {type: 'password', autocomplete: 'off', name: 'token', 'aria-label': 'Token', spellcheck: 'false'});
  const problem = h('p', {class: 'problem', role: 'alert'});
  const unlock = h('button', {type: 'submit', class: 'primary'}, 'Unlock');
  const dialog = h('dialog', {id: 'token-dialog'},
    h('h2', {}, 'Unlock changes'),
    h('p', {}, 'The token is in the file that web.token_file of the configuration names; the server’s log says where that is. It is kept until this tab is closed.'),
    h('form', {onsubmit: (event) => { event.preventDefault(); tryToken(); }},
      input, problem,
      h('div', {class: 'actions'},
        h('button', {type: 'button', onclick: () => dialog.close()}, 'Cancel'), unlock)));
  async function tryToken() {
    unlock.disabled = true;
    setText(problem, 'Asking the server …');
    const refused = await api.whyNot(input.value.trim());
    unlock.disabled = false;
    setText(problem, refused);
    if (refused) return;
    api.token = input.value.trim();
    input.value = '';
    dialog.close();
  }
  document.body.append(dialog);
  const lock = byId('lock');
  lock.addEventListener('click', () => {
    if (api.token) api.token = '';
    else { setText(problem, ''); dialog.showModal(); }
  });
  return () => {
    setText(lock, api.token ? 'Lock' : 'Unlock');
    lock.title = api.token ? 'Changes are possible; click to forget the token'
      : 'View only: changes need the server’s token';
  };
}
