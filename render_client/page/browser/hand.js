// The hand at this page: mouse, touch, keys and a pad. What they mean is decided in page.cpp.
'use strict';

const HINT_MS = 2500;
const ASTRAY = 0.1, ASTRAY_S = 1;  // share of half a picture, and a time, by which an instrument isn't at its wish
const AT_REST = 0.01;              // a wish that moves less between two words of the program rests
const LEAST_N = 0.02;              // tissue that presses less holds nothing up

// ---- a pad ----

const PAD_IDLE = 0.12;  // share of a stick's way, which a thumb that rests may be off
const beyond_idle = (share) =>
  Math.abs(share) < PAD_IDLE ? 0 : (Math.sign(share) * (Math.abs(share) - PAD_IDLE)) / (1 - PAD_IDLE);

// The buttons are those of the standard mapping: 0 is A, 4 and 5 are shoulders, 6 and 7 triggers.
function push_pad() {
  const pad = [...(navigator.getGamepads?.() ?? [])].find((p) => p?.connected);
  if (!pad || !holds()) return;
  const [x = 0, y = 0, roll = 0, pitch = 0] = pad.axes.map(beyond_idle);
  const pressed = (i) => pad.buttons[i]?.value ?? 0;
  call('pad', x, -y, pressed(6) - pressed(7), -roll, -pitch, pressed(0) > 0.5 || pressed(5) > 0.5 ? 1 : 0,
    pressed(4) > 0.5 ? 1 : 0);
}

// ---- mouse, touch, keys ----

const fingers = new Map();   // pointers that are down, by id
let deed = '';               // what the drag does: point, orbit, pan, pinch

const place = (event) => {
  const box = canvas.getBoundingClientRect();
  return [2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height];
};
function deed_of(event) {
  if (event.altKey || event.button === 1) return 'orbit';
  if (event.shiftKey) return 'pan';
  if (holds()) return 'point';
  return event.button === 2 ? 'pan' : 'orbit';
}

// A finger has one button. One that comes down while jaws are closed carries what they hold.
let by_touch = matchMedia('(pointer: coarse)').matches;
let closes = false, carries = false;
let last_place = [0, 0], is_pressed = 0;
function point(event, pressed = event.buttons & 1) {
  const finger = event.pointerType !== 'mouse';
  last_place = place(event);
  is_pressed = finger && carries ? 0 : pressed;
  call('point', ...last_place, is_pressed, finger ? closes : event.buttons & 2);
}

canvas.addEventListener('pointerdown', (event) => {
  canvas.focus();
  try {
    canvas.setPointerCapture(event.pointerId);
  } catch { /* the pointer has gone */ }
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
  if (fingers.size === 1) {
    deed = deed_of(event);
    carries = closes;
  } else {
    if (deed === 'point') point(event, 0);
    deed = 'pinch';
  }
  if (deed === 'point') point(event);
});

canvas.addEventListener('pointermove', (event) => {
  const before = fingers.get(event.pointerId);
  if (!before) {
    if (holds()) point(event);
    return;
  }
  const side = Math.min(0.75 * canvas.clientWidth, canvas.clientHeight);
  const dx = (event.clientX - before[0]) / side, dy = (event.clientY - before[1]) / side;
  if (deed === 'point') point(event);
  else if (deed === 'orbit') call('orbit', 4 * dx, 4 * dy);
  else if (deed === 'pan') call('pan', dx, -dy);
  else if (deed === 'pinch') pinch(event, before, dx, dy);
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
});

function pinch(event, before, dx, dy) {
  const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
  if (!other) return;
  const length = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
  call('zoom', Math.max(1, length(before)) / Math.max(1, length([event.clientX, event.clientY])));
  call('pan', 0.5 * dx, -0.5 * dy);
}

for (const kind of ['pointerup', 'pointercancel'])
  canvas.addEventListener(kind, (event) => {
    fingers.delete(event.pointerId);
    if (deed === 'point') point(event);
    if (fingers.size === 0) deed = '';
  });

canvas.addEventListener('wheel', (event) => {
  event.preventDefault();
  const turn = Math.max(-1, Math.min(1, (event.deltaY || event.deltaX) / 100));
  if (holds() && !event.shiftKey) call('deepen', 0.001 * turn);
  else call('zoom', Math.exp(0.15 * turn));
}, { passive: false });
canvas.addEventListener('contextmenu', (event) => event.preventDefault());

// ---- buttons for fingers: what the wheel, the second button and keys do ----

window.addEventListener('pointerdown', (event) => { by_touch = event.pointerType !== 'mouse'; }, true);

const REPEATS_AFTER_MS = 400, REPEATS_MS = 120;
const BY_TOUCH = {
  shallower: () => call('deepen', -0.001), deeper: () => call('deepen', 0.001),
  left: () => call('turn', 0.1, 0), right: () => call('turn', -0.1, 0),
  forwards: () => call('turn', 0, 0.1), backwards: () => call('turn', 0, -0.1),
};

// While another finger is on the picture, a browser makes no click of a touch.
function on_press(id, act) {
  byId(id).addEventListener('pointerdown', act);
  byId(id).onclick = ({ detail }) => { if (detail === 0) act(); };  // by a key
}

let repeats = 0;
const stop_repeating = () => clearInterval(repeats);
for (const [id, act] of Object.entries(BY_TOUCH)) {
  on_press(id, (event) => {
    act();
    if (!event) return;
    stop_repeating();
    const since_ms = performance.now();
    repeats = setInterval(() => { if (performance.now() - since_ms > REPEATS_AFTER_MS) act(); }, REPEATS_MS);
  });
  for (const kind of ['pointerup', 'pointercancel', 'pointerleave']) byId(id).addEventListener(kind, stop_repeating);
}

on_press('jaws', () => {
  closes = !closes;
  call('point', ...last_place, is_pressed, closes);
});

// An instrument that is taken in hand has open jaws.
let held_before = null;
function show_touch() {
  const is_of_use = by_touch && holds();
  if (closes && (!is_of_use || state.held !== held_before)) {
    closes = false;
    call('point', ...last_place, is_pressed, closes);
  }
  if (!is_of_use) stop_repeating();
  held_before = state.held;
  byId('touch').hidden = !is_of_use;
  byId('depth').textContent = `${(1000 * state.depth_m).toFixed(0)} mm`;
  const of_jaws = is_of_use && state.tools[state.held]?.has_jaws;
  byId('jaws').textContent = closes ? (of_jaws ? 'Open jaws' : 'Let down') : (of_jaws ? 'Close jaws' : 'Lift');
}

const KEYS = { q: [0.1, 0], e: [-0.1, 0], r: [0, 0.1], f: [0, -0.1] };
window.addEventListener('keydown', (event) => {
  const turn = KEYS[event.key.toLowerCase()];
  if (turn && !event.ctrlKey && !event.metaKey && !event.altKey && event.target.id !== 'name') call('turn', ...turn);
});

// ---- what a hand is told ----

// A server hears the bridge that spoke first. An instrument that isn't where this page wants it follows another hand,
// or none; tissue alone may hold it up, unless another bridge leads it, too. One bridge is behind a wish that moves.
let astray_since_s = null, wished_before = null;
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
function is_astray(tool) {
  const { wish } = state;
  const rests = wish && wished_before && apart(wish, wished_before) < AT_REST;
  wished_before = wish ?? null;
  const is_free = tool.hands !== 1 || (tool.force_n < LEAST_N && rests);
  const astray = wish && is_free && (!tool.present || (tool.tip && apart(wish, tool.tip) > ASTRAY));
  astray_since_s = astray ? astray_since_s ?? now() : null;
  return astray && now() - astray_since_s > ASTRAY_S;
}
function who_leads(tool) {
  if (!is_astray(tool)) return '';
  if (tool.hands > 1) return `Another hand moves the ${tool.name}.`;
  if (tool.hands > 0) return `The ${tool.name} doesn't follow this page: another device may move it.`;
  return end_s() > 0 ? 'This is a record: its instruments go their old way.'
    : `No bridge moves the ${tool.name} for this page.`;
}

let presses_beside = 0, hinted_ms = -Infinity, has_held = false;
function hint(me) {
  has_held ||= holds();
  if (state.presses_beside > presses_beside) hinted_ms = performance.now();
  presses_beside = state.presses_beside;
  const ordered = words_of_order();
  if (ordered) return ordered;
  if (holds() && (state.ended || mute_s !== null || !window.sectio.connected)) return '';
  if (state.speed === 0 && !state.ended) return 'The session is paused.';
  const tool = state.tools[state.held];
  if (!tool) return first_word(me);
  const until = me?.may_lead ? 'you press Thaw' : 'somebody who leads presses Thaw';
  if (tool.frozen) return `The ${tool.name} is frozen: it doesn't follow your hand until ${until}.`;
  if (state.lifted) return 'Let the button go, and press again: other tissue may be there now.';
  const led = who_leads(tool);
  if (led) return led;
  return performance.now() - hinted_ms < HINT_MS ? 'There is no body under the pointer: press on tissue.' : '';
}

// To somebody who holds nothing yet.
function first_word(me) {
  if (has_held || !me || state.ended || state.tools.length === 0 || !window.sectio.connected) return '';
  if (!me.may_write) return 'You are watching: drag to turn the view. The whole address, with what follows #, lets you take part.';
  const panel = document.body.classList.contains('folded') ? 'open the panel and ' : '';
  const words = state.tools.some((tool) => tool.holder === 0) ? 'Take in hand' : 'Take over';
  return `To hold an instrument, ${panel}press ${words}.`;
}
