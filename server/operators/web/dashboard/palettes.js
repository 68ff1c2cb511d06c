// Colours of pheromones: by default one hue for each (Okabe and Ito, which colour-blind people tell
// apart), from transparent to strong, so that layers can lie on each other; or a scale of many
// colours, of equal steps in lightness.

const HUES = [
  {name: 'sky', dark: [86, 190, 240], light: [0, 104, 172]},
  {name: 'orange', dark: [240, 168, 30], light: [196, 104, 0]},
  {name: 'green', dark: [40, 196, 142], light: [0, 122, 88]},
  {name: 'purple', dark: [222, 140, 186], light: [158, 62, 120]},
  {name: 'yellow', dark: [240, 228, 90], light: [132, 116, 0]},
  {name: 'vermilion', dark: [245, 120, 60], light: [190, 66, 0]},
];
const SCALES = {
  viridis: ['440154', '482878', '3e4989', '31688e', '26828e', '1f9e89', '35b779', '6ece58', 'b5de2b', 'fde725'],
  cividis: ['00224e', '123570', '3b496c', '575d6d', '707173', '8a8678', 'a59c74', 'c3b369', 'e1cc55', 'fee838'],
};
export const PALETTES = ['hue', ...Object.keys(SCALES)];

const rgb = (hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));
const abgr = ([r, g, b], alpha) => ((Math.round(alpha * 255) << 24) | (Math.round(b) << 16) | (Math.round(g) << 8) | Math.round(r)) >>> 0;
const mix = (a, b, t) => a.map((it, i) => it + (b[i] - it) * t);

export function hueOf(index, theme) {
  return HUES[index % HUES.length][theme];
}

export const css = (colour, alpha = 1) => `rgb(${colour.map(Math.round).join(' ')} / ${alpha})`;

/** 256 pixels (little-endian RGBA) by level; 0 and 255 (blocked) are transparent. */
export function lutOf(palette, index, theme) {
  const lut = new Uint32Array(256);
  const hue = hueOf(index, theme);
  const strong = theme === 'dark' ? mix(hue, [255, 255, 255], 0.45) : mix(hue, [0, 0, 0], 0.35);
  for (let level = 1; level < 255; level += 1) {
    const t = level / 254;
    if (palette === 'hue') {
      const colour = t < 0.6 ? hue : mix(hue, strong, (t - 0.6) / 0.4);
      lut[level] = abgr(colour, 0.1 + 0.85 * t ** 0.75);
    } else {
      const stops = SCALES[palette];
      const at = t * (stops.length - 1);
      const i = Math.min(Math.floor(at), stops.length - 2);
      lut[level] = abgr(mix(rgb(stops[i]), rgb(stops[i + 1]), at - i), Math.min(1, 0.55 + t * 2));
    }
  }
  return lut;
}

/** Draws the scale into a canvas, as high as it is. */
export function paintRamp(canvas, lut) {
  canvas.width = 254;
  canvas.height = 1;
  const context = canvas.getContext('2d');
  const image = context.createImageData(254, 1);
  new Uint32Array(image.data.buffer).set(lut.subarray(1, 255));
  context.putImageData(image, 0, 0);
}
