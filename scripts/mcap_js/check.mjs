// Reads a log with a reader of another make and prints, as JSON, what it finds for each signal.
//
//     npm ci && node check.mjs LOG
//
// Front to back: every record and checksum, every message decoded by the schema that lies in the file.
// Through the index: the same messages again, in the order of their times, as Foxglove reads them.
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor.js";

const PIECE_BYTES = 1 << 22;
await zstd.isLoaded;
const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };

class Statistics {
  count = 0;
  nan = 0;
  min = Infinity;
  max = -Infinity;
  sum = 0;
  add(value) {
    this.count += 1;
    if (Number.isNaN(value)) {
      this.nan += 1;
      return;
    }
    if (value < this.min) this.min = value;
    if (value > this.max) this.max = value;
    this.sum += value;
  }
  toJSON() {
    const { count, nan, min, max } = this;
    return count > nan ? { count, nan, min, max, mean: this.sum / (count - nan) } : { count, nan };
  }
}

// One adder per field, made once: a log has millions of messages.
function makeSignal(field) {
  const statistics = new Statistics();
  const toNumber = (value) => (typeof value === "object" ? value.toNumber() : value);
  let each = (value) => statistics.add(toNumber(value));
  if (field.type === "string") each = (value) => statistics.add(value.length);
  if (field.type === "bytes") each = (value) => value.forEach((byte) => statistics.add(byte));
  const add = field.repeated ? (values) => values.forEach(each) : each;
  return { name: field.name, statistics, add };
}

function makeTopic(channel, schema) {
  if (schema.encoding !== "protobuf") throw new Error(`${channel.topic}: schema is ${schema.encoding}`);
  const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
  const type = root.resolveAll().lookupType(schema.name);
  return { type, messages: 0, signals: type.fieldsArray.map(makeSignal) };
}

async function frontToBack(file) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const found = { topics: {}, attachments: {}, metadata: {}, footer: false };
  const schemas = new Map();
  const channels = new Map();
  const take = {
    Schema: (record) => schemas.set(record.id, record),
    Channel: (record) => {
      if (channels.has(record.id)) return; // repeated in the summary
      const topic = makeTopic(record, schemas.get(record.schemaId));
      channels.set(record.id, topic);
      found.topics[record.topic] = topic;
    },
    Message: (record) => {
      const topic = channels.get(record.channelId);
      const message = topic.type.decode(record.data);
      topic.messages += 1;
      for (const signal of topic.signals) signal.add(message[signal.name]);
    },
    Attachment: (record) => (found.attachments[record.name] = record.data.byteLength),
    Metadata: (record) => (found.metadata[record.name] = Object.fromEntries(record.metadata)),
    Footer: () => (found.footer = true),
  };
  const piece = new Uint8Array(PIECE_BYTES);
  for (let at = 0; ; ) {
    const { bytesRead } = await file.read(piece, 0, PIECE_BYTES, at);
    if (bytesRead === 0) break;
    at += bytesRead;
    reader.append(piece.subarray(0, bytesRead));
    for (let record; (record = reader.nextRecord()); ) take[record.type]?.(record);
  }
  return found;
}

async function throughIndex(file, size) {
  const readable = {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const data = new Uint8Array(Number(length));
      await file.read(data, 0, data.length, Number(offset));
      return data;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const counts = {};
  let last = -1n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < last) throw new Error("messages are out of order");
    last = message.logTime;
    const { topic } = reader.channelsById.get(message.channelId);
    counts[topic] = (counts[topic] ?? 0) + 1;
  }
  return counts;
}

const path = process.argv[2];
if (path === undefined) {
  console.error("usage: node check.mjs LOG");
  process.exit(2);
}
const file = await open(path);
const found = await frontToBack(file);
const indexed = found.footer ? await throughIndex(file, (await file.stat()).size) : null;
await file.close();
const topics = {};
for (const [name, { messages, signals }] of Object.entries(found.topics)) {
  topics[name] = { messages, signals: Object.fromEntries(signals.map((one) => [one.name, one.statistics])) };
}
console.log(JSON.stringify({ ...found, topics, indexed }));
