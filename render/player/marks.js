// Draws the overlay of pictures, and the page as one picture.

/** Returns the colour of a body's error in linear light, with weight 1 over the body's own. */
function errorColor(data, index, frame, body) {
  const {ramp, scale: [lower, upper], tracks} = data;
  const error = bodyError(data, tracks[index], frame, body);
  const fraction = Math.max(0, Math.min(1, (Math.log10(Math.max(error, 1e-12)) - lower) / (upper - lower)));
  const position = fraction * (ramp.length - 1);
  const at = Math.min(ramp.length - 2, Math.floor(position));
  return [0, 1, 2].map((c) => ((ramp[at][c] + (ramp[at + 1][c] - ramp[at][c]) * (position - at)) / 255) ** 2.2).concat(1);
}

/** Draws the paths of bodies in the last second. */
function drawTrails(context, {data, frame}, index, place) {
  const track = data.tracks[index];
  const end = Math.min(frame, track.frames - 1);
  const begin = data.times.findIndex((time) => time >= data.times[frame] - 1 - 1e-9);
  context.lineCap = 'round';
  data.bodies.forEach((body, i) => {
    if (!body.moves) return;
    let last = null;
    for (let k = begin; k <= end; ++k) {
      const at = place(poseAt(data, track, k, i));
      if (at && last) {
        context.globalAlpha = 0.9 * (k - begin) / Math.max(1, end - begin);
        drawLine(context, [last, at], data.panels[index].color, 1.6);
      }
      last = at;
    }
  });
  context.globalAlpha = 1;
}

/** Draws joints, and the largest gap. */
function drawJoints(context, {data, frame}, index, place, {width, height}) {
  for (const {bodies, anchors} of data.joints) {
    const points = bodies.map((body, end) => placed(poseAt(data, data.tracks[index], frame, body), anchors[end]));
    const [a, b] = points.map(place);
    if (!a || !b) continue;
    const isOpen = Math.hypot(b[0] - a[0], b[1] - a[1]) > 1.5;
    const radius = Math.max(2, height / 180);
    const color = isOpen ? '#ff3c50' : '#ffffff';
    if (isOpen) drawLine(context, [a, b], color, radius);
    Object.assign(context, {fillStyle: color, strokeStyle: '#141414', lineWidth: 1});
    for (const at of [a, b]) {
      context.beginPath();
      context.arc(at[0], at[1], radius, 0, 7);
      context.fill();
      context.stroke();
    }
  }
  const {gaps} = data.panels[index];
  if (gaps.length === 0) return;
  const text = `gap ${lengthLabel(gaps[Math.min(frame, gaps.length - 1)])}`;
  context.font = `bold 13px ${FONT}`;
  const wide = context.measureText(text).width;
  context.fillStyle = 'rgba(15, 18, 24, 0.7)';
  context.fillRect(width - wide - 14, height - 24, wide + 10, 20);
  write(context, text, width - 9, height - 14, 'bold 13px', '#ffffff', 'right');
}

/** Draws the fate of a run. */
function drawNotice(context, text, {width, height}, overAll) {
  const high = overAll ? height : 24;
  context.fillStyle = overAll ? 'rgba(15, 18, 24, 0.55)' : 'rgba(15, 18, 24, 0.8)';
  context.fillRect(0, height - high, width, high);
  write(context, text, width / 2, height - high / 2, `bold ${overAll ? 18 : 14}px`, STRIP.alarm, 'center', width - 12);
}

/** Returns a canvas with the panels as they are, with title and time. */
function pictureOf(player) {
  player.draw();
  const {data, ratio} = player;
  const top = 44;
  const canvas = document.createElement('canvas');
  canvas.width = $('pictures').width;
  canvas.height = $('pictures').height + Math.round((top + 10) * ratio);
  const context = canvas.getContext('2d');
  context.fillStyle = '#0f1218';
  context.fillRect(0, 0, canvas.width, canvas.height);
  const down = Math.round(top * ratio);
  context.drawImage($('pictures'), 0, down);
  context.drawImage($('marks'), 0, down);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const main = $('panels').getBoundingClientRect();
  write(context, data.title, 12, top / 2, 'bold 20px', STRIP.bright);
  write(context, $('clock').textContent, main.width - 12, top / 2, 'bold 19px', STRIP.bright, 'right');
  player.panels.forEach(({section, head, strip}, index) => {
    if (section.hidden) return;
    const panel = data.panels[index];
    const box = head.getBoundingClientRect();
    const [x, y] = [box.left - main.left, box.top - main.top + top];
    context.fillStyle = STRIP.surface;
    context.fillRect(x, y, box.width, box.height);
    context.fillStyle = panel.color;
    context.fillRect(x, y, 4, box.height);
    write(context, panel.name, x + 12, y + box.height / 2, 'bold 16px', panel.color);
    const name = context.measureText(panel.name).width;
    write(context, panel.words, x + 21 + name, y + box.height / 2, '16px', STRIP.bright, 'left', box.width - name - 30);
    if (strip) {
      const own = strip.canvas.getBoundingClientRect();
      context.drawImage(strip.canvas, own.left - main.left, own.top - main.top + top, own.width, own.height);
    }
  });
  return canvas;
}
