// A session with people in browsers: deploy/live, a headless Chromium, a mouse. Each check stands on the session that
// the ones before it have left.
// usage: node tests/live/live_test.mjs [DIRECTORY for the pictures of docs/live.md]
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Browser, sleep, until } from './browser.mjs';
import { apart, check, equal, root, Session } from './session.mjs';

const pictures = process.argv[2];
const session = await Session.begin('--max-clients', '8');
const { address, watching, out } = session;
const metric = (name) => session.metric(name);
const processes = (program) => session.processes(program);

const path = [];  // path of the scalpel's tip while the button was down
const browser = new Browser();
try {
  const ada = await browser.open(address);
  await check('a browser shows the session, and holds what the server holds', async () => {
    await ada.until('a replica that equals the server', equal);
    assert.match(await ada.evaluate(
      `document.createElement('canvas').getContext('webgl2')?.getParameter(WebGL2RenderingContext.VERSION)`), /WebGL 2/);
    const seen = await until('a picture', async () => {
      const p = await ada.pixels();
      return p.tissue > 0.2 ? p : null;
    });
    assert.ok(seen.tissue < 0.95, 'there is a background, too');
    assert.equal(await ada.evaluate(`document.querySelector('#bodies .yes').textContent`), 'equals server: yes');
    if (pictures) await ada.picture(join(pictures, 'live_opened.png'));
  });

  const before = await ada.pixels();
  await check('a mouse cuts where it is dragged', async () => {
    await ada.evaluate(`Object.assign(document.getElementById('name'), { value: 'Ada' }).onchange()`);
    await ada.click('Take in hand');
    await ada.until('the scalpel in hand', (s) => s.held === 0);
    const places = Array.from({ length: 45 }, (_, i) => [110 + 5 * i, 150 + 0.5 * i]);
    let most_n = 0;
    await ada.drag(places, 60, async () => {
      const { tools } = await ada.state();
      most_n = Math.max(most_n, tools[0].force_n);
      if (tools[0].at_m) path.push(tools[0].at_m);
      if (pictures && path.length === 34) await ada.picture(join(pictures, 'live_cut.png'));
    });
    const { cuts } = await ada.until('a cut', (s) => s.cuts > 20);
    assert.ok(most_n > 0.02 && most_n < 10, `the page shows the force at the tip, at most ${most_n} N`);
    await ada.until('equality after the cut', equal);
    const after = await ada.pixels();
    const changed = after.some.filter((v, i) => Math.abs(v - before.some[i]) > 25).length / after.some.length;
    assert.ok(changed > 0.005, `the picture shows it: ${(100 * changed).toFixed(1)} % of the pixels, ${cuts} cuts`);
  });

  const ben = await browser.open(address);
  await check('a second browser sees the same, and who holds what', async () => {
    const b = await ben.until('a replica', (s) => equal(s) && s.people.length === 2 && s.pictures > 0);
    const a = await ada.until('the same revision', (s) => s.bodies[0].revision >= b.bodies[0].revision && equal(s));
    const again = await ben.until('the same revision', (s) => s.bodies[0].revision === a.bodies[0].revision);
    assert.equal(again.bodies[0].hash, a.bodies[0].hash);
    assert.equal(again.tools[0].holder, a.you);
    assert.equal(again.held, null);
  });

  await check('an instrument goes from one to the other, and the loser is told', async () => {
    await ben.evaluate(`Object.assign(document.getElementById('name'), { value: 'Ben' }).onchange()`);
    await ben.click('Take over');
    await ben.until('the scalpel', (s) => s.held === 0);
    const lost = await ada.until('the loss', (s) => s.held === null);
    assert.ok(lost.lines.some((l) => l.text === 'Ben has taken the scalpel from you'), JSON.stringify(lost.lines));
    if (pictures) await ben.picture(join(pictures, 'live_two.png'));
    await ben.click('Give to Ada');
    await ada.until('the gift', (s) => s.held === 0);
    await ben.until('empty hands', (s) => s.held === null);
    await ada.mouse('mouseMoved', 200, 150);
    await ada.until('the scalpel under the mouse', (s) => s.wish && apart(s.wish, s.tools[0].tip) < 0.05);
  });

  await check('a pad leads the instrument, and the mouse takes over', async () => {
    const before_m = (await ada.state()).tools[0].at_m;
    await ada.evaluate(`(() => {
      const buttons = Array.from({ length: 17 }, () => ({ pressed: false, value: 0 }));
      window.pad = { connected: true, axes: [0.9, 0, 0, 0], buttons };
      navigator.getGamepads = () => [window.pad];
    })()`);
    const led = await ada.until('the scalpel where the pad pushes it',
      (s) => s.pad && s.tools[0].at_m?.[0] - before_m[0] > 0.01);
    assert.ok(Math.abs(led.tools[0].at_m[1] - before_m[1]) < 0.01, 'to the right alone');
    await ada.evaluate('window.pad.axes[0] = 0; window.pad.buttons[6] = { pressed: true, value: 1 }');
    await ada.until('the scalpel higher', (s) => s.tools[0].at_m?.[2] - led.tools[0].at_m[2] > 0.01);
    await ada.evaluate('navigator.getGamepads = () => []');
    await ada.mouse('mouseMoved', 210, 150);
    await ada.until('the mouse', (s) => !s.pad && s.wish && apart(s.wish, s.tools[0].tip) < 0.05);
  });

  await check('a section leaves tissue out, wires and colours show', async () => {
    const tick = (id, on) => ada.evaluate(`(() => {
      const box = document.getElementById('${id}');
      box.checked = ${on};
      box.onchange();
    })()`);
    const differs = async (than, what) => until(what, async () => {
      const { some } = await ada.pixels();
      return some.filter((v, i) => Math.abs(v - than.some[i]) > 25).length / some.length > 0.02;
    });
    const whole = await ada.pixels();
    await tick('section', true);
    await differs(whole, 'a section');
    if (pictures) await ada.picture(join(pictures, 'live_section.png'));
    const cut = await ada.pixels();
    await tick('section', false);
    await differs(cut, 'the whole body');
    await tick('wireframe', true);
    await differs(whole, 'edges of triangles');
    await tick('wireframe', false);
    assert.deepEqual(await ada.evaluate(`[...document.getElementById('field').options].map((o) => o.text)`),
      ['tissue', ...(await ada.state()).fields]);
  });

  await check('the score is told to all', async () => {
    await ada.click('Score');
    const { score } = await ben.until('the score', (s) => s.score.length > 0);
    await until('its lines', () => ben.evaluate(`!document.getElementById('score_of').hidden &&
      document.getElementById('score_lines').textContent.startsWith(${JSON.stringify(score[0])})`));
  });

  await check('a wish is seen soon', async () => {
    const delays_ms = await ada.evaluate(`new Promise((done) => {
      const delays = [], start = 190;
      let count = 0, asked = 0, from = null;
      const at = () => window.sectio.state.tools[0].at_m ?? [NaN, NaN, NaN];
      const ask = () => {
        const x = start + (++count % 2 ? 30 : 0);
        from = at();
        asked = performance.now();
        document.getElementById('canvas').dispatchEvent(new PointerEvent('pointermove',
          { clientX: x, clientY: 150, buttons: 0, pointerId: 1 }));
      };
      const look = () => {
        if (asked && Math.hypot(...at().map((v, i) => v - from[i])) > 0.001) {
          delays.push(performance.now() - asked);
          asked = 0;
          if (delays.length === 40) return done(delays);
          setTimeout(ask, 400);
        } else if (asked && performance.now() - asked > 10000) ask();  // it was on its way back there already
        requestAnimationFrame(look);
      };
      ask();
      look();
    })`);
    delays_ms.sort((a, b) => a - b);
    const share = (q) => delays_ms[Math.min(delays_ms.length - 1, Math.floor(q * delays_ms.length))].toFixed(0);
    console.log(`    from the mouse to a picture of an instrument that has moved 1 mm: median ${share(0.5)} ms, ` +
      `99 % within ${share(0.99)} ms (drawn in software)`);
  });

  await check('a browser without WebGL shows what the gateway draws', async () => {
    const { width, height } = await ben.evaluate(`fetch('frame.jpg').then((r) => r.blob()).then(createImageBitmap)
      .then(({ width, height }) => ({ width, height }))`);
    assert.deepEqual([width, height], [960, 540]);
    const old = await browser.open(watching, { before: `HTMLCanvasElement.prototype.getContext = () => null` });
    await until('the warning', async () => (await old.warning()) === 'this browser has no WebGL 2: the gateway draws');
    await until('pictures, one after the other', () => old.evaluate('window.sectio.stills > 1'));
    await old.until('who is here, all the same', (s) => s.people.length === 3);
    await old.close();
    await ada.until('that it has gone', (s) => s.people.length === 2);
  });

  await check('who has no token watches, and is offered nothing', async () => {
    const eve = await browser.open(watching);
    const state = await eve.until('a replica', equal);
    assert.equal(state.people.find((p) => p.id === state.you).may_write, false);
    assert.equal(await eve.evaluate(`document.querySelectorAll('#tools button').length`), 0);
    await eve.close();
    await ada.until('that Eve has left', (s) => s.people.length === 2);
  });

  await check('a page of another version is told so in a line', async () => {
    const old = await browser.open(watching + '?protocol=sectio-live-0.9');
    const text = await until('the warning', () => old.warning());
    assert.match(text, /^this page speaks sectio-live-0\.9, the gateway sectio-live-\d+\.\d+: load the page again$/);
    assert.ok(await metric('refused_versions_total') > 0);
    await old.close();
  });

  await check('garbage, haste, greed and crowds are refused and counted, and nobody is disturbed', async () => {
    const step = (await ada.state()).step;
    const closed = (send) => ben.evaluate(`new Promise((done) => {
      const s = new WebSocket(location.origin.replace('http', 'ws'), window.sectio.socket.protocol);
      s.onopen = () => { ${send} };
      s.onclose = (e) => done(e.code);
    })`);
    await closed('for (let i = 0; i < 50; ++i) s.send(crypto.getRandomValues(new Uint8Array(100)))');
    assert.ok(await metric('refused_garbage_total') >= 16);
    await closed('s.send(new Uint8Array(50e6))');
    assert.ok(await metric('refused_long_messages_total') > 0);
    const crowd = await ben.evaluate(`Promise.all(Array.from({ length: 100 }, () => new Promise((done) => {
      const s = new WebSocket(location.origin.replace('http', 'ws'), window.sectio.socket.protocol);
      (window.crowd ??= []).push(s);
      s.onmessage = () => done(true);
      s.onclose = () => done(false);
    }))).then((all) => all.filter(Boolean).length)`);
    assert.ok(crowd <= 6, `${crowd} more than the two that are here`);
    assert.ok(await metric('clients_refused_total') >= 94);
    await ben.evaluate(`window.crowd.forEach((s) => s.close())`);
    await ada.until('the session to go on', (s) => s.step > step + 200 && equal(s) && s.held === 0);
  });

  await check('a page says that the server is silent, and goes on when it is back', async () => {
    const [server] = processes('/sim_server');
    process.kill(server, 'SIGSTOP');
    await until('the warning', async () => (await ada.warning()).startsWith('the server has been silent for '));
    process.kill(server, 'SIGCONT');
    const { step } = await ada.state();
    await ada.until('the session to go on', (s) => s.step > step && s.silent_s < 1);
  });

  await check('a connection that stood still for three seconds comes back, with what it has missed', async () => {
    const [gateway] = processes('/gateway');
    const [before_m] = (await ada.state()).tools.map((t) => t.at_m);
    process.kill(gateway, 'SIGSTOP');
    await sleep(3000);
    process.kill(gateway, 'SIGCONT');
    const { step } = await ada.state();
    await ada.until('the session to go on', (s) => s.step > step + 6000 && s.silent_s < 1 && equal(s));
    // Meanwhile the instrument was drawn out.
    await ada.until('the scalpel back in its hand', (s) => s.held === 0 && apart(s.tools[0].at_m, before_m) < 0.01);
  });

  await check('who leads pauses the session, lets it go on, and begins it anew', async () => {
    await ada.click('Pause');
    const paused = await ben.until('the pause', (s) => s.speed === 0);
    await ben.until('a pause that lasts', (s) => s.silent_s < 0.1 && s.time_s - paused.time_s < 0.2);
    await until('the word', () => ben.evaluate(`document.getElementById('time').textContent.endsWith(', paused')`));
    await ada.click('Go on');
    await ben.until('the session to go on', (s) => s.speed === 1 && s.step > paused.step + 1000);
    const there = await ben.until('time to go back by', (s) => s.time_s > 31);
    for (let i = 0; i < 3; ++i) await ada.click('10 s back');
    const back = await ben.until('the time half a minute before', (s) => equal(s) && s.time_s < there.time_s - 25);
    assert.deepEqual(back.lines.filter((line) => line.text.startsWith('seek: ')), [], 'nothing is refused');
    await ada.begin_anew();
    for (const page of [ada, ben])
      await page.until('the body as it was at first',
        (s) => equal(s) && s.step < paused.step && s.bodies[0].revision < paused.bodies[0].revision);
  });

  await check('an instrument whose hand has gone is free, and is drawn out', async () => {
    const [before_m] = (await ben.state()).tools.map((t) => t.at_m);
    await ada.close();
    await ben.until('a free scalpel', (s) => s.tools[0].holder === 0);
    await ben.until('a scalpel that is away', (s) => apart(s.tools[0].at_m, before_m) > 0.1);
  });
} finally {
  await browser.close();
}

await check('Ctrl-C ends all of it, and the report has the cut where the mouse was', async () => {
  const report = await session.end();
  assert.ok(report.run.cuts_made > 20, `cuts: ${report.run.cuts_made}`);
  const vertices = (file) => readFileSync(file, 'utf8').split('\n').filter((l) => l.startsWith('v '))
    .map((l) => l.split(/\s+/).slice(1, 4).map(Number));
  const rest = vertices(join(root, 'deploy/meshes/liver_10k.obj')), cut = vertices(join(out, 'liver.obj'));
  const made = cut.slice(rest.length);
  assert.ok(made.length > 30, `${made.length} vertices were made`);
  const near = made.filter((v) => path.some((p) => apart(v, p) < 0.015)).length;
  assert.ok(near > 0.9 * made.length, `${near} of ${made.length} lie where the blade was`);
  const reached = path.filter((p) => made.some((v) => apart(v, p) < 0.015)).length;
  assert.ok(reached > 0.5 * path.length, `the cut follows ${reached} of ${path.length} places of the mouse`);
});
session.forget();
