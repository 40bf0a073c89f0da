// Exercises that are done with a mouse: deploy/live, a headless Chromium, a pointer that follows what is drawn on the
// body. Each ends with all the targets reached that the page shows; snips that don't meet everywhere are forgiven.
// usage: node tests/live/mouse_test.mjs [DIRECTORY for pictures]
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { Browser, sleep } from './browser.mjs';
import { check, equal, root, Session } from './session.mjs';

const TURNS = 60, SNIPS = 20, STRIPES = 5, WHEEL_NOTCH = 100;
const KEY_TURNS_RAD = 0.1, FORESHORTENED = 0.8;  // heights on the screen, of what lies flat

const mean = (points) => [0, 1].map((k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);
// The mean place of each group, in the order of their numbers.
function places(points, count, number_of) {
  const groups = Array.from({ length: count }, () => []);
  for (const point of points) groups[number_of(point)].push(point);
  return groups.filter((group) => group.length > 0).map(mean);
}

function ring_of(points) {
  const middle = mean(points);
  const turn = ([x, y]) => Math.atan2(y - middle[1], x - middle[0]) / Math.PI + 1;  // 0 to 2
  const ring = places(points, TURNS, (p) => Math.floor(turn(p) * TURNS / 2) % TURNS);
  assert.ok(ring.length > 0.8 * TURNS, `the ring is seen at ${ring.length} places`);
  return ring;
}

function snips_of(points) {
  const across = points.map(([x]) => x), first = Math.min(...across), last = Math.max(...across);
  const line = places(points, SNIPS, ([x]) => Math.min(SNIPS - 1, Math.floor((x - first) / (last - first) * SNIPS)));
  assert.equal(line.length, SNIPS, 'the whole curve is seen');
  return [...line, mean(points.filter(([x]) => x > last - 3))];
}

// Places whose colour is one; places are those of the canvas beside the panel. `is_it`: (r, g, b) => whether.
function painted(page, is_it) {
  return page.see(({ data, width, height }, is_it) => {
    const end = Math.min(width, document.getElementById('panel').getBoundingClientRect().left - 10), at = [];
    const matches = eval(is_it);
    for (let y = 0; y < height; ++y)
      for (let x = 0; x < end; ++x) {
        const i = 4 * (y * width + x);
        if (matches(data[i], data[i + 1], data[i + 2])) at.push([x, y]);
      }
    return at;
  }, is_it.toString());
}
const extent = (points, k) => [Math.min, Math.max].map((most) => points.reduce((m, p) => most(m, p[k]), points[0][k]));

// A way with so many places for each of its straight pieces.
const between = (way, count) => way.slice(1).flatMap((to, i) =>
  Array.from({ length: count }, (_, k) => [0, 1].map((axis) => way[i][axis] + (to[axis] - way[i][axis]) * (k + 1) / count)));

async function set_depth(page, place, depth_m) {
  for (;;) {
    const now = await page.state();
    if (Math.abs(now.depth_m - depth_m) < 4e-4) return;
    const deltaY = now.depth_m > depth_m ? -WHEEL_NOTCH : WHEEL_NOTCH;
    await page.mouse('mouseWheel', ...place, 0, { deltaX: 0, deltaY });
    await page.until('another depth', (s) => s.depth_m !== now.depth_m);
  }
}

async function change_instruments(page, held) {
  await page.click('Put down');
  await page.until('free hands', (s) => s.held === null);
  await page.evaluate(`[...document.querySelectorAll('button:enabled')]
    .filter((button) => button.textContent === 'Take in hand')[${held}].click()`);
  await page.until('the other instrument in hand', (s) => s.held === held);
}

async function do_exercise(name, act, forgives) {
  const session = await Session.begin(join(root, `deploy/scenes/${name}.yaml`));
  const browser = new Browser();
  try {
    const page = await browser.open(session.address, { width: 960, height: 540 });
    await page.until('a replica that equals the server', (s) => equal(s) && s.pictures > 0);
    await page.click('Take in hand');
    await page.until('the instrument in hand', (s) => s.held === 0);
    await act(page);
    await page.click('Score');
    const { score } = await page.until('the score', (s) => s.score.length > 5);
    if (process.argv[2]) await page.picture(join(process.argv[2], `${name}.png`));
    const targets = score.filter((line) => /^(reached|missed) /.test(line));
    const is_fine = (line) => line.startsWith('reached') || (forgives && line.includes(forgives));
    assert.ok(targets.length > 2 && targets.every(is_fine), score.join('\n'));
  } finally {
    await browser.close();
  }
  const { outcome } = await session.end();
  session.forget();
  return outcome;
}

await check('a scalpel cuts the disc around a mole out', async () => {
  const outcome = await do_exercise('exercise_disc', async (page) => {
    const ring = ring_of(await page.ink());
    await page.drag([...ring, ...ring.slice(0, 5)], 80);
    await page.until('the word of it', (s) => s.lines.some((line) => line.text === 'a piece of skin_pad is free'));
  });
  assert.equal(outcome.pieces_freed, 1);
});

await check('scissors cut along a curve, snip by snip', async () => {
  const outcome = await do_exercise('exercise_curve', async (page) => {
    const snips = snips_of(await page.ink());
    await page.mouse('mouseMoved', ...snips[0]);
    await set_depth(page, snips[0], 0.002);
    let turns = 0;
    for (const [i, place] of snips.entries()) {
      const [from, to] = [snips[Math.max(0, i - 1)], snips[Math.min(snips.length - 1, i + 1)]];
      const along_rad = Math.atan2((from[1] - to[1]) / FORESHORTENED, to[0] - from[0]);
      const wanted = Math.round(along_rad / KEY_TURNS_RAD);
      for (; turns < wanted; ++turns) await page.key('q');
      for (; turns > wanted; --turns) await page.key('e');
      await page.mouse('mouseMoved', ...place);
      await page.mouse('mousePressed', ...place, 1);
      await sleep(700);  // the time that a hand takes: down, closed, and up again
      await page.mouse('mousePressed', ...place, 3, { button: 'right' });
      await sleep(700);
      await page.mouse('mouseReleased', ...place, 1, { button: 'right' });
      await page.mouse('mouseReleased', ...place, 0);
      await sleep(700);
    }
  }, 'incisions');
  assert.ok(outcome.cut_m > 0.04, `${outcome.cut_m} m`);
  assert.ok(outcome.incisions <= 3, `${outcome.incisions} cuts that don't meet`);
});

await check('a knife that comes from beside a vessel divides it with one stroke', async () => {
  const outcome = await do_exercise('exercise_vessel', async (page) => {
    const line = await painted(page, (r, g, b) => b > 40 && b > 1.4 * r && b > 1.4 * g);
    const [top, bottom] = extent(line, 1);
    const way = places(line, STRIPES, ([, y]) => Math.min(STRIPES - 1, Math.floor((bottom - y) / (bottom - top) * STRIPES)));
    const [first, last] = [way[0], way.at(-1)];
    const below = [first[0] + 5, bottom + 1.1 * (bottom - top)], above = [last[0] + 10, top - 12];
    await page.mouse('mouseMoved', ...below);
    await page.until('a hand that hovers beside the vessel', (s) => s.tools[0].present);
    await set_depth(page, below, 0.012);
    await page.drag(between([below, ...way, above], 6), 60);
    await page.until('the cut', (s) => s.cuts > 0);
  });
  assert.equal(outcome.pieces_freed, 1);
  assert.ok(outcome.line_cut_fraction > 0.9, `${outcome.line_cut_fraction} of the line`);
});

await check('a tumour is cut out, lifted with forceps, and put into the tray', async () => {
  const outcome = await do_exercise('exercise_tumour', async (page) => {
    const spot = await painted(page, (r, g, b) => r > 90 && g > 0.72 * r && g < 0.97 * r && g - b > 0.12 * r);
    const steel = await painted(page, (r, g, b) => r > 60 && Math.abs(r - g) < 14 && b > r && b - r < 25);
    const [x, y] = [0, 1].map((k) => extent(spot, k));
    const middle = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2];
    const tray = mean(steel.filter((p) => p[1] > y[1] + 100));
    const ring = Array.from({ length: TURNS + 6 }, (_, k) => 2 * Math.PI * k / TURNS)
      .map((turn) => [middle[0] + 0.625 * (x[1] - x[0]) * Math.cos(turn), middle[1] + 0.65 * (y[1] - y[0]) * Math.sin(turn)]);
    await page.drag(ring, 80);
    await page.until('the word of it', (s) => s.lines.some((line) => line.text === 'a piece of liver is free'));
    await change_instruments(page, 1);
    await page.mouse('mouseMoved', ...middle);
    await set_depth(page, middle, 0.001);
    await page.mouse('mousePressed', ...middle, 1);
    await sleep(900);
    await page.mouse('mousePressed', ...middle, 3, { button: 'right' });
    await sleep(900);
    await page.mouse('mouseReleased', ...middle, 2);
    await sleep(900);
    for (let k = 1; k <= 30; ++k) {
      await page.mouse('mouseMoved', ...middle.map((m, axis) => m + (tray[axis] - m) * k / 30), 2);
      await sleep(100);
    }
    await sleep(500);
    await page.mouse('mouseReleased', ...tray, 0, { button: 'right' });
    await sleep(2000);
  });
  assert.ok(outcome.marked_in_bin_fraction > 0.9, `${outcome.marked_in_bin_fraction} of it`);
});
