// Building elements without markup in strings: what a robot or a file is called is never parsed.

/** h('button', {class: 'plain', onclick: go}, 'Go'); null children are left out. */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith('on')) {
      element.addEventListener(name.slice(2), value);
    } else if (name === 'class') {
      element.className = value;
    } else if (typeof value === 'boolean' && name in element) {
      element[name] = value;
    } else if (value !== null && value !== undefined) {
      element.setAttribute(name, value);
    }
  }
  element.append(...children.flat().filter((it) => it !== null && it !== undefined));
  return element;
}

/** An icon from the path data of a 24 x 24 drawing. */
export function icon(...paths) {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  for (const d of paths) {
    const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    path.setAttribute('d', d);
    svg.append(path);
  }
  return svg;
}

/** Of a file or blob. */
export const dataUrl = (blob) => new Promise((resolve) => {
  const reader = new FileReader();
  reader.onload = () => resolve(reader.result);
  reader.readAsDataURL(blob);
});

export const byId = (id) => document.getElementById(id);

/** Writes only what differs, so that a list that is redrawn does not lose focus or selection. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function pairs(rows) {
  return h('dl', {class: 'pairs'},
           rows.filter((row) => row).flatMap(([name, value, mark]) => [
             h('dt', {}, name), h('dd', mark ? {class: mark} : {}, value)]));
}

/** A collapsible panel; what is open is remembered. */
export function panel(key, title, open = true) {
  const count = h('span', {class: 'count'});
  const body = h('div');
  const element = h('details', {class: 'panel', id: `panel-${key}`},
                    h('summary', {}, h('h2', {}, title), count), body);
  element.open = (localStorage.getItem(`panel.${key}`) ?? (open ? '1' : '0')) === '1';
  element.addEventListener('toggle',
                           () => localStorage.setItem(`panel.${key}`, element.open ? '1' : '0'));
  return {element, body, count};
}

let toasts = null;
export function toast(text, failure = false) {
  toasts ??= byId('toasts');
  const note = h('div', failure ? {class: 'failure', role: 'alert'} : {}, text);   // failures interrupt a screen reader
  toasts.append(note);
  while (toasts.children.length > 4) toasts.firstChild.remove();
  setTimeout(() => note.remove(), failure ? 15000 : 3000);
}
