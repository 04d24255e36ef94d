'use strict';
// Adds three ways to compare each pair of pictures to the report, which is complete without this script.

const MODES = [['side', 'Side by side', ['expected', 'actual']], ['flicker', 'Flicker', ['expected', 'actual']],
  ['flip', 'FLIP', ['flip']]];
const FLICKER_MS = 450;

function button(text, onclick) {
  const made = document.createElement('button');
  made.textContent = text;
  made.addEventListener('click', onclick);
  return made;
}

/// Shows some of a pair's pictures.
class Viewer {
  constructor(pair) {
    this.pair = pair;
    this.figures = {};
    this.buttons = {};
    for (const image of pair.querySelectorAll('img')) this.figures[image.dataset.what] = image.closest('figure');
    if (!this.figures.expected) return;
    const bar = document.createElement('div');
    bar.className = 'viewer-bar';
    MODES.forEach(([mode, label, pictures], index) => {
      if (!pictures.every(what => this.figures[what])) return;
      this.buttons[mode] = button(label, () => this.set(mode));
      this.buttons[mode].title = `key ${index + 1}`;
      bar.append(this.buttons[mode]);
    });
    pair.querySelector('.pictures').before(bar);
    this.set('side');
  }

  set(mode) {
    if (!this.buttons[mode]) return;
    clearInterval(this.timer);
    this.mode = mode;
    for (const [name, made] of Object.entries(this.buttons)) made.setAttribute('aria-pressed', name === mode);
    this.show(MODES.find(([name]) => name === mode)[2]);
    if (mode !== 'flicker') return;
    this.flick();
    this.timer = setInterval(() => this.flick(), FLICKER_MS);
  }

  show(pictures) {
    for (const [what, figure] of Object.entries(this.figures)) figure.hidden = !pictures.includes(what);
  }

  flick() {
    this.showsActual = !this.showsActual;
    this.show([this.showsActual ? 'actual' : 'expected']);
  }

  /// Stops the timer and shows the other picture.
  flickOnce() {
    if (!this.buttons.flicker) return;
    if (this.mode !== 'flicker') this.set('flicker');
    clearInterval(this.timer);
    this.flick();
  }
}

class Report {
  constructor() {
    this.cases = Array.from(document.querySelectorAll('section.case'));
    this.pairs = Array.from(document.querySelectorAll('.pair'));
    this.caseOf = this.pairs.map(pair => this.cases.indexOf(pair.closest('.case')));
    this.viewers = this.pairs.map(pair => new Viewer(pair));
    this.current = -1;
    this.pair = -1;
    this.pairs.forEach((pair, index) => pair.addEventListener('pointerenter', () => { this.pair = index; }));
    for (const command of document.querySelectorAll('.command')) this.addCopy(command);
    document.addEventListener('keydown', event => this.key(event));
    const named = this.cases.findIndex(entry => '#' + entry.id === decodeURIComponent(location.hash));
    if (named >= 0) this.go(named);
    for (const keys of document.querySelectorAll('.keys')) keys.hidden = false;
  }

  addCopy(command) {
    const code = command.querySelector('code');
    const copy = button('Copy', () => {
      getSelection().selectAllChildren(code);
      document.execCommand('copy');
      copy.textContent = 'Copied';
    });
    command.append(copy);
  }

  go(index) {
    const entry = this.cases[index];
    if (entry) this.choose(index, this.pairs.indexOf(entry.querySelector('.pair')), entry);
  }

  /// Makes a case and one of its pairs current (-1: it has none), and scrolls to `target`.
  choose(index, pair, target) {
    if (this.current >= 0) this.cases[this.current].classList.remove('current');
    [this.current, this.pair] = [index, pair];
    this.cases[index].classList.add('current');
    target.scrollIntoView({block: 'start'});
    history.replaceState(null, '', '#' + this.cases[index].id);
  }

  /// Goes to the next pair (1) or the previous one (-1), also from a case without pairs.
  goToPair(by) {
    const pairsBefore = this.caseOf.filter(index => index < this.current).length;
    const index = this.pair < 0 ? pairsBefore + Math.min(by, 0) : this.pair + by;
    if (this.pairs[index]) this.choose(this.caseOf[index], index, this.pairs[index]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const mode = MODES[Number(event.key) - 1];
    // Compare the first pair if nothing is chosen yet.
    if (this.current < 0 && (mode || event.key === ' ')) this.pair = Math.max(this.pair, 0);
    const viewer = this.viewers[this.pair];
    if (event.key === 'j') this.go(this.current + 1);
    else if (event.key === 'k') this.go(this.current - 1);
    else if (event.key === 'n') this.goToPair(1);
    else if (event.key === 'p') this.goToPair(-1);
    else if (viewer && event.key === ' ') viewer.flickOnce();
    else if (viewer && mode) {
      viewer.set(mode[0]);
      viewer.pair.scrollIntoView({block: 'nearest'});
    } else return;
    event.preventDefault();
  }
}

new Report();
