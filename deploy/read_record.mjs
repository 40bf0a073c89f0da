// Reads a record of a session (sim_server --record) with the libraries of others, and counts its messages by topic:
//   npm install @mcap/core @mcap/support @foxglove/omgidl-parser @foxglove/omgidl-serialization
//   node deploy/read_record.mjs FILE.mcap
import { open } from "fs/promises";
import { createRequire } from "module";
import { pathToFileURL } from "url";

// The libraries are those of the folder in which this is called.
const here = createRequire(process.cwd() + "/");
const library = (name) => import(pathToFileURL(here.resolve(name)).href);
const { McapIndexedReader } = await library("@mcap/core");
const { loadDecompressHandlers } = await library("@mcap/support");
const { parseIDL } = await library("@foxglove/omgidl-parser");
const { MessageReader } = await library("@foxglove/omgidl-serialization");

const file = await open(process.argv[2]);
const size = (await file.stat()).size;
const readable = {
  size: async () => BigInt(size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, Number(length), Number(offset));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: await loadDecompressHandlers() });
const readers = {}, counts = {}, last = {};
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  readers[channel.topic] ??= new MessageReader(schema.name, parseIDL(new TextDecoder().decode(schema.data)));
  last[channel.topic] = readers[channel.topic].readMessage(message.data);
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
}
console.log(counts);
const end = last.session_end;
if (end) console.log(`ended at step ${end.step}: ${end.reason}`);
for (const body of end?.bodies ?? [])
  console.log(`revision ${body.revision}, topology hash ${body.topology_hash.toString(16).padStart(16, "0")}`);
