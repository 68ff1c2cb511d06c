// Draws the trails on their canvas, in a thread of its own: hundreds of lines with soft edges take
// longer than a frame. First message: {canvas}; then {points, ends, selected, colours, view}, each
// answered by the number of its view.

const BANDS = [0.1, 0.2, 0.34, 0.52];   // the opacity of each quarter, from the oldest

let canvas = null;
let context = null;

onmessage = ({data}) => {
  if (data.canvas) {
    canvas = data.canvas;
    context = canvas.getContext('2d');
    return;
  }
  draw(data);
  postMessage(data.view);
};

function draw({points, ends, selected, colours, view}) {
  const width = Math.round(view.width * view.ratio);
  const height = Math.round(view.height * view.ratio);
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  context.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  context.clearRect(0, 0, view.width, view.height);
  context.lineJoin = 'round';
  context.lineWidth = 1.6;
  context.strokeStyle = colours.ink;
  BANDS.forEach((opacity, band) => {
    context.globalAlpha = opacity;
    ends.forEach((end, i) => {
      if (i !== selected) line(points, view, ends[i - 1] ?? 0, end, band / BANDS.length, (band + 1) / BANDS.length);
    });
  });
  if (selected >= 0) {
    context.strokeStyle = colours.accent;
    context.lineWidth = 2.2;
    context.globalAlpha = 0.9;
    line(points, view, ends[selected - 1] ?? 0, ends[selected], 0, 1);
  }
}

// Of a trail, a path of its own: one path of all trails takes many times as long. Points nearer than
// three pixels to the last are left out: a line through them looks the same.
function line(points, view, begin, end, from, to) {
  const first = begin + Math.floor(from * (end - begin - 1));
  const last = begin + Math.floor(to * (end - begin - 1));
  let lastX = NaN;
  let lastY = NaN;
  context.beginPath();
  for (let i = first; i <= last; i += 1) {
    const x = (points[2 * i] - view.x) * view.scale + view.width / 2;
    const y = (view.y - points[2 * i + 1]) * view.scale + view.height / 2;
    if (i === first) context.moveTo(x, y);
    else if (i < last && Math.abs(x - lastX) + Math.abs(y - lastY) < 3) continue;
    else context.lineTo(x, y);
    lastX = x;
    lastY = y;
  }
  context.stroke();
}
