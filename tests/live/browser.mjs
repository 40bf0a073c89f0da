// A headless Chromium, driven by its own protocol over a pipe: no other package is needed.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

// Software rendering must be asked for by name: without the last flag WebGL fails, and pages would be tested without it.
const FLAGS = ['--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--remote-debugging-pipe', '--no-first-run', '--disable-extensions', '--disable-background-timer-throttling',
  '--disable-renderer-backgrounding', '--disable-backgrounding-occluded-windows', '--hide-scrollbars'];
const PATIENCE_MS = 90000;

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

// Waits for a condition; an error names it.
export async function until(what, condition, patience_ms = PATIENCE_MS) {
  const end = Date.now() + patience_ms;
  for (;;) {
    const value = await condition();
    if (value) return value;
    if (Date.now() > end) throw new Error('waited in vain: ' + what);
    await sleep(100);
  }
}

export class Browser {
  #process; #next = 1; #calls = new Map(); #rest = ''; #profile;

  constructor(program = process.env.SECTIO_CHROMIUM ?? 'chromium') {
    this.#profile = mkdtempSync(join(tmpdir(), 'sectio_browser_'));
    this.#process = spawn(program, [...FLAGS, '--user-data-dir=' + this.#profile],
      { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.#process.stdio[4].setEncoding('utf8').on('data', (text) => this.#read(text));
  }

  #read(text) {
    const messages = (this.#rest + text).split('\0');
    this.#rest = messages.pop();
    for (const message of messages.map((m) => JSON.parse(m))) {
      const call = this.#calls.get(message.id);
      if (!call) continue;
      this.#calls.delete(message.id);
      if (message.error) call.fail(new Error(message.error.message));
      else call.done(message.result);
    }
  }

  send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    this.#process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + '\0');
    return new Promise((done, fail) => this.#calls.set(id, { done, fail }));
  }

  // A page of its own context: nothing is shared with the other pages.
  // `before`: a script that runs before those of the page.
  async open(url, { width = 640, height = 300, before = '' } = {}) {
    const { browserContextId } = await this.send('Target.createBrowserContext');
    const { targetId } = await this.send('Target.createTarget', { url: 'about:blank', browserContextId, width, height });
    const { sessionId } = await this.send('Target.attachToTarget', { targetId, flatten: true });
    const page = new Page(this, sessionId, targetId);
    await page.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
    if (before) {
      await page.send('Page.enable');
      await page.send('Page.addScriptToEvaluateOnNewDocument', { source: before });
    }
    await page.send('Page.navigate', { url });
    return page;
  }

  async close() {
    const ended = new Promise((done) => this.#process.on('exit', done));
    this.#process.kill();
    await ended;
    // Its other processes write there a little longer.
    await until('the end of all that writes to the profile', () => {
      try {
        rmSync(this.#profile, { recursive: true, force: true });
        return true;
      } catch {
        return false;
      }
    });
  }
}

class Page {
  constructor(browser, session, target) {
    Object.assign(this, { browser, session, target });
  }
  send(method, params) { return this.browser.send(method, params, this.session); }
  close() { return this.browser.send('Target.closeTarget', { targetId: this.target }); }

  async evaluate(expression) {
    const { result, exceptionDetails } =
      await this.send('Runtime.evaluate', { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  // The red line at the top; empty when there is none.
  warning() {
    return this.evaluate(`(() => {
      const line = document.getElementById('warning');
      return line && !line.hidden ? line.textContent : '';
    })()`);
  }
  state() { return this.evaluate('window.sectio?.state'); }
  // Waits until `condition` holds for what the page knows.
  async until(what, condition, patience_ms) {
    let last = null;
    try {
      return await until(what, async () => {
        last = await this.state();
        return last && condition(last) ? last : null;
      }, patience_ms);
    } catch (error) {
      throw new Error(`${error.message}; the page knows ${JSON.stringify(last)}`);
    }
  }

  mouse(type, x, y, buttons = 0, more = {}) {
    return this.send('Input.dispatchMouseEvent',
      { type, x, y, buttons, button: type === 'mouseMoved' ? 'none' : 'left', clickCount: 1, ...more });
  }
  async key(key) {
    for (const type of ['keyDown', 'keyUp']) await this.send('Input.dispatchKeyEvent', { type, key, text: key });
  }
  // Fingers on the screen from now on: touchStart and touchMove with their places, touchEnd with the first ones, which
  // stay. Chromium is told of those that go.
  touch(type, ...places) {
    const points = places.map(([x, y], id) => ({ x, y, id }));
    const touchPoints = type === 'touchEnd' && points.length > 0 ? this.fingers.slice(points.length) : points;
    this.fingers = points;
    return this.send('Input.dispatchTouchEvent', { type, touchPoints });
  }
  async click(text) {
    await until(`a button "${text}"`, () => this.evaluate(`(() => {
      const found = [...document.querySelectorAll('button:enabled')].find((b) => b.textContent === ${JSON.stringify(text)});
      found?.click();
      return Boolean(found);
    })()`));
  }
  async begin_anew() {
    await this.click('Begin anew');
    await this.click('Begin anew: sure?');
  }
  // Presses, drags through the places and lets go; visit() is called at each place.
  async drag(places, pause_ms, visit = async () => {}) {
    await this.mouse('mouseMoved', ...places[0]);
    await sleep(300);
    await this.mouse('mousePressed', ...places[0], 1);
    await sleep(700);
    for (const place of places) {
      await this.mouse('mouseMoved', ...place, 1);
      await sleep(pause_ms);
      await visit();
    }
    await this.mouse('mouseReleased', ...places.at(-1), 0);
  }
  async picture(path) {
    const { data } = await this.send('Page.captureScreenshot', { format: 'png' });
    writeFileSync(path, Buffer.from(data, 'base64'));
  }
  // Applies a function of the page to an image of the canvas, `{ data, width, height }`, four bytes a pixel, rows from
  // the top, and to further arguments.
  see(look, ...more) {
    return this.evaluate(`(() => {
      const from = document.getElementById('canvas'), to = document.createElement('canvas');
      to.width = from.width; to.height = from.height;
      const context = to.getContext('2d');
      context.drawImage(from, 0, 0);
      return (${look})(context.getImageData(0, 0, to.width, to.height), ...${JSON.stringify(more)});
    })()`);
  }
  // The share of the canvas' pixels that look like tissue, and the pixels themselves at every eighth place.
  pixels() {
    return this.see(({ data }) => {
      let red = 0;
      for (let i = 0; i < data.length; i += 4) red += data[i] > 60 && data[i] > 1.6 * data[i + 1] ? 1 : 0;
      const some = [];
      for (let i = 0; i < data.length; i += 4 * 8) some.push(data[i]);
      return { tissue: red / (data.length / 4), some };
    });
  }
  // Places of pixels that are drawn in ink, beside the panel: they are blue, and what is above or below has more than so
  // many times as much red as blue (0: whatever it is).
  ink(redness = 0) {
    return this.see(({ data, width, height }, redness) => {
      const end = Math.min(width, document.getElementById('panel').getBoundingClientRect().left - 10);
      const is_red = (x, y) => redness === 0 || data[4 * (y * width + x)] > redness * data[4 * (y * width + x) + 2];
      const blue = [];
      for (let y = 6; y < height - 6; ++y)
        for (let x = 0; x < end; ++x) {
          const i = 4 * (y * width + x);
          if (data[i + 2] > 50 && data[i + 2] > 1.3 * data[i] && (is_red(x, y - 6) || is_red(x, y + 6))) blue.push([x, y]);
        }
      return blue;
    }, redness);
  }
}
