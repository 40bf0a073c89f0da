// A way to the gateway that a test holds in its hand: it stands still, goes on, breaks and is mended.
import { connect, createServer } from 'node:net';

export class Link {
  #pairs = new Set(); #stands = false; #broken = false; #server;

  // From an address of a session, with another port.
  static async to(address) {
    const link = new Link(), { port, hash } = new URL(address);
    link.#server = createServer((near) => link.#join(near, connect(Number(port), '127.0.0.1')));
    await new Promise((done) => link.#server.listen(0, '127.0.0.1', done));
    link.address = `http://127.0.0.1:${link.#server.address().port}/${hash}`;
    return link;
  }

  #join(near, far) {
    const pair = [near, far];
    this.#pairs.add(pair);
    for (const end of pair) {
      end.on('error', () => {});
      end.on('close', () => {
        this.#pairs.delete(pair);
        pair.forEach((other) => other.destroy());
      });
    }
    if (this.#broken) near.destroy();
    else if (!this.#stands) this.#pipe(pair);
  }
  #pipe([near, far]) {
    near.pipe(far);
    far.pipe(near);
  }

  stop() {
    this.#stands = true;
    for (const end of [...this.#pairs].flat()) end.unpipe();
  }
  go_on() {
    this.#stands = false;
    for (const pair of this.#pairs) this.#pipe(pair);
  }
  break() {
    this.#broken = true;
    for (const [near] of this.#pairs) near.destroy();
  }
  mend() { this.#broken = false; }
  close() {
    this.break();
    this.#server.close();
  }
}
