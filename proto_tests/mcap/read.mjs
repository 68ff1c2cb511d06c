// Reads an MCAP file with Foxglove's own library, with all checksums checked, from the beginning to
// the end and by its index, and prints what both found, as JSON: read.mjs FILE
// Of messages of ROS 2, the last of each topic.
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const bytes = await readFile(process.argv[2]);
const streamed = {};
const topics = new Map();
const stream = new McapStreamReader({ validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Channel") {
    topics.set(record.id, record.topic);
  } else if (record.type === "Message") {
    const topic = topics.get(record.channelId);
    streamed[topic] = (streamed[topic] ?? 0) + 1;
  }
}
if (!stream.done()) {
  throw new Error("the file has no end");
}

const file = await open(process.argv[2]);
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const buffer = new Uint8Array(Number(size));
      await file.read(buffer, 0, Number(size), Number(offset));
      return buffer;
    },
  },
});
const indexed = {};
const schemas = {};
const readers = new Map();
const decoded = {};
let last = 0n;
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  indexed[channel.topic] = (indexed[channel.topic] ?? 0) + 1;
  const schema = reader.schemasById.get(channel.schemaId);
  schemas[channel.topic] = schema?.name ?? "";
  if (schema?.encoding === "ros2msg") {
    if (!readers.has(schema.id)) {
      const definition = new TextDecoder().decode(schema.data);
      readers.set(schema.id, new MessageReader(parse(definition, { ros2: true })));
    }
    decoded[channel.topic] = readers.get(schema.id).readMessage(message.data);
  }
  if (message.logTime < last) {
    throw new Error("messages are not in the order of their times");
  }
  last = message.logTime;
}
await file.close();
// Arrays of numbers are typed arrays, which JSON writes as objects.
const plain = (_, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
console.log(JSON.stringify({ streamed, indexed, schemas, decoded,
                             statistics: Number(reader.statistics.messageCount) }, plain));
