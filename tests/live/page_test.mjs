// A page tells the people at it what happens: deploy/live, a headless Chromium, and links that stand still and break.
// Each check stands on the session that the ones before it have left.
// usage: node tests/live/page_test.mjs [DIRECTORY for the pictures of docs/live.md]
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Browser, sleep, until } from './browser.mjs';
import { Link } from './link.mjs';
import { apart, check, equal, root, Session } from './session.mjs';

const pictures = process.argv[2];
const session = await Session.begin(join(root, 'deploy/scenes/incision_templates.yaml'));
const text = (page, id) => page.evaluate(`document.getElementById('${id}')?.textContent ?? ''`);
const is_seen = (page, id) => page.evaluate(`document.getElementById('${id}').checkVisibility()`);
const line = (state, beginning) => state.lines.find((l) => l.text.startsWith(beginning));
const way = (x, to, y) => Array.from({ length: 25 }, (_, i) => [x + (to - x) * i / 24, y]);
const call_oneself = (page, name) =>
  page.evaluate(`Object.assign(document.getElementById('name'), { value: '${name}' }).onchange()`);

const browser = new Browser();
const link = await Link.to(session.address);
try {
  const ada = await browser.open(session.address);
  await ada.until('a replica that equals the server', equal);
  await call_oneself(ada, 'Ada');

  await check('on a small screen the panel is folded, and as somebody has left it after that', async () => {
    assert.ok(await is_seen(ada, 'panel'));
    const phone = await browser.open(session.address, { width: 390, height: 844 });
    await phone.until('a picture', (s) => equal(s) && s.pictures > 0);
    assert.equal(await is_seen(phone, 'panel'), false);
    for (const [width, height] of [[844, 390], [390, 844]]) {
      await phone.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
      await until('the panel as it suits the screen', async () => (await is_seen(phone, 'panel')) === (width > 600));
    }
    await phone.click('Panel');
    assert.ok(await is_seen(phone, 'panel'));
    await phone.evaluate('window.is_old = true');
    await phone.send('Page.reload');
    await until('the page again', () => phone.evaluate('!window.is_old && Boolean(window.sectio?.state)'));
    assert.ok(await is_seen(phone, 'panel'));
    await phone.click('Hide');
    assert.equal(await is_seen(phone, 'panel'), false);
    await phone.close();
  });

  await check('a name ends where the gateway takes no more, between two characters', async () => {
    const called = (s) => s.people.find((p) => p.id === s.you)?.name;
    for (const [character, count] of [['医', 21], ['🩺', 16]]) {
      await call_oneself(ada, character.repeat(28));
      await ada.until('the name', (s) => called(s) === character.repeat(count));
      assert.equal(await ada.evaluate(`document.getElementById('name').value`), character.repeat(count));
    }
    const again = await browser.open(session.address, { before: `sessionStorage.setItem('name', '${'医'.repeat(28)}')` });
    await again.until('a name of before', (s) => called(s) === '医'.repeat(21));
    await again.close();
    await call_oneself(ada, 'Ada');
    await ada.until('the name', (s) => called(s) === 'Ada' && s.people.length === 1);
    await call_oneself(ada, ' ');
    assert.equal(await ada.evaluate(`document.getElementById('name').value`), 'Ada', 'a name that is emptied comes back');
  });

  await check('whoever has an address that is damaged watches, and is told so', async () => {
    for (const token of ['%E0%A4%A', 'x'.repeat(200)]) {
      const eve = await browser.open(`${session.watching}#${token}`);
      await eve.until('the word of it', (s) => equal(s) && line(s, 'the token in the address is not this session\'s'));
      await until('the warning', async () => (await eve.warning()).includes('a wrong token'));
      await eve.close();
    }
    await ada.until('that nobody else is here', (s) => s.people.length === 1);
  });

  await check('people of the same name are told apart by a number', async () => {
    const people = (page) => page.evaluate(`[...document.querySelectorAll('#people li')].map((p) => p.textContent)`);
    const others = [];
    for (let count = 2; count <= 3; ++count) {
      const page = await browser.open(session.address);
      await page.until('a replica', (s) => equal(s) && s.people.length === count);
      await call_oneself(page, 'Ada');
      await page.until('the name', (s) => s.people.every((p) => p.name.startsWith('Ada')) && s.you !== 0);
      others.push(page);
    }
    const is_shown = (page, names) => until(names.join(', '), async () => (await people(page)).join() === names.join());
    await is_shown(ada, ['Ada (you)', 'Ada (2)', 'Ada (3)']);
    await is_shown(others[1], ['Ada', 'Ada (2)', 'Ada (3) (you)']);
    await ada.click('Take in hand');
    await ada.click('Give to Ada (3)');
    await others[1].until('the scalpel in hand', (s) => s.held === 0);
    await others[1].click('Put down');
    await ada.until('a free scalpel', (s) => s.tools[0].holder === 0);
    for (const page of others) await page.close();
    await is_shown(ada, ['Ada (you)']);
  });

  await check('whoever comes later sees how far the table is tilted', async () => {
    await ada.evaluate(`(() => {
      const tilt = Object.assign(document.getElementById('tilt'), { value: 20 });
      for (const kind of ['input', 'change']) tilt.dispatchEvent(new Event(kind));
    })()`);
    await ada.until('the word of it', (s) => line(s, 'gravity turns to [3.36, 0, -9.22] m/s2'));
    const late = await browser.open(session.watching);
    await until('the tilt', async () => (await text(late, 'tilt_said')) === '20°');
    assert.equal(await late.evaluate(`document.getElementById('tilt').value`), '20');
    await late.close();
  });

  await check('who holds nothing yet is told how to, and who watches how to take part', async () => {
    const late = await browser.open(session.watching);
    await until('the hint', async () => (await text(late, 'hint')).startsWith('You are watching'));
    await late.evaluate(`location.hash = ${JSON.stringify(new URL(session.address).hash)}`);
    await late.until('the right to hold', (s) => s.people.find((p) => p.id === s.you)?.may_write);
    await until('the hint', async () => (await text(late, 'hint')) === 'To hold an instrument, press Take in hand.');
    await late.click('Take in hand');
    await until('its end', async () => !(await is_seen(late, 'hint')));
    await late.click('Put down');
    await late.until('an empty hand', (s) => s.held === null);
    const { step } = await late.until('a state', (s) => s.held === null);
    await late.until('the next states', (s) => s.held === null && s.step > step + 30);
    assert.equal(await is_seen(late, 'hint'), false, 'they know how to hold one');
    await late.close();
  });

  await check('a pause is told at the picture', async () => {
    await ada.click('Pause');
    await until('the hint', async () => (await text(ada, 'hint')) === 'The session is paused.');
    await ada.click('Go on');
    await until('its end', async () => (await text(ada, 'hint')) !== 'The session is paused.');
  });

  await check('a press where there is no body is answered', async () => {
    for (let i = 0; i < 6; ++i) await ada.mouse('mouseWheel', 200, 150, 0, { deltaX: 0, deltaY: 100 });  // farther away
    await ada.click('Take in hand');
    await ada.until('the scalpel in hand', (s) => s.held === 0);
    await until('no hint', async () => !(await is_seen(ada, 'hint')));
    await ada.mouse('mousePressed', 5, 20, 1);  // further from the liver than a stroke may begin
    await until('the hint', () => is_seen(ada, 'hint'));
    await ada.mouse('mouseReleased', 5, 20, 0);
    await until('its end', async () => !(await is_seen(ada, 'hint')));
    await ada.click('First view');
  });

  const ben = await browser.open(link.address);
  await check('a page whose link stands still for three seconds has the same body as the others afterwards', async () => {
    const before = await ben.until('a replica', equal);
    await call_oneself(ben, 'Ben');
    link.stop();
    const stopped_ms = Date.now();
    await ada.drag(way(120, 240, 150), 60);
    const { bodies } = await ada.until('a cut', (s) => s.cuts > 5 && equal(s));
    await until('the word of it', async () => (await ben.warning()).startsWith('the gateway has been silent for '));
    assert.equal((await ben.state()).bodies[0].hash, before.bodies[0].hash, 'nothing has come');
    await sleep(Math.max(0, stopped_ms + 3000 - Date.now()));
    link.go_on();
    assert.notEqual(bodies[0].hash, before.bodies[0].hash);
    await ben.until('what it has missed', (s) => s.bodies[0].revision >= bodies[0].revision && equal(s));
    const [a, b] = await until('the same revision', async () => {
      const both = [await ada.state(), await ben.state()];
      return both.every(equal) && both[0].bodies[0].revision === both[1].bodies[0].revision ? both : null;
    });
    assert.equal(a.bodies[0].hash, b.bodies[0].hash);
    await ben.until('the word of it', (s) => line(s, 'the gateway was silent for '));
  });

  await check('a cut that is refused says why', async () => {
    // Templates don't go back where they have just cut.
    const scribble = (k) => Array.from({ length: 60 }, (_, i) =>
      [170 + 60 * Math.sin(i * (0.7 + 0.1 * k)), 190 + 40 * Math.cos(i * 1.1)]);
    for (let k = 0; k < 6 && !line(await ada.state(), 'scalpel, cut refused: '); ++k) await ada.drag(scribble(k), 60);
    const refused = await ada.until('a refusal', (s) => line(s, 'scalpel, cut refused: '));
    assert.ok(refused.refused > 0);
    await until('its line', async () => (await text(ada, 'lines')).includes(line(refused, 'scalpel, cut refused: ').text));
  });

  await check('a server that is late again and again is one line', async () => {
    const [server] = session.processes('/sim_server');
    for (let i = 0; i < 4; ++i) {
      const told = line(await ada.state(), 'pace of the server ')?.count ?? 0;
      process.kill(server, 'SIGSTOP');
      await sleep(300);
      process.kill(server, 'SIGCONT');
      await ada.until('the word of it', (s) => line(s, 'pace of the server ')?.count > told);
    }
    const { lines } = await ada.state();
    assert.equal(lines.filter((l) => l.text.startsWith('pace of the server ')).length, 1);
    await until('its count', async () => /pace of the server .* times, last at \d+\.\d s/.test(await text(ada, 'lines')));
  });

  await check('a frozen instrument stays where it is, whatever the mouse does', async () => {
    const place = (s) => JSON.stringify(s.tools[0].at_m);
    await ada.drag(way(160, 240, 120), 20);
    await ada.click('Freeze');
    let last = '';
    const at = place(await ada.until('a scalpel that stands', (s) => {
      const stands = s.tools[0].frozen && place(s) === last;
      last = place(s);
      return stands;
    }));
    await ada.drag(way(120, 240, 150), 60);
    assert.equal(place(await ada.state()), at);
    await until('its word', async () => (await text(ada, 'tools')).includes('scalpel: you, frozen'));
    assert.equal(await text(ada, 'hint'), "The scalpel is frozen: it doesn't follow your hand until you press Thaw.");
    await ada.click('Thaw');
    await ada.until('a scalpel that has been let go', (s) => !s.tools[0].frozen);
    await ada.drag(way(120, 240, 150), 60);
    await ada.until('a scalpel elsewhere', (s) => s.tools[0].present && place(s) !== at);
    assert.equal(await is_seen(ada, 'hint'), false);
  });

  await check('who begins anew thaws what was frozen, and who goes back does not', async () => {
    const begins = (condition) => ada.until('the beginning', (s) => s.time_s < 5 && equal(s) && condition(s.tools[0]));
    await ada.click('Freeze');
    await ada.until('a frozen scalpel', (s) => s.tools[0].frozen && s.time_s > 10);
    await ada.begin_anew();
    await begins((scalpel) => !scalpel.frozen && scalpel.holder !== 0);
    await ada.mouse('mouseMoved', 200, 150);
    await ada.until('a scalpel under the mouse', (s) => s.wish && apart(s.wish, s.tools[0].tip) < 0.05);
    await ada.click('Freeze');
    await ada.until('a frozen scalpel', (s) => s.tools[0].frozen);
    await ada.click('10 s back');
    await begins((scalpel) => scalpel.frozen && !scalpel.present);
    await until('its word', async () => (await text(ada, 'tools')).includes('scalpel: you, frozen, and not in the scene'));
    await ada.click('Thaw');
    await ada.mouse('mouseMoved', 210, 150);
    await ada.until('the scalpel again', (s) => s.wish && apart(s.wish, s.tools[0].tip) < 0.05);
  });

  await check('a lost connection is told, with the instrument that went, and offers nothing meanwhile', async () => {
    await ada.click('Put down');
    await ben.click('Take in hand');
    await ben.until('the scalpel in hand', (s) => s.held === 0);
    const idle = (page) => page.evaluate(`[...document.querySelectorAll('#orders button, #tools button')]
      .every((b) => b.matches(':disabled'))`);
    assert.equal(await idle(ben), false);
    link.break();
    await ben.until('the loss', (s) => s.held === null);
    await until('nothing to press', () => idle(ben));
    assert.match(line(await ben.state(), 'connection lost at ').text, /, and with it the scalpel that you held$/);
    await ada.until('a free scalpel', (s) => s.tools[0].holder === 0);
    if (pictures) {
      await ben.send('Emulation.setDeviceMetricsOverride', { width: 640, height: 790, deviceScaleFactor: 1, mobile: false });
      await until('a picture of that size', () => ben.evaluate(`document.getElementById('canvas').height > 700`));
      await ben.evaluate('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
      await ben.picture(join(pictures, 'live_lost.png'));
    }
    link.mend();
    const back = await ben.until('the way back', (s) => line(s, 'connected again at '));
    assert.match(line(back, 'connected again at ').text, /, after \d+ s$/);
    await ben.click('Take in hand');
    await ben.until('the scalpel in hand again', (s) => s.held === 0);
  });

  await check('another server in the place of one that hangs is told', async () => {
    const [server] = session.processes('/sim_server');
    const [program, ...words] = readFileSync(`/proc/${server}/cmdline`, 'utf8').split('\0').slice(0, -1);
    process.kill(server, 'SIGSTOP');
    await until('the warning', async () => (await text(ben, 'warning')).includes('has been silent for'));
    const silences = line(await ben.state(), 'the server was silent for')?.count ?? 0;
    await ben.click('Put down');
    await ben.until('an empty hand', (s) => s.held === null);
    await ben.click('Take in hand');
    const held = await ben.until('the scalpel in hand again', (s) => s.held === 0);
    assert.equal(line(held, 'the server was silent for')?.count ?? 0, silences, 'the gateway has spoken, not the server');
    const elsewhere = words.map((word) => (word === session.out ? join(word, 'other') : word));
    const other = spawn(program, elsewhere, { stdio: 'ignore' });
    await ben.until('the word of it', (s) => equal(s) && s.cuts === 0 && s.held === 0 &&
      line(s, 'a server has gone, and another has begun in its place'));
    other.kill('SIGKILL');
    process.kill(server, 'SIGCONT');
  });
} finally {
  link.close();
  await browser.close();
}
await session.end();
session.forget();
