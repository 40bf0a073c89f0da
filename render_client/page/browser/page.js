// The page's script: the socket, the mouse, and what stands beside the picture. All that is known of the session, and
// every picture, comes from the program that is compiled to WebAssembly (page.cpp).
'use strict';

const FULL_FORCE_N = 5;     // force of a full bar
const RETRY_MS = 1000;      // wait after a connection was lost
const CONNECT_MS = 5000;    // a connection that takes longer is tried again
const KEEP_ALIVE_MS = 50;   // a hand goes on to speak where no pictures are drawn
const SILENT_S = 1;         // silence before the page says so
const SURE_MS = 4000;       // a second press within this time begins the session anew,
const DOUBLE_MS = 300;      // but for one that comes at once
const SETTLES_MS = 2000;    // an order is under way, and what it changes isn't told yet
const CLAIM = { claim: 0, take: 1, give: 2, release: 3 };
const MOST_NAME_BYTES = 64, MOST_TOKEN_BYTES = 128;  // the gateway takes no more: common/messages/live_fields.h

const byId = (id) => document.getElementById(id);
const canvas = byId('canvas');
const now = () => performance.now() / 1000;

let program = null;   // the WebAssembly module
let socket = null;
let state = null;     // what the program said last
let refusal = '';     // reason for having no connection
let lost_s = null;    // when the connection was lost,
let open_s = 0;       // and when the gateway first spoke on this one
let mute_s = null;    // time of the last word of a server that is silent
let mute = '';        // which server that is
// For tests: what is known, and the connection.
window.sectio = { get socket() { return socket; }, get state() { return state; }, get connected() { return socket?.readyState === WebSocket.OPEN; } };

const call = (name, ...values) => program['_page_' + name](...values);

// A line among what happened, in place of the one of the same topic.
const note = (text, topic = text) => program.ccall('page_note', null, ['string', 'string'], [topic, text]);
const clock = () => new Date().toLocaleTimeString();
const holds = () => state !== null && state.held !== null;
const how_long = (since_s) => `${(now() - since_s).toFixed(0)} s`;

// A browser may be told to keep nothing.
function recalled(storage, key) {
  try { return window[storage].getItem(key); } catch { return null; }
}
function keep(storage, key, value) {
  try { window[storage].setItem(key, value); } catch { /* it is asked again */ }
}

// ---- the socket ----

// The beginning of a text that has at most so many bytes in UTF-8: an encoder writes whole characters.
function beginning(text, most_bytes) {
  const bytes = new Uint8Array(most_bytes);
  const { written } = new TextEncoder().encodeInto(text, bytes);
  return new TextDecoder().decode(bytes.subarray(0, written));
}

// The name that the gateway hears is the one in the field.
function own_name() {
  const field = byId('name'), name = beginning(field.value.trim(), MOST_NAME_BYTES);
  if (field.value !== name) field.value = name;
  return name;
}

// With a broken escape the text stands as it is. A token that is too long is wrong without its end, too.
function token() {
  let text = location.hash.slice(1);
  try {
    text = decodeURIComponent(text);
  } catch { /* a broken escape */ }
  return beginning(text, MOST_TOKEN_BYTES);
}
// ?protocol= stands for a page of another version.
const protocol = () =>
  new URLSearchParams(location.search).get('protocol') ?? program.UTF8ToString(call('protocol'));

function introduce() {
  program.ccall('page_connected', null, ['string', 'string'], [own_name(), token()]);
  flush();
}

function flush() {
  const from = call('outgoing');
  const size = call('outgoing_size');
  if (size > 0 && window.sectio.connected) socket.send(program.HEAPU8.slice(from, from + size));
}

async function connect() {
  let spoken = '';
  try {
    spoken = (await (await fetch('version', { signal: AbortSignal.timeout(CONNECT_MS) })).text()).trim();
  } catch {
    refusal = 'no connection to the gateway';
  }
  const mine = protocol();
  if (spoken && mine !== spoken) {
    refusal = `this page speaks ${mine}, the gateway ${spoken}: load the page again`;
  }
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`, mine);
  socket.binaryType = 'arraybuffer';
  let has_spoken = false;
  const late = setTimeout(() => socket.close(), CONNECT_MS);
  socket.onopen = () => {
    clearTimeout(late);
    introduce();
  };
  socket.onmessage = (event) => {
    const bytes = new Uint8Array(event.data);
    program.HEAPU8.set(bytes, call('incoming', bytes.length));
    call('receive', now());
    // The gateway's first word has the events of late, which would push this line out.
    if (lost_s !== null) note(`connected again at ${clock()}, after ${how_long(lost_s)}`);
    lost_s = null;
    if (has_spoken) return;
    has_spoken = true;
    refusal = '';
    open_s = now();
  };
  socket.onclose = ({ reason }) => {
    clearTimeout(late);
    if (reason) refusal = `the gateway has ended the connection: this page ${reason}`;
    refusal ||= 'the connection to the gateway is lost';
    if (has_spoken) lose(reason);
    setTimeout(connect, RETRY_MS);
  };
}

function lose(reason) {
  const tool = holds() ? `, and with it the ${state.tools[state.held].name} that you held` : '';
  note(`connection lost at ${clock()}${tool}` + (reason ? `: this page ${reason}` : ''));
  call('disconnected');
  lost_s = now();
  mute_s = null;
  going = null;
}

// A page that was busy itself has had no time to listen.
let watched_s = 0;
function watch_server() {
  const was_busy = now() - watched_s > SILENT_S / 2;
  watched_s = now();
  if (was_busy || !window.sectio.connected || state.ended || state.silent_s === null) return;
  const silent_s = Math.min(state.silent_s, now() - open_s);
  if (mute_s === null && silent_s > SILENT_S) {
    mute_s = now() - silent_s;
    mute = state.silent ? `the server of ${state.silent}` : 'the server';
    ask_gateway(mute, ++silences);
  } else if (mute_s !== null && silent_s < SILENT_S) {
    note(`${mute} was silent for ${how_long(mute_s)}, until ${clock()}`, 'silence');
    mute_s = null;
  }
}

// A gateway that doesn't answer either is what is silent, until it has answered twice in a row. It is asked again as
// long as the silence lasts.
let silences = 0;
async function ask_gateway(server, silence, answers = 0) {
  try {
    await fetch('version', { signal: AbortSignal.timeout(RETRY_MS) });
    ++answers;
  } catch {
    answers = 0;
  }
  if (mute_s === null || silence !== silences) return;
  if (answers !== 1) mute = answers === 0 ? 'the gateway' : server;
  setTimeout(ask_gateway, RETRY_MS, server, silence, answers);
}

// ---- pictures ----

function pixel_size() {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  return [Math.max(16, Math.round(canvas.clientWidth * scale)), Math.max(16, Math.round(canvas.clientHeight * scale))];
}

let last_tick_ms = 0;
function tick(draws) {
  last_tick_ms = performance.now();
  push_pad();
  const drawn = call('tick', now(), draws ? 1 : 0);
  flush();
  if (!draws) return;
  state = JSON.parse(program.UTF8ToString(call('describe', now())));
  if (drawn && !wears_headset()) mark();
}

let shown_ms = 0;
function animate() {
  requestAnimationFrame(animate);  // first: one fault doesn't stop the page
  if (!wears_headset()) tick(true);
  if (performance.now() - shown_ms > 100) {
    shown_ms = performance.now();
    show();
  }
}

const to_px = ([x, y]) => [(0.5 + 0.5 * x) * canvas.clientWidth, (0.5 - 0.5 * y) * canvas.clientHeight];

// While tissue holds the instrument up, a line leads from it to where the hand wants it.
function mark() {
  const tip = state.held !== null && state.wish ? state.tools[state.held]?.tip : null;
  for (const id of ['wish', 'pull']) byId(id).style.visibility = tip ? 'visible' : 'hidden';
  if (!tip) return;
  const [wx, wy] = to_px(state.wish), [tx, ty] = to_px(tip);
  for (const [name, value] of [['cx', wx], ['cy', wy]]) byId('wish').setAttribute(name, value);
  for (const [name, value] of [['x1', tx], ['y1', ty], ['x2', wx], ['y2', wy]]) byId('pull').setAttribute(name, value);
}

// Without WebGL 2 the gateway's own pictures are shown, one as soon as the one before it has come.
let no_webgl = '';
function show_stills() {
  no_webgl = 'this browser has no WebGL 2: the gateway draws';
  const still = byId('still');
  still.hidden = false;
  canvas.hidden = true;
  let count = 0;
  const next = () => { still.src = `frame.jpg?${++count}`; };
  still.onload = () => { window.sectio.stills = count; next(); };
  still.onerror = () => setTimeout(next, RETRY_MS);
  next();
}

// ---- what stands beside the picture ----

function element(kind, text, attributes = {}) {
  const made = document.createElement(kind);
  made.textContent = text;
  return Object.assign(made, attributes);
}

const button = (text, act) => element('button', text, { onclick: act });
const claim = (tool, action, person = 0) => { call('claim', tool, CLAIM[action], person); flush(); };

function buttons_of(tool, index, me, names) {
  if (!me?.may_write) return [];
  const is_own = tool.holder === state.you;
  const own = is_own ? button('Put down', () => claim(index, 'release'))
    : tool.holder === 0 ? button('Take in hand', () => claim(index, 'claim'))
    : button('Take over', () => claim(index, 'take'));
  const others = state.people.filter((p) => p.may_write && p.id !== state.you && p.id !== tool.holder);
  const give = others.map((p) => button('Give to ' + names.get(p.id), () => claim(index, 'give', p.id)));
  const [words, kind] = tool.frozen ? ['Thaw', 'thaw'] : ['Freeze', 'freeze'];
  const freeze = button(words, () => order(kind, { tool: index }));
  const put_down = button('Have it put down', () => claim(index, 'release'));
  const is_anothers = !is_own && tool.holder !== 0;
  return [own, ...(is_own || me.may_lead ? give : []), ...(me.may_lead && is_anothers ? [put_down] : []),
    ...(me.may_lead ? [freeze] : [])];
}

// A list is made anew only when something in it has changed: a button must live from press to release.
function show_list(id, key, make) {
  const list = byId(id);
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...make());
}

// A text that stays is left alone: a screen reader would read it again.
function say(id, text) {
  const place = byId(id);
  if (place.textContent !== text) place.textContent = text;
  place.hidden = text === '';
}

// A control shows what the session has, but for while somebody uses it. So does the text beside it.
const used_ms = new Map();
function follow(id, value, words_of = () => '') {
  const control = byId(id);
  const in_use = control.matches(':active') || performance.now() - (used_ms.get(id) ?? -Infinity) < SETTLES_MS;
  if (!in_use) control.value = value;
  const words = byId(id + '_said');
  if (words) words.textContent = words_of(in_use ? Number(control.value) : value);
}

// A frozen instrument that isn't in the scene stays away.
const frozen_words = (tool) => (!tool.frozen ? '' : tool.present ? ', frozen' : ', frozen, and not in the scene');

const in_line = ({ text, count, time_s }) => {
  const item = element('li', text + ' ');
  const when = time_s === undefined ? '' : `${count > 1 ? 'last ' : ''}at ${time_s.toFixed(1)} s`;
  item.append(element('span', [count > 1 ? `${count} times` : '', when].filter(Boolean).join(', '), { className: 'when' }));
  return item;
};

// The end of what is played again; a live session has none. The state may say it. Otherwise the furthest time that was
// seen stands for it, once a line has said that something is played: a live session forgets what comes after a moment
// to which it goes back.
let furthest_s = 0, furthest_of = '', is_played = false;
function end_s() {
  if (furthest_of !== state.session) [furthest_s, furthest_of, is_played] = [0, state.session, false];
  furthest_s = Math.max(furthest_s, state.time_s);
  is_played ||= state.lines.some(({ text }) => text.includes(' is shown from '));
  return state.ends_s ?? (is_played ? furthest_s : 0);
}

function show() {
  if (!state) return;
  watch_server();
  const me = state.people.find((p) => p.id === state.you);
  say('hint', hint(me));
  show_touch();
  const names = new Map(state.people.map(({ id, name }) => [id, name]));
  const is_silent = mute_s !== null && !state.ended && window.sectio.connected;
  const silent = is_silent ? `${mute} has been silent` : '';
  // The gateway knows a token a moment after it knows the page.
  const is_refused = me && !me.may_write && token() && now() - open_s > SILENT_S;
  const wrong = is_refused ? 'the address ends in a wrong token: you are watching' : '';
  say('warning_said', window.sectio.connected ? silent || wrong || no_webgl : state.ended ? 'the session has ended' : refusal);
  say('warning_for', is_silent ? ` for ${how_long(mute_s)}` : '');
  byId('warning').hidden = byId('warning_said').hidden;
  byId('session').textContent = state.session || 'waiting for a session';
  const pace = state.ended ? ', ended' : state.speed === 0 ? ', paused' : (state.speed ?? 1) === 1 ? '' : `, × ${state.speed.toFixed(2)}`;
  byId('time').textContent = state.session ? state.time_s.toFixed(1) + ' s' + pace : '';
  byId('orders').hidden = !me?.may_lead || state.ended;
  byId('orders').disabled = byId('instruments').disabled = !window.sectio.connected || state.ended;
  byId('moment').max = Math.max(1, state.time_s, end_s());
  follow('moment', state.time_s, (s) => `${s.toFixed(1)} s`);
  if (state.speed > 0) follow('speed', state.speed);
  follow('tilt', state.tilt_deg ?? 0, (deg) => `${Math.round(deg)}°`);
  byId('pause').textContent = state.speed === 0 ? 'Go on' : 'Pause';

  const said_of_tools = state.tools.map((t) => [t.name, t.holder, frozen_words(t)]);
  show_list('tools', JSON.stringify([said_of_tools, state.people, state.you]), () =>
    state.tools.map((tool, i) => {
      const holder = tool.holder === 0 ? '' : ': ' + (tool.holder === state.you ? 'you' : names.get(tool.holder) ?? '');
      const item = element('li', tool.name + holder + frozen_words(tool));
      const bar = element('span', '', { className: 'bar' });
      bar.append(element('i', ''));
      item.append(bar, element('span', '', { className: 'force' }), element('br', ''));
      item.append(...buttons_of(tool, i, me, names));
      return item;
    }));
  state.tools.forEach((tool, i) => {
    const item = byId('tools').children[i];
    item.querySelector('.bar i').style.width = Math.min(100, 100 * tool.force_n / FULL_FORCE_N) + '%';
    item.querySelector('.force').textContent =
      tool.force_n.toFixed(2) + ' N' + (state.held === i ? `, ${(1000 * state.depth_m).toFixed(0)} mm deep (wheel)` : '');
  });
  show_list('people', JSON.stringify([state.people, state.you]), () => state.people.map((p) =>
    element('li', names.get(p.id) + (p.id === state.you ? ' (you)' : '') + (p.may_write ? '' : ', watching'))));
  show_list('bodies', JSON.stringify(state.bodies), () => state.bodies.map((b) => {
    const item = element('li', `${b.name} r${b.revision} `);
    const equal = b.equal === null ? '?' : b.equal ? 'yes' : 'no';
    item.append(element('span', 'equals server: ' + equal, { className: equal, title: b.hash }));
    return item;
  }));
  show_list('links', JSON.stringify(state.links), () => state.links.map((line) => element('li', line)));
  show_score();
  show_task();
  show_fields();
  say_anew();
  byId('cuts').textContent = state.cuts === undefined ? '' : `${state.cuts} cuts, ${state.refused} refused`;
  show_list('lines', JSON.stringify(state.lines.map((l) => l.number)), () =>
    state.lines.map(in_line).reverse());
}

// A score that is already there when the page comes was told nobody knows when.
const SCORE_SOON_MS = 5000;
let score_heard = 0, score_asked_ms = -Infinity;
function show_score() {
  byId('score_of').hidden = state.score.length === 0 && tries.length === 0;
  byId('score_when').hidden = state.score.length === 0;
  show_list('score_lines', JSON.stringify(state.score), () =>
    state.score.filter((line) => !line.startsWith(ALONG)).map((line) => {
      const [name, value, verdict] = entry(line);
      const item = element('li', name + ' ');
      item.append(element('span', value, { className: verdict }));
      return item;
    }));
  if (state.score_lines_heard === score_heard) return;
  score_heard = state.score_lines_heard;
  byId('score_when').textContent = now() - open_s < SILENT_S ? '' : `at ${state.time_s.toFixed(1)} s`;
  if (performance.now() - score_asked_ms < SCORE_SOON_MS) byId('score_of').scrollIntoView({ block: 'nearest' });
}

function ask_score() {
  score_asked_ms = performance.now();
  order('tell_score');
}

function show_task() {
  const [task, ...targets] = state.task;
  byId('task_of').hidden = task === undefined;
  byId('task').textContent = task ?? '';
  show_list('targets', JSON.stringify(targets), () => targets.map((target) => element('li', target)));
  if (task !== undefined) learn_tries();
}

// Scalars that engines publish for vertices, as wetness.
function show_fields() {
  const list = byId('field'), chosen = list.value;
  show_list('field', JSON.stringify(state.fields), () =>
    ['', ...state.fields].map((name) => element('option', name || 'tissue', { value: name })));
  if (list.value !== chosen) list.value = state.fields.includes(chosen) ? chosen : '';
}

// ---- begin ----

// All that has been cut is lost to everyone: the first press asks, and one that follows it does it, but not at once: a
// double click is no answer.
const ANEW = ['Begin anew', 'Begin anew …', 'Begin anew: sure?'];
let asked_ms = -Infinity;
function say_anew() {
  const since_ms = performance.now() - asked_ms;
  byId('anew').textContent = ANEW[since_ms >= SURE_MS ? 0 : since_ms < DOUBLE_MS ? 1 : 2];
}
function begin_anew() {
  const said = ANEW.indexOf(byId('anew').textContent);
  if (said === 2) order('begin_anew');
  if (said !== 1) asked_ms = said === 0 ? performance.now() : -Infinity;
  say_anew();
}

// The panel is folded while the screen is small, until somebody says otherwise.
const small = matchMedia('(max-width: 600px)');
function fold(folded) {
  document.body.classList.toggle('folded', folded);
  byId('fold').textContent = folded ? 'Panel' : 'Hide';
  byId('fold').setAttribute('aria-expanded', !folded);
  if (program) call('resize', ...pixel_size());
}

function fold_as_left() {
  const left = recalled('localStorage', 'folded');
  fold(left === null ? small.matches : left === 'true');
}

async function begin() {
  fold_as_left();
  small.onchange = fold_as_left;
  byId('fold').onclick = () => {
    fold(!document.body.classList.contains('folded'));
    keep('localStorage', 'folded', document.body.classList.contains('folded'));
  };
  byId('name').value = recalled('sessionStorage', 'name') ?? '';
  program = await Sectio();
  const [width, height] = pixel_size();
  if (!call('begin', width, height)) show_stills();
  byId('name').onchange = () => {
    if (!byId('name').value.trim()) byId('name').value = recalled('sessionStorage', 'name') ?? '';
    keep('sessionStorage', 'name', own_name());
    introduce();
  };
  byId('wireframe').onchange = () => call('wireframe', byId('wireframe').checked ? 1 : 0);
  const section = () => {
    const nearer_m = Number(byId('section_place').value);
    byId('section_place_said').textContent = `${(1000 * nearer_m).toFixed(0)} mm`;
    call('section', byId('section').checked ? 1 : 0, nearer_m);
  };
  byId('section').onchange = section;
  byId('section_place').oninput = section;
  byId('field').onchange = () => program.ccall('page_field', null, ['string'], [byId('field').value]);
  byId('home').onclick = () => call('reset_camera');
  byId('pause').onclick = () => order(state?.speed === 0 ? 'go_on' : 'pause');
  byId('anew').onclick = begin_anew;
  byId('score').onclick = ask_score;
  byId('back').onclick = go_back;
  for (const id of ['moment', 'speed', 'tilt']) byId(id).oninput = () => used_ms.set(id, performance.now());
  byId('moment').onchange = () => go_to(Number(byId('moment').value));
  byId('speed').onchange = () => order('set_speed', { speed: Number(byId('speed').value) });
  byId('tilt').onchange = () => order('tilt', { tilt_deg: Number(byId('tilt').value) });
  window.onresize = () => call('resize', ...pixel_size());
  // Pictures stop where nobody sees them; the replica and the hand go on.
  setInterval(() => { if (performance.now() - last_tick_ms > KEEP_ALIVE_MS) tick(false); }, KEEP_ALIVE_MS);
  // The whole address, opened where the page is open without its token, changes this part alone.
  window.onhashchange = introduce;
  connect();
  requestAnimationFrame(animate);
}
function fail(error) {
  say('warning_said', `This page can't run here: ${error.message ?? error}`);
  byId('warning').hidden = false;
}
// By then all scripts have run, in whatever order they came.
document.addEventListener('DOMContentLoaded', () => begin().catch(fail));
