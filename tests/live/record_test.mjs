// A record of a session, read by deploy/read_record.mjs with the libraries of others.
// usage: node tests/live/record_test.mjs
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { check, root } from './session.mjs';

const STEPS = 1500;
const builds = resolve(root, process.env.SECTIO_BUILD_DIR ?? 'build'), npm = join(builds, 'npm');
if (!existsSync(join(npm, 'node_modules/@mcap/core'))) throw new Error(`${npm} lacks @mcap/core: ./deploy/test --live installs it`);

const out = mkdtempSync(join(tmpdir(), 'sectio_record_')), record = join(out, 'a.mcap');
const server = (...args) => execFileSync(join(builds, 'release/bin/sim_server'), args, { stdio: ['ignore', 'pipe', 'inherit'] });
const read = (file) => spawnSync('node', [join(root, 'deploy/read_record.mjs'), file], { cwd: npm, encoding: 'utf8' });
try {
  server('--scene', join(root, 'deploy/scenes/liver_incision.yaml'), '--session', `record-${process.pid}`, '--play-traces',
    '--steps', STEPS, '--record', record, '--export', join(out, 'export'));
  const report = JSON.parse(readFileSync(join(out, 'export/report.json')));

  await check('libraries of others read every message of a record', () => {
    const { status, stdout, stderr } = read(record);
    assert.equal(status, 0, stderr);
    const count = (topic) => Number(stdout.match(new RegExp(`\\b${topic}: (\\d+)`))?.[1] ?? 0);
    assert.equal(count('step_inputs'), STEPS, stdout);
    assert.equal(count('session_end'), 1, stdout);
    for (const topic of ['scene', 'keyframes', 'topology_deltas', 'state_headers', 'state_pieces'])
      assert.ok(count(topic) > 0, `${topic} in ${stdout}`);
  });

  await check('they find the topology with which the server ended', () => {
    const { stdout } = read(record);
    assert.match(stdout, /^ended at step \d+: complete$/m);
    for (const { revision, topology_hash } of report.bodies) {
      assert.ok(revision > 0, 'something was cut');
      assert.ok(stdout.includes(`revision ${revision}, topology hash ${topology_hash}\n`), `${topology_hash} in ${stdout}`);
    }
  });
} finally {
  rmSync(out, { recursive: true });
}
