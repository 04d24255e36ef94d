'use strict';
// Without this script the report is a page of tables and pictures; with it each pair of pictures becomes a viewer.

const MODES = [['side', 'Side by side'], ['flicker', 'Flicker'], ['flip', 'FLIP'], ['bodies', 'Bodies']];
const FLICKER_MS = 450;

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

class Viewer {
  constructor(pair) {
    this.pair = pair;
    this.images = {};
    for (const image of pair.querySelectorAll('img')) this.images[image.dataset.what] = image;
    this.original = pair.querySelector('.pictures');
    this.mode = 'side';
    this.scale = 0;
    this.centre = [0.5, 0.5];
    this.showActual = false;
    this.buttons = {};
    const bar = element('div', {class: 'viewer-bar', role: 'toolbar', 'aria-label': 'How to compare'});
    MODES.forEach(([mode, label], index) => {
      if (!this.needs(mode)) return;
      this.buttons[mode] = element('button', {onclick: () => this.set(mode), title: `key ${index + 1}`}, label);
      bar.append(this.buttons[mode]);
    });
    bar.append(element('span', {class: 'space'}));
    for (const factor of [1, 2, 4, 8, 16]) {
      const button = element('button', {onclick: () => this.zoom(factor)}, `${factor}×`);
      button.dataset.zoom = factor;
      bar.append(button);
    }
    this.bar = bar;
    this.stage = element('div', {class: 'stage'});
    this.original.hidden = true;
    this.original.style.display = 'none';
    this.original.after(bar, this.stage);
    this.zoom(1);
  }

  needs(mode) {
    const pair = this.images.expected && this.images.actual;
    return mode === 'flip' || mode === 'bodies' ? this.images[mode] : pair;
  }

  set(mode) {
    if (!this.buttons[mode]) return;
    this.mode = mode;
    this.draw();
  }

  zoom(factor) {
    this.scale = factor;
    this.draw();
  }

  /// A picture at the zoom, in a window of a size that does not change with it.
  window(what, label) {
    const source = this.images[what];
    const width = Number(source.getAttribute('width')), height = Number(source.getAttribute('height'));
    const wanted = this.mode === 'side' ? 540 : 960;
    // Scale the picture to fit; from twice the size on use whole factors, so that all pixels are equally
    // large.
    const fits = Math.max(1, Math.min(3, wanted / width, (innerHeight - 200) / height));
    const base = fits < 2 ? fits : Math.floor(fits);
    const view = element('div', {class: 'view', 'data-shows': what});
    view.style.width = `${width * base}px`;
    view.style.height = `${height * base}px`;
    const image = element('img', {src: source.src, alt: source.alt, width, height, draggable: 'false'});
    const scale = base * this.scale;
    const limit = (centre, size) => Math.min(0, Math.max(size * base - size * scale, size * base / 2 - centre * size * scale));
    const x = limit(this.centre[0], width), y = limit(this.centre[1], height);
    image.style.imageRendering = scale < 2 ? 'auto' : 'pixelated';
    image.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
    view.append(image);
    view.append(element('span', {class: 'tag'}, label));
    const at = event => {
      const box = view.getBoundingClientRect();
      return [Math.floor((event.clientX - box.left - x) / scale), Math.floor((event.clientY - box.top - y) / scale)];
    };
    view.addEventListener('click', event => {
      const [px, py] = at(event);
      this.centre = [(px + 0.5) / width, (py + 0.5) / height];
      this.zoom(this.scale >= 16 ? 1 : this.scale * 2);
    });
    return view;
  }

  caption(what) {
    return this.images[what].closest('figure').querySelector('figcaption').textContent;
  }

  draw() {
    clearInterval(this.timer);
    for (const [mode, button] of Object.entries(this.buttons)) button.setAttribute('aria-pressed', mode === this.mode);
    for (const button of this.bar.querySelectorAll('[data-zoom]')) {
      button.setAttribute('aria-pressed', Number(button.dataset.zoom) === this.scale);
    }
    if (!this.images.expected) {
      this.stage.replaceChildren(this.window('actual', 'new'));
    } else if (this.mode === 'side') {
      this.stage.replaceChildren(this.window('expected', 'before'), this.window('actual', 'after'));
    } else if (this.mode === 'flicker') {
      this.showActual = false;
      this.flick();
      this.startFlicker();
    } else {
      this.stage.replaceChildren(this.window(this.mode, this.caption(this.mode)));
    }
  }

  flick() {
    this.stage.replaceChildren(this.showActual ? this.window('actual', 'after') : this.window('expected', 'before'));
    this.showActual = !this.showActual;
  }

  startFlicker() {
    clearInterval(this.timer);
    this.timer = setInterval(() => this.flick(), FLICKER_MS);
  }

  /// By hand: the timer stops, and each call shows the other picture.
  flickOnce() {
    if (this.mode !== 'flicker') this.set('flicker');
    clearInterval(this.timer);
    this.flick();
  }
}

class Report {
  constructor() {
    this.cases = Array.from(document.querySelectorAll('section.case'));
    this.viewers = new Map();
    this.current = -1;
    // Made when they come into sight: a report may have hundreds.
    const observer = new IntersectionObserver(entries => {
      for (const entry of entries) {
        if (entry.isIntersecting && !this.viewers.has(entry.target)) {
          this.viewers.set(entry.target, new Viewer(entry.target));
        }
      }
    }, {rootMargin: '400px'});
    for (const pair of document.querySelectorAll('.pair')) {
      pair.addEventListener('pointerenter', () => { this.pair = pair; });
      observer.observe(pair);
    }
    for (const command of document.querySelectorAll('.command')) this.addCopy(command);
    document.addEventListener('keydown', event => this.key(event));
    const named = this.cases.findIndex(entry => '#' + entry.id === decodeURIComponent(location.hash));
    if (named >= 0) this.go(named);
    for (const keys of document.querySelectorAll('.keys')) keys.hidden = false;
  }

  addCopy(command) {
    const button = element('button', {onclick: async () => {
      const text = command.querySelector('code').textContent;
      try {
        await navigator.clipboard.writeText(text);
      } catch (error) {
        const range = document.createRange();
        range.selectNodeContents(command.querySelector('code'));
        getSelection().removeAllRanges();
        getSelection().addRange(range);
        document.execCommand('copy');
      }
      button.textContent = 'Copied';
      setTimeout(() => { button.textContent = 'Copy'; }, 1200);
    }}, 'Copy');
    command.append(button);
  }

  go(index) {
    if (index < 0 || index >= this.cases.length) return;
    if (this.current >= 0) this.cases[this.current].classList.remove('current');
    this.current = index;
    this.cases[index].classList.add('current');
    this.cases[index].scrollIntoView({block: 'start'});
    this.pair = this.cases[index].querySelector('.pair');
    history.replaceState(null, '', '#' + this.cases[index].id);
  }

  viewer() {
    const pair = this.pair ?? document.querySelector('.pair');
    if (!pair) return null;
    if (!this.viewers.has(pair)) this.viewers.set(pair, new Viewer(pair));
    return this.viewers.get(pair);
  }

  nextPair(step) {
    const pairs = Array.from(document.querySelectorAll('.pair'));
    const at = pairs.indexOf(this.pair);
    const next = pairs[at < 0 ? 0 : at + step];
    if (!next) return;
    this.pair = next;
    next.scrollIntoView({block: 'start'});
  }

  /// Scroll to the element that a key changes.
  show(viewer, mode) {
    viewer.set(mode);
    viewer.pair.scrollIntoView({block: 'nearest'});
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const viewer = this.viewer();
    const mode = MODES[Number(event.key) - 1];
    if (event.key === 'j') this.go(this.current + 1);
    else if (event.key === 'k') this.go(this.current - 1);
    else if (event.key === 'n') this.nextPair(1);
    else if (event.key === 'p') this.nextPair(-1);
    else if (viewer && mode && event.key !== ' ') this.show(viewer, mode[0]);
    else if (viewer && event.key === ' ') viewer.flickOnce();
    else if (viewer && event.key === '+') viewer.zoom(Math.min(16, viewer.scale * 2));
    else if (viewer && event.key === '-') viewer.zoom(Math.max(1, viewer.scale / 2));
    else return;
    event.preventDefault();
  }
}

new Report();
