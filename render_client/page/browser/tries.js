// The tries of an exercise side by side: scores, and pictures of path, force and deviation in the same scale for all.
'use strict';

const SHOWN_TRIES = 8;  // the newest tries
const SVG = 'http://www.w3.org/2000/svg';
const WIDE = 200, HIGH = 100;  // size of a picture

let tries = [];  // in the order in which the gateway keeps them, oldest first
let learned = '';
window.sectio.tries = () => tries;

// They are asked for when a score is told, and when a task begins.
async function learn_tries() {
  const key = JSON.stringify([state.task, state.score_lines_heard]);
  if (key === learned) return;
  learned = key;
  try {
    tries = await (await fetch('tries')).json();
  } catch {
    learned = '';
    return;
  }
  byId('show_tries').hidden = tries.length === 0;
  byId('show_tries').textContent =
    tries.length > SHOWN_TRIES ? `Tries (the last ${SHOWN_TRIES} of ${tries.length})` : `Tries (${tries.length})`;
  show_tries();
}

function shape(kind, attributes) {
  const made = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function picture(...shapes) {
  const made = shape('svg', { viewBox: `0 0 ${WIDE} ${HIGH}` });
  made.append(...shapes);
  return made;
}

const line_through = (points) => shape('polyline', { points: points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' ') });
const places_of = (one) => one.tools.flatMap((tool) => tool.at_mm).filter(Boolean);

// From above, in millimetres.
function path_picture(one, box) {
  const scale = Math.min(WIDE / (box.right - box.left + 1), HIGH / (box.top - box.bottom + 1));
  const place = ([x, y]) => [(x - box.left) * scale, HIGH - (y - box.bottom) * scale];
  return picture(...one.tools.map((tool) => line_through(tool.at_mm.filter(Boolean).map(place))));
}

// The forces of a try, from its first touch to its last.
function touching(one) {
  const touches = one.tools.flatMap((tool) => tool.force_n.flatMap((force_n, i) => (force_n > 0 ? [i] : [])));
  const first = touches.reduce((a, b) => Math.min(a, b), Infinity), last = touches.reduce((a, b) => Math.max(a, b), 0);
  return one.tools.map((tool) => tool.force_n.slice(Math.min(first, last), last + 1));
}
function force_picture(one, longest_s, most_n) {
  const place = (force_n, i) => [WIDE * i * one.every_s / longest_s, HIGH - HIGH * force_n / most_n];
  return picture(...touching(one).map((forces_n) => line_through(forces_n.map(place))));
}

// The deviation in each part of the line, in millimetres; NaN where no blade was.
const ALONG = 'along the line, mm';
const beside_mm = (one) => one.score.find((line) => line.startsWith(ALONG))?.slice(ALONG.length).trim().split(' ').map(Number) ?? [];
function deviation_picture(one, most_mm) {
  const parts = beside_mm(one), wide = WIDE / Math.max(1, parts.length);
  return picture(...parts.map((mm, i) => [mm, i]).filter(([mm]) => mm >= 0).map(([mm, i]) =>
    shape('rect', { x: i * wide, y: HIGH - HIGH * mm / most_mm, width: 0.8 * wide, height: HIGH * mm / most_mm })));
}

// A number stays with its unit.
const unbroken = (text) => text.replace(/(\d) (?=(ml|mm|m|s|N|%)(\W|$))/g, '$1\u00a0');

// A line of a score is a name, blanks, and a value. Targets that were reached or missed stand under their names.
function entry(line) {
  const [, name, value] = unbroken(line).match(/^(.*?)\s{2,}(.*)$/) ?? [null, unbroken(line), ''];
  if (name === 'path') {
    const parts = value.split(/\s{3,}/);
    return [`path, ${parts.pop()}`, parts.join(', '), ''];
  }
  if (name !== 'reached' && name !== 'missed') return [name, value.replace(/ {2,}\(/g, ' (').replace(/ {2,}/g, ', '), ''];
  const [target, got] = value.split(': ');
  return [target, `${got}, ${name}`, name];
}

function row(name, cells) {
  const made = document.createElement('tr');
  made.append(element('th', name), ...cells.map((cell) => {
    const data = element('td', '');
    data.append(cell);
    return data;
  }));
  return made;
}

function show_tries() {
  const shown = tries.slice(-SHOWN_TRIES).reverse();
  if (shown.length === 0) return;
  const most = (values, least) => values.reduce((a, b) => Math.max(a, b), least);
  const all = shown.flatMap(places_of), reach = (i, sign) => sign * most(all.map((p) => sign * p[i]), -1e4);
  const box = { left: reach(0, -1), right: reach(0, 1), bottom: reach(1, -1), top: reach(1, 1) };
  const most_n = most(shown.flatMap((one) => one.tools.flatMap((tool) => tool.force_n)), 0.1);
  const longest_s = most(shown.map((one) => one.every_s * (touching(one)[0]?.length ?? 0)), 1);
  const most_mm = most(shown.flatMap(beside_mm).filter((mm) => mm >= 0), 0.5);
  const scores = shown.map((one) => new Map(one.score.filter((line) => !line.startsWith(ALONG)).map((line) => {
    const [name, value, verdict] = entry(line);
    return [name, element('span', value, { className: verdict })];
  })));
  const names = [...new Set(scores.flatMap((score) => [...score.keys()]))];
  byId('tries_table').replaceChildren(
    row('', shown.map((one, i) => `${tries.length - i}`)),
    row('when', shown.map((one) => new Date(1000 * one.begun_s).toLocaleString())),
    row('who', shown.map((one) => one.hands.join(', '))),
    ...names.map((name) => row(name, scores.map((score) => score.get(name) ?? ''))),
    row('path, from above', shown.map((one) => path_picture(one, box))),
    row(`force from the first touch on, to ${most_n.toFixed(1)} N, over ${longest_s.toFixed(0)} s`, shown.map((one) => force_picture(one, longest_s, most_n))),
    ...(shown.some((one) => beside_mm(one).length > 0)
      ? [row(`beside the line, to ${most_mm.toFixed(1)} mm`, shown.map((one) => deviation_picture(one, most_mm)))] : []));
}

const hide_tries = () => { byId('tries').hidden = true; };
byId('show_tries').onclick = () => { byId('tries').hidden = !byId('tries').hidden; };
byId('hide_tries').onclick = hide_tries;
window.addEventListener('keydown', (event) => { if (event.key === 'Escape') hide_tries(); });
