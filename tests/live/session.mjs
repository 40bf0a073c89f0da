// A session as deploy/live starts it, and what tests of it share.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { until } from './browser.mjs';

export const root = join(import.meta.dirname ?? new URL('.', import.meta.url).pathname, '../..');

export async function check(what, body) {
  const begun = Date.now();
  await body();
  console.log(`ok: ${what} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
}

// Infinite from a place that there isn't, as of an instrument that is away.
export const apart = (a, b) => (a && b ? Math.hypot(...a.map((x, i) => x - b[i])) : Infinity);
export const equal = (state) => state.bodies.length > 0 && state.bodies.every((b) => b.equal === true);

export class Session {
  #live; #said = ''; #exit_code = null;

  // With the token "theatre".
  static begin(...args) { return Session.begin_in(mkdtempSync(join(tmpdir(), 'sectio_live_')), ...args); }

  static async begin_in(out, ...args) {
    const session = new Session();
    session.out = out;
    session.#live = spawn(join(root, 'deploy/live'), [...args, '--token', 'theatre'],
      { env: { ...process.env, SECTIO_OUT_DIR: session.out }, stdio: ['ignore', 'pipe', 'inherit'] });
    session.#live.stdout.on('data', (text) => { session.#said += text; });
    session.#live.on('exit', (code) => { session.#exit_code = code; });
    process.on('exit', () => session.#live.kill());
    const address = () => session.#said.match(/^http:\S+$/m)?.[0];
    session.address = await until('the address', () => address() ?? (session.#exit_code !== null && 'ended'), 900000);
    assert.match(session.address, /^http:\/\/127\.0\.0\.1:\d+\/#theatre$/, 'one address, on this machine alone, with the token');
    session.watching = session.address.replace('#theatre', '');
    return session;
  }

  async metric(name) {
    const text = await (await fetch(this.watching + 'metrics')).text();
    return Number(text.match(new RegExp(`^sectio_gateway_${name} (\\d+)$`, 'm'))[1]);
  }

  // The processes of this session; of one program, if it is named.
  processes(program = '') {
    return readdirSync('/proc').filter((pid) => /^\d+$/.test(pid)).filter((pid) => {
      try {
        const words = readFileSync(`/proc/${pid}/cmdline`, 'utf8').split('\0');
        return words.includes(`live-${this.#live.pid}`) && words[0].endsWith(program);
      } catch {
        return false;
      }
    }).map(Number);
  }

  // Ends the session by the signal of Ctrl-C.
  async end() {
    this.#live.kill('SIGINT');
    await until('the end', () => this.#exit_code !== null);
    assert.equal(this.#exit_code, 0);
    assert.deepEqual(this.processes(), []);
    return JSON.parse(readFileSync(join(this.out, 'report.json')));
  }
  forget() { rmSync(this.out, { recursive: true }); }
}
