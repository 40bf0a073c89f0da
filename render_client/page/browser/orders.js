// Orders to the servers: to pause, to tilt, to go to another moment.
'use strict';

const GOING_MS = 120000;    // an order that takes longer is given up,
const MOVES_MS = 3000;      // and so is one while the session's time goes on as before
const LEAP_S = 1, SOON_S = 5;  // time that leaps to where it should go, or shortly after that, has arrived
const NEAR_S = 0.05;
const BACK_S = 10;  // the button that goes back in time
const ORDER = { tilt: 0, pause: 1, go_on: 2, set_speed: 3, begin_anew: 4, tell_score: 5, seek: 6, freeze: 7, thaw: 8 };
const GRAVITY_M_PER_S2 = 9.81;

function order(kind, { tilt_deg = 0, speed = 1, to_s = 0, tool = 0 } = {}) {
  const tilt = tilt_deg * Math.PI / 180;
  call('order', ORDER[kind], GRAVITY_M_PER_S2 * Math.sin(tilt), 0, -GRAVITY_M_PER_S2 * Math.cos(tilt), speed, to_s, tool);
  flush();
  if (kind === 'seek') going = departure(`Going to ${to_s.toFixed(1)} s …`, to_s);
  if (kind === 'begin_anew') going = departure('Beginning anew …', 0);
}

// An order to go to another moment takes a while: a server runs what was before it again, and its time stands still.
let going = null;
const newest_line = () => state.lines.at(-1)?.number ?? 0;
const departure = (words, to_s) => {
  const since_ms = performance.now();
  return { words, to_s, line: newest_line(), at_s: state.time_s, since_ms, stood_ms: since_ms };
};

function has_arrived() {
  const leaps = state.time_s < going.at_s || state.time_s > going.at_s + LEAP_S;
  const since_s = state.time_s - going.to_s;
  if (state.time_s === going.at_s) going.stood_ms = performance.now();
  going.at_s = state.time_s;
  return (leaps || state.speed === 0) && since_s > -NEAR_S && since_s < (leaps ? SOON_S : NEAR_S);
}

// The line of a refusal, or of a record that has no such moment. A server leaves out an order when another one leads
// further back, and says that it refuses it.
const ends_order = ({ number, text }) => number > going.line && !text.includes(': another one came at once') &&
  /^(seek: |anew: |orders came too fast: |paused at the end of the record)/.test(text);

function words_of_order() {
  if (!going) return '';
  const has_ended = has_arrived() || state.lines.some(ends_order);
  const is_lost = performance.now() > Math.min(going.stood_ms + MOVES_MS, going.since_ms + GOING_MS);
  if (!has_ended && !is_lost) return going.words;
  const { to_s, then_s = to_s } = going;
  going = null;
  if (then_s !== to_s) order('seek', { to_s: then_s });
  return going?.words ?? '';
}

// One order at a time: moments that somebody asks for meanwhile are one, the last.
function go_to(to_s) {
  if (!going) return order('seek', { to_s });
  going.then_s = to_s;
  going.words = `Going to ${to_s.toFixed(1)} s …`;
}
const go_back = () => go_to(Math.max(0, (going ? going.then_s ?? going.to_s : state.time_s) - BACK_S));
