// A person with a headset in a session: deploy/live, a headless Chromium, and the headset of iwer, which emulates the
// devices of WebXR. The picture of both eyes goes into a framebuffer of the headset's own, as on a real one.
// usage: node tests/live/headset_test.mjs [DIRECTORY for the pictures of docs/live.md]
import assert from 'node:assert/strict';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { Browser, until } from './browser.mjs';
import { apart, check, equal, root, Session } from './session.mjs';

const pictures = process.argv[2];
const iwer = resolve(root, process.env.SECTIO_BUILD_DIR ?? 'build', 'npm/node_modules/iwer/build/iwer.min.js');
if (!existsSync(iwer)) throw new Error(`${iwer} isn't there: ./deploy/test --live installs it`);

// iwer draws on the canvas; a headset has a framebuffer of its own, which `seen()` reads. It has room for the canvas of a
// page whose panel gives way.
const wear = `${readFileSync(iwer, 'utf8')};
  window.device = new IWER.XRDevice(IWER.metaQuest3, { stereoEnabled: true });
  device.installRuntime({ forceInstall: true });
  let own = null;
  Object.defineProperty(XRWebGLLayer.prototype, 'framebuffer', { get() {
    if (own) return own;
    const gl = this.context;
    own = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, own);
    for (const [format, place] of [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, Math.max(this.framebufferWidth, innerWidth),
        Math.max(this.framebufferHeight, innerHeight));
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    }
    return own;
  } });
  // The places of red tissue for each eye, by columns from the left; the first row is at the bottom.
  window.seen = () => {
    const gl = document.getElementById('canvas').getContext('webgl2');
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const data = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, own);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
    const eyes = [0, 1].map((eye) => {
      let count = 0, across = 0;
      for (let y = 0; y < height; ++y)
        for (let x = 0; x < width / 2; ++x) {
          const i = 4 * (y * width + eye * (width / 2) + x);
          if (data[i] <= 60 || data[i] <= 1.6 * data[i + 1]) continue;
          ++count;
          across += x;
        }
      return { tissue: count / (data.length / 8), middle: across / count / (width / 2) };
    });
    return { eyes, width, height, data };
  };
  // In the room, whose origin is the head.
  window.hand = (place, pull = 0) => {
    const right = device.controllers.right;
    right.position.set(place[0], device.position.y + place[1], place[2]);
    right.quaternion.set(-Math.SQRT1_2, 0, 0, Math.SQRT1_2);
    right.updateButtonValue('trigger', pull);
  };`;

const session = await Session.begin();
const browser = new Browser();
try {
  const page = await browser.open(session.address, { before: wear });
  await page.until('a replica that equals the server', equal);
  const hand = (place, pull = 0) => page.evaluate(`hand(${JSON.stringify(place)}, ${pull})`);
  const tip = async () => (await page.state()).tools[0].at_m;
  // The place at which the instrument has come to rest: a page that is slow shows one state for long.
  const still = async (what) => {
    let last = null;
    return until(what, async () => {
      const { step, tools: [{ at_m: at }] } = await page.state();
      if (last && step < last.step + 50) return false;
      const rests = last && apart(at, last.at) < 1e-5;
      last = { step, at };
      return rests && at;
    });
  };

  await check('a headset shows the body to both eyes, from two places', async () => {
    await until('the button', () => page.evaluate(`!document.getElementById('headset').hidden`));
    await page.click('Headset');
    await page.until('the headset', (s) => s.headset);
    const { eyes } = await until('both eyes', () => page.evaluate(`(() => {
      const { eyes, width, height } = seen();
      return eyes.every((eye) => eye.tissue > 0.02) && { eyes, width, height };
    })()`));
    for (const eye of eyes) assert.ok(eye.tissue < 0.9, 'there is a background, too');
    const parallax = eyes[0].middle - eyes[1].middle;
    assert.ok(parallax > 0.005 && parallax < 0.3,
      `the left eye sees the body farther to the right: ${JSON.stringify(eyes)}`);
  });

  let place = [0, 0.25, -0.5];
  await check('the trigger takes the scalpel in hand, which follows the hand in the scale of the room', async () => {
    await hand(place);
    await hand(place, 1);
    await page.until('the scalpel in hand', (s) => s.held === 0);
    await hand(place);
    const from = await until('the scalpel', tip);
    const here = await still('rest');
    await hand([place[0] + 0.1, place[1], place[2]]);
    await page.until('a way to the right', (s) => apart(s.tools[0].at_m, here) > 0.002);
    const right = await still('rest');
    await hand(place);
    await page.until('the way back', (s) => apart(s.tools[0].at_m, right) > 0.002);
    await still('rest');
    await hand([place[0], place[1] - 0.1, place[2]]);
    await page.until('a way down', (s) => s.tools[0].at_m?.[2] < here[2] - 0.002);
    const down = await still('rest');
    const ways = [apart(right, here), here[2] - down[2]];
    assert.ok(from && Math.abs(ways[0] - ways[1]) < 0.1 * ways[0] && ways[0] < 0.1, `as far in each direction: ${ways}`);
    assert.ok(Math.abs(right[2] - here[2]) < 0.001, 'to the right is level');
  });

  await check('a hand that goes into the tissue cuts it at the server', async () => {
    const { cuts: before } = await page.state();
    await until('a force at the tip', async () => {
      const { tools } = await page.state();
      if (tools[0].force_n > 0.05) return true;
      place = [place[0], place[1] - 0.005, place[2]];
      if (place[1] < -0.8) throw new Error('there is no tissue beneath the hand');
      await hand(place);
      return false;
    });
    // Towards the person, as the sharp edge looks.
    place = [place[0], place[1] - 0.015, place[2]];
    for (let i = 0; i < 60 && (await page.state()).cuts < before + 30; ++i) {
      const { step } = await page.state();
      place = [place[0], place[1], place[2] + 0.006];
      await hand(place);
      await page.until('steps with the hand there', (s) => s.step > step + 100);
    }
    await page.until('a cut that the page has, too', (s) => s.cuts >= before + 20 && equal(s));
    if (!pictures) return;
    const { step } = await page.state();
    await page.evaluate(`device.quaternion.set(-0.2, 0, 0, 0.98)`);
    await page.until('the look down', (s) => s.step > step + 200);
    writeFileSync(join(pictures, 'live_headset.png'), await picture_of_eyes(page));
  });

  await check('the hand that holds the grip carries the scene, and the instrument stays in it', async () => {
    const here = await still('rest in the tissue');
    const { eyes: before } = await page.evaluate('(({ eyes }) => ({ eyes }))(seen())');
    await page.evaluate(`device.controllers.right.updateButtonValue('squeeze', 1)`);
    const { step } = await page.state();
    await page.until('a hand that holds', (s) => s.step > step + 200);
    await hand([place[0] + 0.15, place[1], place[2]]);
    await until('a scene that has moved', () => page.evaluate(`seen().eyes[0].middle > ${before[0].middle + 0.03}`));
    assert.ok(apart(await tip(), here) < 0.002);
    await page.evaluate(`device.controllers.right.updateButtonValue('squeeze', 0)`);
  });

  await check('who takes the headset off is at the page again', async () => {
    await page.evaluate('device.activeSession.end()');
    await page.until('the page', (s) => !s.headset);
    await until('a picture on the canvas', async () => (await page.pixels()).tissue > 0.1);
  });
} finally {
  await browser.close();
}
const report = await session.end();
assert.ok(report.run.cuts_made >= 20, `the server has cut: ${report.run.cuts_made}`);
session.forget();

// The framebuffer of both eyes as a PNG.
async function picture_of_eyes(page) {
  return Buffer.from(await page.evaluate(`(() => {
    const { width, height, data } = seen();
    const canvas = Object.assign(document.createElement('canvas'), { width, height });
    const context = canvas.getContext('2d'), image = context.createImageData(width, height);
    for (let y = 0; y < height; ++y)
      image.data.set(data.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
    for (let i = 3; i < image.data.length; i += 4) image.data[i] = 255;
    context.putImageData(image, 0, 0);
    return canvas.toDataURL('image/png').split(',')[1];
  })()`), 'base64');
}
