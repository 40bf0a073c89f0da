// The hand at this page: mouse, touch, keys and a pad. What they mean is decided in page.cpp.
'use strict';

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

const point = (event) => call('point', ...place(event), event.buttons & 1, event.buttons & 2);

canvas.addEventListener('pointerdown', (event) => {
  canvas.focus();
  try {
    canvas.setPointerCapture(event.pointerId);
  } catch { /* the pointer has gone */ }
  fingers.set(event.pointerId, [event.clientX, event.clientY]);
  if (fingers.size === 1) deed = deed_of(event);
  else {
    if (deed === 'point') call('point', ...place(event), 0, 0);
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
    if (deed === 'point') call('point', ...place(event), event.buttons & 1, event.buttons & 2);
    if (fingers.size === 0) deed = '';
  });

canvas.addEventListener('wheel', (event) => {
  event.preventDefault();
  const turn = Math.max(-1, Math.min(1, (event.deltaY || event.deltaX) / 100));
  if (holds() && !event.shiftKey) call('deepen', 0.001 * turn);
  else call('zoom', Math.exp(0.15 * turn));
}, { passive: false });
canvas.addEventListener('contextmenu', (event) => event.preventDefault());

const KEYS = { q: [0.1, 0], e: [-0.1, 0], r: [0, 0.1], f: [0, -0.1] };
window.addEventListener('keydown', (event) => {
  const turn = KEYS[event.key.toLowerCase()];
  if (turn && !event.ctrlKey && !event.metaKey && !event.altKey && event.target.id !== 'name') call('turn', ...turn);
});
