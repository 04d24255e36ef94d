// The page: panels, time, camera, keys.

const $ = (id) => document.getElementById(id);
const SPEEDS = [4, 2, 1, 1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64];
const OVERLAYS = {t: 'trails', j: 'joints', g: 'ghost', e: 'error'};

/** Appends a new element, with properties set. */
function append(parent, tag, properties) {
  return parent.appendChild(Object.assign(document.createElement(tag), properties));
}

class Player {
  constructor(data) {
    this.data = data;
    this.frame = 0;
    this.isPlaying = false;
    this.alone = -1;
    this.on = {trails: false, joints: false, ghost: false, error: false};
    this.camera = new Camera(data.view);
    this.buildPanels();
    this.buildControls();
    try {
      this.painter = new Painter($('pictures'), data);
    } catch (error) {
      this.showMessage(error.message);
    }
    $('pictures').addEventListener('webglcontextlost', () => this.showMessage('The browser took the pictures’ memory: reload the page.'));
    new ResizeObserver(() => this.layOut()).observe($('panels'));
    this.layOut();
  }

  showMessage(text) {
    append($('panels'), 'p', {id: 'message', textContent: text});
  }

  buildPanels() {
    const {data} = this;
    this.panels = data.panels.map((panel, index) => {
      const section = append($('panels'), 'section', {className: 'panel'});
      section.style.setProperty('--color', panel.color);
      const title = [panel.name, panel.words].filter(Boolean).join(', ');
      section.setAttribute('aria-label', title);
      const head = append(section, 'div', {className: 'head', title});
      append(head, 'b', {textContent: panel.name});
      append(head, 'span', {className: 'words', textContent: panel.words});
      const picture = append(section, 'div', {className: 'picture'});
      this.listenToPicture(picture);
      section.addEventListener('dblclick', () => this.show(this.alone < 0 ? index : -1));
      let strip = null;
      if (data.strips.length > 0) {
        const canvas = append(section, 'canvas', {className: 'strip'});
        strip = new Strip(canvas, data, index);
        this.listenToStrip(canvas, strip);
      }
      return {section, head, picture, strip};
    });
  }

  listenToPicture(picture) {
    const fingers = new Map();
    picture.addEventListener('contextmenu', (event) => event.preventDefault());
    picture.addEventListener('pointerdown', (event) => {
      picture.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event);
    });
    for (const end of ['pointerup', 'pointercancel']) picture.addEventListener(end, (event) => fingers.delete(event.pointerId));
    picture.addEventListener('pointermove', (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      if (other) {
        const distance = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
        this.camera.zoom(distance(before) / Math.max(1, distance(event)));
        this.camera.pan(dx / 2, dy / 2, picture);
      } else if (event.shiftKey || event.buttons & 6) {
        this.camera.pan(dx, dy, picture);
      } else {
        this.camera.orbit(dx, dy);
      }
      fingers.set(event.pointerId, event);
      this.requestDrawing();
    });
    picture.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.camera.zoom(Math.exp(0.0015 * event.deltaY * (event.deltaMode === 1 ? 20 : 1)));
      this.requestDrawing();
    }, {passive: false});
  }

  listenToStrip(canvas, strip) {
    const scrub = (event) => {
      if (event.type === 'pointerdown') canvas.setPointerCapture(event.pointerId);
      if (event.buttons & 1) this.go(strip.frameAt(event.clientX - canvas.getBoundingClientRect().left));
    };
    canvas.addEventListener('pointerdown', scrub);
    canvas.addEventListener('pointermove', scrub);
  }

  buildControls() {
    const {data} = this;
    $('scrubber').max = data.times.length - 1;
    $('scrubber').addEventListener('input', () => this.go(+$('scrubber').value));
    $('play').addEventListener('click', () => this.play(!this.isPlaying));
    const speeds = [...new Set([...SPEEDS, data.speed])].sort((a, b) => b - a);
    for (const speed of speeds) {
      const text = speed >= 1 || speed <= 0 ? `${speed}×` : Number.isInteger(1 / speed) ? `1/${1 / speed}×` : `${speed}×`;
      $('speed').append(new Option(text, speed, false, speed === data.speed));
    }
    $('speed').addEventListener('change', () => this.startClock());
    for (const button of document.querySelectorAll('[data-overlay]')) {
      const name = button.dataset.overlay;
      const needsReference = name === 'ghost' || name === 'error';
      button.disabled = needsReference ? !data.reference || data.reference.known === 0 : name === 'joints' && data.joints.length === 0;
      button.setAttribute('aria-pressed', 'false');
      button.addEventListener('click', () => this.toggle(name));
    }
    data.strips.forEach((strip, index) => $('strip').append(new Option(`strips: ${strip.name}`, index)));
    $('strip').hidden = data.strips.length < 2;
    $('strip').addEventListener('change', () => this.showStrip(+$('strip').value));
    this.writeLegend();
    $('reset').addEventListener('click', () => this.resetCamera());
    $('save').addEventListener('click', () => this.save());
    $('help').addEventListener('click', () => this.help());
    document.addEventListener('keydown', (event) => this.onKey(event));
    $('precision').textContent = `Frames between two steps are interpolated. Positions are good to ${lengthLabel(data.unit / 2)}, rotations to 3e-5 rad.`;
  }

  /** Shows one of data.strips in the strips. */
  showStrip(index) {
    $('strip').value = index;
    this.panels.forEach(({strip}) => strip.show(index));
    this.writeLegend();
    this.requestDrawing();
  }

  writeLegend() {
    const {data} = this;
    const shown = data.strips[+$('strip').value];
    const strips = shown ? `strips: ${shown.words}` : '';
    $('legend').textContent = [data.shared, strips].filter(Boolean).join(' · ');
  }

  onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const {key} = event;
    const {data} = this;
    const onButton = event.target instanceof HTMLButtonElement;
    const step = event.shiftKey ? 10 : 1;
    const actions = {
      ArrowRight: () => this.go(this.frame + step), ArrowLeft: () => this.go(this.frame - step),
      Home: () => this.go(0), End: () => this.go(Infinity),
      ',': () => this.changeSpeed(1), '.': () => this.changeSpeed(-1),
      r: () => this.resetCamera(), s: () => this.save(), h: () => this.help(), '?': () => this.help(),
      b: () => data.strips.length > 1 && this.showStrip((+$('strip').value + 1) % data.strips.length),
      Escape: () => { if (!$('shortcuts').hidden) this.help(); this.show(-1); }, 0: () => this.show(-1),
    };
    if (!onButton) actions[' '] = () => this.play(!this.isPlaying);
    if (key in OVERLAYS) actions[key] = () => this.toggle(OVERLAYS[key]);
    if (key >= '1' && key <= '9' && key <= this.panels.length) actions[key] = () => this.show(this.alone === key - 1 ? -1 : key - 1);
    if (!actions[key]) return;
    event.preventDefault();
    actions[key]();
  }

  resetCamera() {
    this.camera.reset();
    this.requestDrawing();
  }

  help() {
    $('shortcuts').hidden = !$('shortcuts').hidden;
    $('help').setAttribute('aria-expanded', String(!$('shortcuts').hidden));
  }

  toggle(name) {
    const button = document.querySelector(`[data-overlay=${name}]`);
    if (button.disabled) return;
    this.on[name] = !this.on[name];
    button.setAttribute('aria-pressed', String(this.on[name]));
    this.writeOverlayLegend();
    // The overlays' legend changes the layout.
    this.layOut();
  }

  changeSpeed(by) {
    const select = $('speed');
    select.selectedIndex = Math.max(0, Math.min(select.options.length - 1, select.selectedIndex + by));
    this.startClock();
  }

  /** Explains the overlays that are on. */
  writeOverlayLegend() {
    const {data, on} = this;
    const parts = [];
    if (on.trails) parts.push('<span><b>—</b> the last second’s way</span>');
    if (on.joints) parts.push('<span><b>●</b> joint &ensp;<b style="color:#ff3c50">●—●</b> open joint, and the largest gap</span>');
    if (on.ghost) parts.push('<span><b>□</b> where the reference is</span>');
    if (on.error) {
      const [lower, upper] = data.scale.map((power) => lengthLabel(10 ** power));
      const ramp = data.ramp.map((color) => `rgb(${color})`).join();
      parts.push(`<span>${lower} <b style="display:inline-block;width:120px;height:9px;background:linear-gradient(90deg,${ramp})"></b> ${upper} from the reference</span>`);
    }
    $('overlay-legend').innerHTML = parts.join('');
  }

  /** Shows one panel alone; −1: all. */
  show(index) {
    this.alone = index;
    this.layOut();
  }

  /** Arranges panels in rows as in films, like rows_for() in C++. */
  layOut() {
    const main = $('panels');
    const shown = this.panels.filter((_, i) => this.alone < 0 || i === this.alone);
    this.panels.forEach(({section}) => { section.hidden = true; });
    const above = this.data.strips.length > 0 ? 96 : 38;
    const count = shown.length;
    let best = {rows: 1, seen: -1};
    for (let rows = 1; rows <= count; ++rows) {
      const [least, most] = [Math.floor(count / rows), Math.ceil(count / rows)];
      const width = main.clientWidth / most;
      const height = main.clientHeight / rows - above;
      const seen = (Math.min(width, height * 16 / 9) + 0.1 * Math.min(width, 2 * height * 16 / 9)) * (1 - 0.15 * (most / least - 1));
      if (height > 0 && seen > best.seen * (1 + 1e-9)) best = {rows, seen};
    }
    // Later rows may have one panel less, and wider panels.
    const [least, most] = [Math.floor(count / best.rows), Math.ceil(count / best.rows)];
    const inFullRows = count % best.rows * most;
    main.style.gridTemplateColumns = `repeat(${least * most}, minmax(0, 1fr))`;
    main.style.gridAutoRows = 'minmax(0, 1fr)';
    shown.forEach(({section}, i) => {
      section.hidden = false;
      section.style.gridColumn = `span ${i < inFullRows ? least : most}`;
    });
    const ratio = devicePixelRatio || 1;
    for (const canvas of [$('pictures'), $('marks')]) {
      canvas.width = Math.max(1, Math.round(main.clientWidth * ratio));
      canvas.height = Math.max(1, Math.round(main.clientHeight * ratio));
    }
    this.ratio = ratio;
    shown.forEach(({strip}) => strip && strip.resize());
    this.fitHeads(shown);
    this.draw();
  }

  /** Shrinks all headings alike until the longest fits. */
  fitHeads(shown) {
    const fits = () => shown.every(({head}) => [...head.children].every((part) => part.scrollWidth <= part.clientWidth + 1));
    for (let size = 1; size >= 0.6; size -= 0.05) {
      $('panels').style.setProperty('--head', size);
      if (fits()) return;
    }
  }

  play(isPlaying) {
    if (isPlaying && this.frame === this.data.times.length - 1) this.go(0);
    this.isPlaying = isPlaying;
    $('play').textContent = isPlaying ? '❚❚' : '▶';
    this.startClock();
    this.requestDrawing();
  }

  startClock() {
    this.clock = {wall: performance.now(), time: this.data.times[this.frame]};
  }

  go(frame) {
    this.frame = Math.max(0, Math.min(this.data.times.length - 1, frame));
    this.startClock();
    this.requestDrawing();
  }

  /** Requests a drawing in the browser's next frame. */
  requestDrawing() {
    if (this.isRequested) return;
    this.isRequested = true;
    requestAnimationFrame((now) => {
      this.isRequested = false;
      if (this.isPlaying) this.advance(now);
      this.draw();
      if (this.isPlaying) this.requestDrawing();
    });
  }

  advance(now) {
    const {times} = this.data;
    const time = this.clock.time + Math.max(0, now - this.clock.wall) / 1000 * $('speed').value;
    let frame = this.frame;
    while (frame + 1 < times.length && times[frame + 1] <= time + 1e-9) ++frame;
    this.frame = frame;
    if (frame === times.length - 1) {
      this.isPlaying = false;
      $('play').textContent = '▶';
    }
  }

  draw() {
    const {data, frame} = this;
    $('scrubber').value = frame;
    $('clock').textContent = `${this.timeLabel()} s`;
    $('count').textContent = `frame ${frame}/${data.times.length - 1}`;
    const marks = $('marks').getContext('2d');
    marks.setTransform(1, 0, 0, 1, 0, 0);
    marks.clearRect(0, 0, $('marks').width, $('marks').height);
    this.panels.forEach(({section, picture, strip}, index) => {
      if (section.hidden) return;
      const box = this.boxOf(picture);
      if (this.painter && box[2] > 0 && box[3] > 0) this.drawPicture(index, box);
      this.drawMarks(marks, index, picture);
      if (strip) strip.draw(frame);
    });
  }

  /** Returns the element's box on the canvas, in its pixels from the lower left. */
  boxOf(element) {
    const main = $('panels').getBoundingClientRect();
    const own = element.getBoundingClientRect();
    const left = Math.round((own.left - main.left) * this.ratio);
    const bottom = Math.round((main.bottom - own.bottom) * this.ratio);
    return [left, bottom, Math.round(own.width * this.ratio), Math.round(own.height * this.ratio)];
  }

  drawPicture(index, box) {
    const {data, frame, on} = this;
    const panel = data.panels[index];
    const isKnown = data.reference && frame < data.reference.known;
    const hasError = on.error && isKnown && !panel.reference && frame < panel.errors.length;
    const tint = hasError ? (body) => data.bodies[body].moves ? errorColor(data, index, frame, body) : null : () => null;
    const ghost = on.ghost && isKnown && !panel.reference ? data.reference.track : null;
    this.painter.draw({track: data.tracks[index], k: frame, camera: this.camera, box, tint, ghost});
  }

  /** Draws trails, joints and the fate of the run over a picture. */
  drawMarks(context, index, picture) {
    const {data, frame, on} = this;
    const panel = data.panels[index];
    const main = $('panels').getBoundingClientRect();
    const own = picture.getBoundingClientRect();
    context.setTransform(this.ratio, 0, 0, this.ratio, (own.left - main.left) * this.ratio, (own.top - main.top) * this.ratio);
    context.save();
    context.beginPath();
    context.rect(0, 0, own.width, own.height);
    context.clip();
    const view = this.camera.view([0, 0, own.width, own.height]);
    const place = (point) => projected(view, point, own.width, own.height);
    if (on.trails && !panel.reference) drawTrails(context, this, index, place);
    if (on.joints && !panel.reference) drawJoints(context, this, index, place, own);
    if (panel.reference && frame >= data.reference.known) {
      drawNotice(context, `no reference: ${data.reference.fate}`, own, frame >= data.reference.frames);
    } else if (!panel.reference && (panel.refusal || frame >= panel.frames)) {
      drawNotice(context, panel.refusal || panel.fate || 'the run ends', own, true);
    }
    context.restore();
  }

  /** Returns the frame's time, s, with as many digits as tell it from its neighbours: "0.05". */
  timeLabel() {
    const {times} = this.data;
    const rate = (times.length - 1) / (times.at(-1) - times[0] || 1);
    return times[this.frame].toFixed(Math.max(2, Math.ceil(Math.log10(rate))));
  }

  save() {
    const time = this.timeLabel();
    pictureOf(this).toBlob((blob) => {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(blob);
      link.download = `${this.data.scene}_${time}s.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  }
}

/** Shows the frame nearest to the time in #t=1.5, s; else plays, unless the reader prefers reduced motion. */
function begin(player) {
  const {times} = player.data;
  const requested = parseFloat((/[#&]t=([^&]*)/.exec(location.hash) || [])[1]);
  if (!isNaN(requested)) {
    player.play(false);
    player.go(times.reduce((best, time, k) => Math.abs(time - requested) < Math.abs(times[best] - requested) ? k : best, 0));
  } else if (!matchMedia('(prefers-reduced-motion: reduce)').matches) {
    player.play(true);
  }
}

readRecording().then((data) => {
  const player = new Player(data);
  window.player = player;
  begin(player);
  addEventListener('hashchange', () => begin(player));
}).catch((error) => {
  append(document.body, 'p', {id: 'message', textContent: `The page cannot be shown: ${error.message}`});
});
