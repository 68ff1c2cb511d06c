// The keyboard; dialogs.js tells of it.
import {store} from './store.js';

const SHOWS = {r: 'robots', t: 'trails', a: 'antennas', g: 'grid'};
const PAN_PX = 80;

export function setUpKeys({map, tools, robots, layers, timeline, replay, theme, wall, haltAll, showHelp}) {
  const {view} = map;
  const onMap = {
    arrowleft: () => view.pan(PAN_PX, 0), arrowright: () => view.pan(-PAN_PX, 0),
    arrowup: () => view.pan(0, PAN_PX), arrowdown: () => view.pan(0, -PAN_PX),
    '+': () => view.zoom(1.25), '=': () => view.zoom(1.25), '-': () => view.zoom(0.8), 0: () => view.fit(),
    ' ': () => timeline.toggle(), l: () => timeline.live(), d: () => theme.toggle(), w: () => wall.toggle(), '?': showHelp, '/': showHelp,
    h: () => ofRobot(() => robots.command('halt')), u: () => ofRobot(() => robots.command('resume')),
    f: () => robots.follow(),
  };

  function ofRobot(go) {
    if (store.selected?.kind === 'robot') go();
  }

  function nextRobot(back) {
    const keys = [...store.robots.keys()].sort();
    if (keys.length === 0) return;
    const at = keys.indexOf(store.selected?.key);
    store.select({kind: 'robot', key: keys[(at + (back ? keys.length - 1 : 1) + (at < 0 && back ? 1 : 0)) % keys.length]});
  }

  addEventListener('keydown', (event) => {
    const typing = event.target.matches('input:not([type="range"]):not([type="checkbox"]), select, textarea');
    const key = event.key.toLowerCase();
    if (key === 'z' && (event.ctrlKey || event.metaKey) && !event.altKey && !typing && !document.querySelector('dialog[open]')) {
      tools.reverse(event.shiftKey ? 'redo' : 'undo');
      event.preventDefault();
      return;
    }
    if (key === 'a' && (event.ctrlKey || event.metaKey) && !typing && !document.querySelector('dialog[open]')) {
      robots.selectAll();
      event.preventDefault();
      return;
    }
    if (typing || event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
    const inControl = event.target.matches('button, summary, input, a');
    if (inControl && [' ', 'enter', 'arrowleft', 'arrowright', 'arrowup', 'arrowdown'].includes(key)) return;
    if (key === 'n') {
      nextRobot(event.shiftKey);
    } else if (event.shiftKey && key === 'h') {
      haltAll();
    } else if (!event.shiftKey && replay.keydown(key)) {
      // taken: in a replay, arrows move in time; with Shift, the map
    } else if (tools.keydown(key)) {
      // taken
    } else if (/^[1-9]$/.test(key)) {
      layers.toggleLayer([...store.layers.values()][Number(key) - 1]);
    } else if (SHOWS[key]) {
      layers.toggleShow(SHOWS[key]);
    } else if (onMap[key]) {
      onMap[key]();
    } else {
      return;
    }
    event.preventDefault();
  });
}
