// Light or dark: as the system says, or as chosen here. Larger type on large screens, and a wall mode:
// the map alone, to be read from across the room.
import {byId, setText, toast} from './dom.js';
import {store} from './store.js';

export function setUpTheme(onChange) {
  const system = matchMedia('(prefers-color-scheme: light)');
  const theme = {
    name: 'dark',
    apply() {
      theme.name = localStorage.getItem('theme') ?? (system.matches ? 'light' : 'dark');
      document.documentElement.dataset.theme = theme.name;
      const button = byId('theme');
      setText(button, theme.name === 'dark' ? '☀' : '☾');
      button.title = `${theme.name === 'dark' ? 'Light' : 'Dark'} (D)`;
      button.setAttribute('aria-label', button.title);
    },
    toggle() {
      const next = theme.name === 'dark' ? 'light' : 'dark';
      // What the system says anyway need not be remembered: the page goes on following it.
      if (next === (system.matches ? 'light' : 'dark')) localStorage.removeItem('theme');
      else localStorage.setItem('theme', next);
      theme.apply();
      onChange();
    },
  };
  theme.apply();
  byId('theme').addEventListener('click', () => theme.toggle());
  system.addEventListener('change', () => { theme.apply(); onChange(); });
  return theme;
}

/** {toggle, isOn}; `onChange` after the sizes of what is written changed. */
export function setUpWall(onChange) {
  const large = matchMedia('(min-width: 2200px)');   // as in layout.css
  const root = document.documentElement;
  const wall = {
    get isOn() { return root.hasAttribute('data-wall'); },
    apply() {
      store.typeScale = wall.isOn ? 2 : large.matches ? 1.35 : 1;
      onChange();
    },
    toggle(isOn = !wall.isOn) {
      root.toggleAttribute('data-wall', isOn);
      store.isWall = isOn;
      if (isOn) toast('Wall mode: W ends it');
      wall.apply();
    },
  };
  large.addEventListener('change', wall.apply);
  if (store.isWall) wall.toggle(true);
  else wall.apply();
  return wall;
}
