// Numbers and times for people.

const PREFIXES = ['', 'k', 'M', 'G', 'T'];

export function bytes(n) {
  if (n === null || n === undefined) return '–';
  let i = 0;
  while (n >= 1000 && i < PREFIXES.length - 1) { n /= 1000; i += 1; }
  return `${i === 0 || n >= 100 ? Math.round(n) : n.toFixed(1)} ${PREFIXES[i]}B`;
}

export function count(n) {
  return n === null || n === undefined ? '–' : Math.round(n).toLocaleString('en').replace(/,/g, '\u202f');
}

/** Three significant digits, without an exponent. */
export function number(x) {
  if (x === null || x === undefined || Number.isNaN(x)) return '–';
  const size = Math.abs(x);
  if (size === 0) return '0';
  if (size < 0.001) return x.toExponential(0);
  return String(Number(x.toPrecision(3)));
}

export const metres = (x) => `${x.toFixed(2).replace('-', '−')} m`;
export const percent = (x) => (x === null || x === undefined ? '–' : `${(x * 100).toFixed(0)} %`);

/** 65 -> "1:05", 90000 -> "1 d 1:00:00". */
export function duration(s) {
  if (s === null || s === undefined) return '–';
  const whole = Math.max(0, Math.floor(s));
  const days = Math.floor(whole / 86400);
  const two = (n) => String(n).padStart(2, '0');
  const hours = Math.floor(whole / 3600) % 24;
  const minutes = Math.floor(whole / 60) % 60;
  const clock = hours || days ? `${hours}:${two(minutes)}:${two(whole % 60)}`
                              : `${minutes}:${two(whole % 60)}`;
  return days ? `${days} d ${clock}` : clock;
}

export function ago(s) {
  if (s === null || s === undefined) return 'never';
  return s < 1 ? 'now' : s < 100 ? `${Math.round(s)} s` : s < 3600 ? `${Math.round(s / 60)} min`
    : s < 86400 ? `${Math.round(s / 3600)} h` : `${Math.round(s / 86400)} d`;
}

export function clock(ms) {
  return new Date(ms).toLocaleTimeString('en-GB');
}
