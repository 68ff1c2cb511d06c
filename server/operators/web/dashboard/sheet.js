// Where the panels are a drawer over the map: its button, and the cards of what is selected, which are
// below the map then, so that both are seen.
import {store} from './store.js';
import {byId} from './dom.js';

const narrow = matchMedia('(max-width: 900px)');

/** `panels` have a card each; opens or closes the drawer. */
export function setUpSheet(panels) {
  const homes = panels.map((it) => it.card.parentElement);
  const place = () => panels.forEach(({card}, i) => (narrow.matches ? byId('sheet') : homes[i]).append(card));
  const show = (open) => {
    byId('side').classList.toggle('open', open);
    byId('side-toggle').setAttribute('aria-expanded', String(open));
  };
  narrow.addEventListener('change', () => { place(); show(false); });
  place();
  byId('side-toggle').addEventListener('click', () => show(!byId('side').classList.contains('open')));
  store.on('selected', () => { if (store.selected && narrow.matches) show(false); });
  return show;
}
