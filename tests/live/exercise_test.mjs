// An exercise in a browser: deploy/live, a headless Chromium, a mouse that follows the line. The page says what to do and
// how it went, and the tries stay.
// usage: node tests/live/exercise_test.mjs [DIRECTORY for the pictures of docs/live.md]
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { Browser, until } from './browser.mjs';
import { check, equal, root, Session } from './session.mjs';

const pictures = process.argv[2];
const scene = join(root, 'deploy/scenes/exercise_line.yaml');
const text = (page, id) => page.evaluate(`document.getElementById('${id}').textContent`);
const tries = (page) => page.evaluate('window.sectio.tries()');

async function take_in_hand(page, name) {
  await page.until('a replica that equals the server', equal);
  await page.evaluate(`Object.assign(document.getElementById('name'), { value: '${name}' }).onchange()`);
  await page.click('Take in hand');
  await page.until('the scalpel in hand', (s) => s.held === 0);
}

// Places of the line on the liver on the screen, from the left, a few pixels apart.
async function line_places(page) {
  const columns = new Map();
  for (const [x, y] of await page.ink(2))
    if (x % 5 === 0) columns.set(x, [...(columns.get(x) ?? []), y]);
  const mean = (rows) => rows.reduce((a, b) => a + b) / rows.length;
  return [...columns].sort(([a], [b]) => a - b).map(([x, rows]) => [x, mean(rows)]);
}

// A person follows the line with the mouse, as deep as it should be.
async function cut(page) {
  const { cuts } = await page.state();
  const places = await line_places(page);
  assert.ok(places.length > 15, `the line is seen at ${places.length} places`);
  await page.drag(places, 60);
  await page.until('a cut', (s) => s.cuts > cuts + 5);
}

async function score(page, kept) {
  await page.click('Score');
  await page.until('the score', (s) => s.score.length > 0);
  return until(`${kept} tries that are kept`, async () => {
    const all = await tries(page);
    return all.length === kept && all.every((one) => one.score.length > 5) ? all : null;
  });
}

let session = await Session.begin(scene);
let browser = new Browser();
try {
  const page = await browser.open(session.address);
  await check('the page says what to do and what is expected', async () => {
    await page.until('the task', (s) => s.task.length > 2);
    await until('its words', async () => (await text(page, 'task')).startsWith('Cut along the line on the liver'));
    assert.ok((await text(page, 'targets')).includes('line deviation at most 2 mm'));
  });

  await check('a try has its score, path, force and deviation', async () => {
    await take_in_hand(page, 'Ada');
    await cut(page);
    const [one] = await score(page, 1);
    assert.deepEqual(one.hands, ['Ada']);
    assert.ok(one.score.some((line) => /^(reached|missed) +line deviation at most 2 mm: /.test(line)), one.score);
    const [scalpel] = one.tools;
    const places = scalpel.at_mm.filter(Boolean), across = places.map(([x]) => x);
    assert.ok(Math.max(...across) - Math.min(...across) > 10, 'the path is the way of the mouse');
    assert.ok(Math.max(...scalpel.force_n) > 0.02, 'with a force');
    const beside_mm = Number(one.score.find((line) => line.startsWith('beside the line')).match(/[\d.]+/)[0]);
    assert.ok(beside_mm < 5, `the mouse was on the line: ${beside_mm} mm beside`);
    assert.ok(/along the line, mm .*\d\.\d/.test(one.score.join('\n')), 'and how far beside the line');
  });

  await check('the next try stands beside it', async () => {
    const { step } = await page.state();
    await page.begin_anew();
    await page.until('the body as it was at first', (s) => s.step < step && equal(s) && s.cuts === 0);
    await cut(page);
    await score(page, 2);
    await page.click('Tries (2)');
    const { columns, lines, bars } = await page.evaluate(`({
      columns: document.querySelectorAll('#tries_table tr:first-child td').length,
      lines: [...document.querySelectorAll('#tries polyline')].map((l) => l.getAttribute('points').length),
      bars: document.querySelectorAll('#tries rect').length,
    })`);
    assert.equal(columns, 2);
    assert.equal(lines.length, 4, 'path and force of each');
    assert.ok(lines.every((length) => length > 100) && bars > 5, JSON.stringify({ lines, bars }));
    if (pictures) {
      await page.send('Emulation.setDeviceMetricsOverride', { width: 960, height: 720, deviceScaleFactor: 1, mobile: false });
      await page.picture(join(pictures, 'live_tries.png'));
    }
  });
} finally {
  await browser.close();
}
await session.end();

session = await Session.begin_in(session.out, scene);
browser = new Browser();
try {
  await check('a later session has them still', async () => {
    const page = await browser.open(session.watching);
    await page.until('the task', (s) => s.task.length > 2);
    await until('both tries', async () => (await tries(page)).length === 2);
  });
} finally {
  await browser.close();
}
await session.end();
session.forget();
