// A disc that is cut out with a mouse: deploy/live with exercise_disc, a headless Chromium, a pointer that goes once
// round the ring that is drawn on the pad.
// usage: node tests/live/disc_test.mjs [FILE for a picture]
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { Browser } from './browser.mjs';
import { check, equal, root, Session } from './session.mjs';

// Places of the ring on the screen, in their order: its pixels are blue, those of skin aren't. Beside the panel.
const ring_places = (page) => page.evaluate(`(() => {
  const from = document.getElementById('canvas'), to = document.createElement('canvas');
  to.width = from.width; to.height = from.height;
  const context = to.getContext('2d');
  context.drawImage(from, 0, 0);
  const end = Math.floor(document.getElementById('panel').getBoundingClientRect().left) - 10;
  const { data } = context.getImageData(0, 0, end, to.height);
  const blue = [];
  for (let i = 0; i < data.length; i += 4)
    if (data[i + 2] > 50 && data[i + 2] > 1.3 * data[i]) blue.push([(i / 4) % end, Math.floor(i / 4 / end)]);
  const mean = (points) => [0, 1].map((k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);
  const middle = mean(blue);
  const turns = Array.from({ length: 60 }, () => []);
  for (const [x, y] of blue) turns[Math.floor((Math.atan2(y - middle[1], x - middle[0]) / Math.PI + 1) * 30) % 60].push([x, y]);
  return turns.filter((points) => points.length > 0).map(mean);
})()`);

const session = await Session.begin(join(root, 'deploy/scenes/exercise_disc.yaml'));
const browser = new Browser();
try {
  await check('a mouse cuts the disc around a mole out, and the score says so', async () => {
    const page = await browser.open(session.address, { width: 960, height: 540 });
    await page.until('a replica that equals the server', (s) => equal(s) && s.pictures > 0);
    await page.click('Take in hand');
    await page.until('the scalpel in hand', (s) => s.held === 0);
    const ring = await ring_places(page);
    assert.ok(ring.length > 50, `the ring is seen at ${ring.length} places`);
    await page.drag([...ring, ...ring.slice(0, 5)], 80);
    await page.until('the word of it', (s) => s.lines.some((line) => line.text === 'a piece of skin_pad is free'));
    await page.click('Score');
    const { score } = await page.until('the score', (s) => s.score.length > 5);
    if (process.argv[2]) await page.picture(process.argv[2]);
    const targets = score.filter((line) => /^(reached|missed) /.test(line));
    assert.ok(targets.length > 3 && targets.every((line) => line.startsWith('reached')), score.join('\n'));
  });
} finally {
  await browser.close();
}
const report = await session.end();
assert.equal(report.outcome.pieces_freed, 1);
session.forget();
