// Light or dark: as the system says, or as chosen here.
import {byId, setText} from './dom.js';

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
