// A page under a mouse without an instrument, and under fingers with one: deploy/live, a headless Chromium. A view is
// known by what is drawn. Each check stands on the session that the ones before it have left.
// usage: node tests/live/touch_test.mjs
import assert from 'node:assert/strict';
import { Browser, until } from './browser.mjs';
import { apart, check, equal, Session } from './session.mjs';

const WIDTH = 640, HEIGHT = 480, WHEEL_NOTCH = 100;
const FAR = 0.05;  // share of half a picture by which an instrument may be behind its wish

// The red pixels: their share, their middle, and whether each is one, for every fourth.
const view = (page) => page.see(({ data, width, height }) => {
  const red = [], sum = [0, 0];
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    const is_red = data[i] > 60 && data[i] > 1.6 * data[i + 1];
    if (i % 16 === 0) red.push(is_red ? 1 : 0);
    if (!is_red) continue;
    ++count;
    sum[0] += (i / 4) % width;
    sum[1] += Math.floor(i / 4 / width);
  }
  return { share: count / (width * height), middle: sum.map((s) => s / count), red };
});
const difference = (a, b) => a.red.filter((is_red, i) => is_red !== b.red[i]).length / a.red.length;
const is_at = (middle, [x, y]) => Math.hypot(middle[0] - x, middle[1] - y) < 12;
const view_of = (page, what, condition) => until(what, async () => {
  const now = await view(page);
  return condition(now) ? now : null;
});

async function drag(page, from, to, button, buttons) {
  await page.mouse('mousePressed', ...from, buttons, { button });
  for (let i = 1; i <= 8; ++i) {
    const place = from.map((x, k) => x + (to[k] - x) * i / 8);
    await page.mouse('mouseMoved', ...place, buttons);
  }
  await page.mouse('mouseReleased', ...to, 0, { button });
}
const turn = (page, from, to) => drag(page, from, to, 'left', 1);
const move = (page, from, to) => drag(page, from, to, 'right', 2);
const middle_of = (page, id) => page.evaluate(`(() => {
  const { left, right, top, bottom } = document.getElementById('${id}').getBoundingClientRect();
  return [(left + right) / 2, (top + bottom) / 2];
})()`);
const wheel = (page, notches) => page.mouse('mouseWheel', 200, 200, 0, { deltaX: 0, deltaY: WHEEL_NOTCH * notches });

const session = await Session.begin();
const browser = new Browser();
let cuts = 0;
try {
  const page = await browser.open(session.address, { width: WIDTH, height: HEIGHT });
  await page.until('a replica that equals the server', (s) => equal(s) && s.pictures > 0);
  const first = await view_of(page, 'the liver', (v) => v.share > 0.5);

  await check('the wheel comes nearer and goes away', async () => {
    for (let i = 0; i < 8; ++i) await wheel(page, 1);
    await view_of(page, 'a smaller liver', (v) => v.share < 0.4 * first.share && v.share > 0.05);
    for (let i = 0; i < 8; ++i) await wheel(page, -1);
    await view_of(page, 'the liver as it was', (v) => difference(v, first) < 0.005);
  });

  await check('the right button moves the view along with the pointer', async () => {
    for (let i = 0; i < 8; ++i) await wheel(page, 1);
    let last = null;
    const { middle } = await view_of(page, 'a small liver that stands still', (v) => {
      const stands = last !== null && v.share < 0.4 * first.share && difference(v, last) === 0;
      last = v;
      return stands;
    });
    await move(page, [200, 200], [260, 160]);
    await view_of(page, 'the liver where it was dragged', (v) => is_at(v.middle, [middle[0] + 60, middle[1] - 40]));
    await page.click('First view');
    await view_of(page, 'the first view', (v) => difference(v, first) < 0.005);
  });

  await check('the left button turns the view, there and back', async () => {
    await turn(page, [150, 200], [250, 150]);
    await view_of(page, 'another side', (v) => difference(v, first) > 0.05);
    await turn(page, [250, 150], [150, 200]);
    await view_of(page, 'the side of before', (v) => difference(v, first) < 0.005);
  });

  await page.send('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 2 });
  const follows = (s) => s.wish && apart(s.wish, s.tools[0].tip) < FAR;
  const a_second_later = async () => {
    const { step } = await page.state();
    return page.until('a second of the session', (s) => s.step > step + 1000 && equal(s));
  };

  await check('without an instrument one finger turns the view', async () => {
    await page.touch('touchStart', [150, 200]);
    for (let x = 160; x <= 250; x += 10) await page.touch('touchMove', [x, 200]);
    await page.touch('touchEnd');
    await view_of(page, 'another side', (v) => difference(v, first) > 0.05);
    await page.click('First view');
    await view_of(page, 'the first view', (v) => difference(v, first) < 0.005);
  });

  await check('one finger cuts where it is drawn over the liver', async () => {
    await page.click('Take in hand');
    await page.until('the scalpel in hand', (s) => s.held === 0);
    const [x, y] = first.middle;
    await page.touch('touchStart', [x - 60, y]);
    await page.until('the scalpel in the liver', (s) => s.tools[0].force_n > 0 || s.cuts > 0);
    for (let dx = -60; dx <= 60; dx += 6) {
      await page.touch('touchMove', [x + dx, y]);
      await page.until('the scalpel under the finger', follows);
    }
    await page.touch('touchEnd');
    await page.until('a cut, and the scalpel above it', (s) => s.cuts > 10 && s.tools[0].force_n === 0 && follows(s));
    ({ cuts } = await a_second_later());
  });

  const tap = async (id, ...others) => {
    await page.touch('touchStart', ...others, await middle_of(page, id));
    await page.touch('touchEnd', ...others);
  };
  await check('a finger says how deep, by buttons that stand there for fingers alone', async () => {
    const { depth_m } = await page.state();
    for (let i = 0; i < 3; ++i) await tap('deeper');
    await page.until('3 mm more', (s) => Math.abs(s.depth_m - depth_m - 0.003) < 1e-6);
    for (let i = 0; i < 3; ++i) await tap('shallower');
    await page.until('the depth of before', (s) => Math.abs(s.depth_m - depth_m) < 1e-6);
    const are_seen = () => page.evaluate(`document.getElementById('touch').checkVisibility()`);
    assert.ok(await are_seen());
    await page.send('Emulation.setTouchEmulationEnabled', { enabled: false });
    await page.mouse('mousePressed', 10, 10, 2, { button: 'right' });
    await page.mouse('mouseReleased', 10, 10, 0, { button: 'right' });
    await until('no buttons for fingers', async () => !(await are_seen()));
    await page.send('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 2 });
  });

  await check('a second finger closes jaws, which the first then carries above the liver', async () => {
    const [x, y] = first.middle, height_m = (s) => s.tools[0].at_m[2];
    await page.touch('touchStart', [x, y + 60]);
    const pressed = await page.until('the scalpel in the liver',
        (s) => (s.tools[0].force_n > 0 || s.cuts > cuts) && follows(s));
    await tap('jaws', [x, y + 60]);
    await page.touch('touchEnd');
    const is_carried = (s) => height_m(s) > height_m(pressed) + 0.03 && s.tools[0].force_n === 0;
    const { cuts: before } = await page.until('closed jaws above the liver', is_carried);
    await page.touch('touchStart', [x, y + 60]);
    for (let dx = 0; dx <= 60; dx += 6) await page.touch('touchMove', [x + dx, y + 60]);
    await page.until('closed jaws that follow the finger', (s) => follows(s) && is_carried(s));
    assert.equal((await a_second_later()).cuts, before);
    await page.touch('touchEnd');
    await tap('jaws');
    await page.until('open jaws, lower down', (s) => s.tools[0].present && !is_carried(s));
    ({ cuts } = await a_second_later());
  });

  await check('two fingers that come together go away from the liver, and cut nothing', async () => {
    const [x, y] = first.middle;
    await page.touch('touchStart', [x - 75, y], [x + 75, y]);
    for (let d = 70; d >= 25; d -= 5) await page.touch('touchMove', [x - d, y], [x + d, y]);
    await view_of(page, 'a smaller liver', (v) => v.share < 0.4 * first.share && v.share > 0.05);
    // A finger that stays moves nothing any more.
    await page.touch('touchEnd', [x - 25, y]);
    await page.touch('touchMove', [x - 25, y + 40]);
    await page.touch('touchEnd');
    assert.equal((await a_second_later()).cuts, cuts);
  });
} finally {
  await browser.close();
}

await check('the report has the cut of the finger', async () => {
  const { run } = await session.end();
  assert.equal(run.cuts_made, cuts);
});
session.forget();
