// Colours of pheromones: by default one hue for each, near to those of Okabe and Ito, and so different
// in lightness that deuteranopes tell all of them apart, from transparent to strong, so that layers can lie on each other; or a scale of many
// colours, of equal steps in lightness. Half of a level is another colour, on every scale
// (proto_tests/dashboard/drawing_test.mjs). Repellents have a hue of their own, and are hatched.

const HUES = [
  {name: 'sky', dark: [13, 144, 223], light: [18, 94, 177]},
  {name: 'orange', dark: [215, 128, 1], light: [218, 116, 2]},
  {name: 'green', dark: [33, 248, 150], light: [43, 146, 108]},
  {name: 'purple', dark: [200, 125, 168], light: [118, 66, 116]},
  {name: 'yellow', dark: [254, 249, 52], light: [64, 58, 22]},
];
const REPELLENT = {name: 'vermilion', dark: [173, 62, 43], light: [156, 50, 6]};
const SCALES = {
  viridis: ['440154', '482878', '3e4989', '31688e', '26828e', '1f9e89', '35b779', '6ece58', 'b5de2b', 'fde725'],
  cividis: ['00224e', '123570', '3b496c', '575d6d', '707173', '8a8678', 'a59c74', 'c3b369', 'e1cc55', 'fee838'],
};
export const PALETTES = ['hue', ...Object.keys(SCALES)];

// Up to here a hue gets more opaque, from here on lighter (on dark) or darker (on light).
const OPAQUE = 0.5;

const rgb = (hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));
const abgr = ([r, g, b, alpha]) => ((Math.round(alpha * 255) << 24) | (Math.round(b) << 16) | (Math.round(g) << 8) | Math.round(r)) >>> 0;
const mix = (a, b, t) => a.map((it, i) => it + (b[i] - it) * t);

/** Of layer number `index`; every repellent has the same. */
export function hueOf(index, theme, repels = false) {
  return (repels ? REPELLENT : HUES[index % HUES.length])[theme];
}

export const css = (colour, alpha = 1) => `rgb(${colour.map(Math.round).join(' ')} / ${alpha})`;

/** The colour, with opacity, of a share 0 < t <= 1 of the scale's end. */
export function colourAt(palette, hue, theme, t) {
  if (palette !== 'hue') {
    const stops = SCALES[palette];
    const at = t * (stops.length - 1);
    const i = Math.min(Math.floor(at), stops.length - 2);
    return [...mix(rgb(stops[i]), rgb(stops[i + 1]), at - i), Math.min(1, 0.08 + t * 4)];
  }
  const strong = mix(hue, theme === 'dark' ? [255, 255, 255] : [0, 0, 0], 0.72);
  const colour = t < OPAQUE ? hue : mix(hue, strong, (t - OPAQUE) / (1 - OPAQUE));
  return [...colour, 0.05 + 0.95 * Math.min(1, t / OPAQUE) ** 0.85];
}

/**
 * 256 pixels (little-endian RGBA) by level; 0 and 255 (blocked) are transparent. Level 254 is
 * `share` of the scale's end.
 */
export function lutOf(palette, hue, theme, share = 1) {
  const lut = new Uint32Array(256);
  for (let level = 1; level < 255; level += 1) lut[level] = abgr(colourAt(palette, hue, theme, Math.min(1, (level / 254) * share)));
  return lut;
}

/** Draws the scale into a canvas, as high as it is; with `below`, from that scale's end over 0. */
export function paintRamp(canvas, lut, below = null) {
  const pixels = below ? [...below.slice(1, 255).reverse(), ...lut.slice(1, 255)] : lut.subarray(1, 255);
  canvas.width = pixels.length;
  canvas.height = 1;
  const context = canvas.getContext('2d');
  const image = context.createImageData(pixels.length, 1);
  new Uint32Array(image.data.buffer).set(pixels);
  context.putImageData(image, 0, 0);
}
