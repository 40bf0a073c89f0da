// Exercises that are done with a mouse: deploy/live, a headless Chromium, a pointer that follows what is drawn on the
// body. Each ends with all the targets reached that the page shows; snips that don't meet everywhere are forgiven.
// usage: node tests/live/mouse_test.mjs [DIRECTORY for pictures]
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { Browser, sleep } from './browser.mjs';
import { check, equal, root, Session } from './session.mjs';

const TURNS = 60, SNIPS = 20, WHEEL_NOTCH = 100;
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

async function do_exercise(name, act, forgives) {
  const session = await Session.begin(join(root, `deploy/scenes/${name}.yaml`));
  const browser = new Browser();
  try {
    const page = await browser.open(session.address, { width: 960, height: 540 });
    await page.until('a replica that equals the server', (s) => equal(s) && s.pictures > 0);
    await page.click('Take in hand');
    await page.until('the instrument in hand', (s) => s.held === 0);
    await act(page, await page.ink());
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
  const outcome = await do_exercise('exercise_disc', async (page, points) => {
    const ring = ring_of(points);
    await page.drag([...ring, ...ring.slice(0, 5)], 80);
    await page.until('the word of it', (s) => s.lines.some((line) => line.text === 'a piece of skin_pad is free'));
  });
  assert.equal(outcome.pieces_freed, 1);
});

await check('scissors cut along a curve, snip by snip', async () => {
  const outcome = await do_exercise('exercise_curve', async (page, points) => {
    const snips = snips_of(points);
    await page.mouse('mouseMoved', ...snips[0]);
    for (const notch of [-WHEEL_NOTCH, -WHEEL_NOTCH])
      await page.mouse('mouseWheel', ...snips[0], 0, { deltaX: 0, deltaY: notch });
    await page.until('blades that go 3 mm deep', (s) => Math.abs(s.depth_m - 0.003) < 1e-4);
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
