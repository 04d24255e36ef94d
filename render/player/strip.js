// The strips below the pictures: error, joint gap, energy, depth or the expected quantity over time, on one scale.

const STRIP = {grid: '#343c48', bright: '#ecf0f5', quiet: '#929caa', alarm: '#ff5c69', surface: '#181d25'};
const FONT = "'DejaVu Sans', Verdana, system-ui, sans-serif";

/** Starts a path through points. */
function trace(context, points) {
  context.beginPath();
  for (const point of points) context.lineTo(...point);
}

/** Draws a line through points. */
function drawLine(context, points, color, width) {
  Object.assign(context, {strokeStyle: color, lineWidth: width});
  trace(context, points);
  context.stroke();
}

/** Writes text whose middle is at height y, in a font such as 'bold 13px', within `room` pixels. */
function write(context, text, x, y, font, color, align = 'left', room = undefined) {
  Object.assign(context, {font: `${font} ${FONT}`, fillStyle: color, textAlign: align, textBaseline: 'middle'});
  context.fillText(text, x, y, room);
}

function decadeName(power) {
  return ['1 µm', '10 µm', '0.1 mm', '1 mm', '1 cm', '10 cm', '1 m', '10 m', '100 m', '1 km'][power + 6] || `1e${power} m`;
}

/** Returns "+2.00 kJ", "−45.6 mJ". */
function energyLabel(joules) {
  const size = Math.abs(joules);
  for (const [unit, name] of [[1e6, 'MJ'], [1e3, 'kJ'], [1, 'J'], [1e-3, 'mJ'], [1e-6, 'µJ']]) {
    if (size / unit >= 0.9995) return `${joules < 0 ? '−' : '+'}${threeDigits(size / unit)} ${name}`;
  }
  return '0 J';
}

/** Returns `color` mixed with the strip's background. An alpha would show where segments overlap. */
function faded(color) {
  const part = (text, at) => parseInt(text.slice(at, at + 2), 16);
  return `rgb(${[1, 3, 5].map((at) => Math.round(part(STRIP.surface, at) + (part(color, at) - part(STRIP.surface, at)) * 0.38)).join()})`;
}

class Strip {
  constructor(canvas, data, index) {
    Object.assign(this, {canvas, data, index, panel: data.panels[index]});
    this.show(0);
  }

  /** Chooses one of data.strips. */
  show(index) {
    this.kind = this.data.strips[index];
  }

  /** Returns the panel's values, frame by frame. */
  values(panel) {
    return panel[this.kind.key];
  }

  label(value, k) {
    if (this.kind.name !== 'error') return this.axisLabel(value);
    // An error below the reference's uncertainty is known only to be at most that.
    const uncertainty = this.data.reference.uncertainty[k];
    const bound = lengthLabel(uncertainty);
    return value >= uncertainty ? lengthLabel(value) : bound.startsWith('<') ? bound : `≤ ${bound}`;
  }

  /** Returns the text of a value on the strip's axis. */
  axisLabel(value) {
    const {logarithmic, unit} = this.kind;
    if (logarithmic) return lengthLabel(value);
    if (unit === 'J') return energyLabel(value);
    const size = Math.abs(value);
    if (!(size < 1e6)) return `${value > 0 ? '> ' : '< −'}10⁶ ${unit}`;
    return `${value < 0 ? '−' : ''}${size < 999.5 ? +size.toPrecision(3) : size.toFixed(0)} ${unit}`;
  }

  /** Fits the canvas to its size on the page. */
  resize() {
    const ratio = devicePixelRatio || 1;
    const {clientWidth, clientHeight} = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * ratio));
    this.context = this.canvas.getContext('2d');
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.width = clientWidth;
    this.height = clientHeight;
    const left = clientWidth > 260 ? 54 : 8;
    this.plot = {x: left, y: 8, width: Math.max(8, clientWidth - left - 84), height: Math.max(4, clientHeight - 16)};
  }

  x(k) {
    return this.plot.x + k / Math.max(1, this.data.times.length - 1) * this.plot.width;
  }

  y(value) {
    const [lower, upper] = this.kind.scale;
    const level = this.kind.logarithmic ? Math.log10(Math.max(value, 10 ** lower)) : value;
    const fraction = Math.max(0, Math.min(1, (level - lower) / (upper - lower)));
    return this.plot.y + this.plot.height * (1 - fraction);
  }

  /** Returns the frame at a horizontal position of the strip, px. */
  frameAt(x) {
    const last = this.data.times.length - 1;
    return Math.max(0, Math.min(last, Math.round((x - this.plot.x) / this.plot.width * last)));
  }

  draw(k) {
    const {context: c, data, panel} = this;
    c.fillStyle = STRIP.surface;
    c.fillRect(0, 0, this.width, this.height);
    this.drawGrid();
    if (this.kind.name === 'error') this.drawUncertainty();
    drawLine(c, [[this.x(k), this.plot.y], [this.x(k), this.plot.y + this.plot.height]], 'rgba(236, 240, 245, 0.45)', 1);
    if (panel.reference) {
      data.panels.forEach((other) => { if (!other.reference) this.drawCurve(other, k, other.color, other.dash); });
      this.drawNames();
      return;
    }
    this.drawCurve(panel, this.data.times.length, faded(panel.color), [1, 0]);
    this.drawCurve(panel, k, panel.color, [1, 0]);
    if (k < this.values(panel).length) this.drawValue(k);
  }

  drawGrid() {
    const {context: c, plot, kind} = this;
    // `mark` is the energy at the start, or the expected value.
    const {scale: [lower, upper], mark} = kind;
    const lines = kind.logarithmic ? Array.from({length: upper - lower + 1}, (_, i) => [10 ** (lower + i), decadeName(lower + i), i === 0 || i === upper - lower])
      // Label the mark alone where it is near an end: the curve is read against the mark.
      : [lower, upper, mark].map((value) => [value, this.axisLabel(value), value === mark || Math.abs(this.y(value) - this.y(mark)) > 11]);
    for (const [value, name, isNamed] of lines) {
      const y = Math.round(this.y(value)) + 0.5;
      drawLine(c, [[plot.x, y], [plot.x + plot.width, y]], STRIP.grid, 1);
      if (plot.x > 20 && isNamed) write(c, name, plot.x - 5, y, '11px', STRIP.quiet, 'right', plot.x - 7);
    }
  }

  /** Shades errors below the reference's uncertainty, and marks the end of the reference. */
  drawUncertainty() {
    const {context: c, plot, data: {reference, times}} = this;
    const bottom = plot.y + plot.height;
    c.fillStyle = 'rgba(146, 156, 170, 0.25)';
    const curve = Array.from({length: reference.known}, (_, k) => [this.x(k), this.y(reference.uncertainty[k])]);
    trace(c, [[this.x(0), bottom], ...curve, [this.x(Math.max(0, reference.known - 1)), bottom]]);
    c.fill();
    if (reference.known === times.length) return;
    const end = this.x(reference.known);
    c.fillStyle = STRIP.alarm;
    c.fillRect(end - 1, plot.y, 2, plot.height);
    c.font = `11px ${FONT}`;
    const hasRoom = c.measureText('reference ends').width + 8 < plot.x + plot.width - end;
    if (hasRoom) write(c, 'reference ends', end + 5, plot.y + plot.height / 2, '11px', STRIP.quiet);
  }

  drawCurve(panel, end, ink, [dash, gap]) {
    const {context: c, kind} = this;
    const values = this.values(panel);
    const count = Math.min(end + 1, values.length);
    c.lineJoin = 'round';
    c.setLineDash(gap > 0 ? [dash, gap] : []);
    drawLine(c, Array.from({length: count}, (_, k) => [this.x(k), this.y(values[k])]), ink, 1.8);
    c.setLineDash([]);
    c.fillStyle = panel.color;
    // Draw triangles at the top where the curve is above the scale.
    const top = kind.logarithmic ? 10 ** kind.scale[1] : kind.scale[1];
    let last = -Infinity;
    for (let k = 0; k < count; ++k) {
      const x = this.x(k);
      if (!(values[k] > top) || x < last + 40) continue;
      last = x;
      trace(c, [[x - 4, this.plot.y - 1], [x + 4, this.plot.y - 1], [x, this.plot.y - 8]]);
      c.fill();
    }
  }

  drawValue(k) {
    const {context: c, panel} = this;
    const value = this.values(panel)[k];
    c.fillStyle = panel.color;
    c.fillRect(this.x(k) - 2.5, this.y(value) - 2.5, 5, 5);
    write(c, this.label(value, k), this.width - 6, this.height / 2, 'bold 14px', panel.color, 'right', 78);
  }

  /** Names the curves in the reference's strip. */
  drawNames() {
    const {context: c, plot, data} = this;
    const font = 'bold 10.5px';
    c.font = `${font} ${FONT}`;
    const names = [...new Map(data.panels.filter((p) => !p.reference).map((p) => [p.name + p.color, p])).values()];
    const lines = Math.max(1, Math.floor((this.height - 2) / 11));
    let x = plot.x + plot.width + 8;
    let column = 0;
    names.forEach((panel, i) => {
      if (i > 0 && i % lines === 0) { x += column + 6; column = 0; }
      const width = c.measureText(panel.name).width;
      if (x + width > this.width) return;
      column = Math.max(column, width);
      write(c, panel.name, x, (i % lines + 0.5) * this.height / lines, font, panel.color);
    });
  }
}
