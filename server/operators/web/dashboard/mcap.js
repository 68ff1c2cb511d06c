// What the stream tells, as an MCAP file (https://mcap.dev/spec): in chunks, not compressed, with an index.
//
//   const file = new McapFile();
//   file.add(channel, nanoseconds, payload);   // a channel of the stream, and a message of it
//   const blob = file.end();

const MAGIC = new Uint8Array([0x89, 0x4D, 0x43, 0x41, 0x50, 0x30, 0x0D, 0x0A]);
const OP = {header: 1, footer: 2, schema: 3, channel: 4, message: 5, chunk: 6, messageIndex: 7, chunkIndex: 8, statistics: 11, dataEnd: 15};
const CHUNK_BYTES = 1 << 20;
const utf8 = new TextEncoder();

const u16 = (x) => new Uint8Array([x & 255, x >> 8]);
const u32 = (x) => new Uint8Array(new Uint32Array([x]).buffer);
const u64 = (x) => new Uint8Array(new BigUint64Array([BigInt(x)]).buffer);
const text = (it) => sized(utf8.encode(it));
const sizeOf = (parts) => parts.reduce((sum, it) => sum + it.length, 0);

/** Parts with their length before them. */
function sized(...parts) { return join([u32(sizeOf(parts)), ...parts]); }

function join(parts) {
  const all = new Uint8Array(sizeOf(parts));
  let at = 0;
  for (const it of parts) {
    all.set(it, at);
    at += it.length;
  }
  return all;
}

const record = (op, ...parts) => join([new Uint8Array([op]), u64(sizeOf(parts)), ...parts]);

/** The bytes of a channel's schema, which the stream sends as text: of protobuf in base64. */
const schemaOf = ({schema, schemaEncoding}) =>
  (schemaEncoding === 'protobuf' ? Uint8Array.from(atob(schema), (it) => it.charCodeAt(0)) : utf8.encode(schema));

export class McapFile {
  constructor() {
    this.parts = [];          // of the file
    this.bytes = 0;
    this.channels = new Map();   // topic -> {id, count}
    this.definitions = [];    // records of schemas and channels: in their first chunk and at the end
    this.indexes = [];        // records of the chunks
    this.begin = null;
    this.last = 0n;
    this.newChunk();
    this.write(MAGIC, record(OP.header, text(''), text('pheromone dashboard')));
  }

  get count() { return [...this.channels.values()].reduce((sum, it) => sum + it.count, 0); }

  newChunk() {
    this.chunk = {parts: [], bytes: 0, begin: null, last: 0n, index: new Map()};
  }

  write(...parts) {
    this.parts.push(...parts);
    this.bytes += sizeOf(parts);
  }

  add(channel, time, payload) {
    const {id, sequence} = this.numbersOf(channel);
    const {chunk} = this;
    if (!chunk.index.has(id)) chunk.index.set(id, []);
    chunk.index.get(id).push([time, chunk.bytes]);
    chunk.begin = chunk.begin === null || time < chunk.begin ? time : chunk.begin;
    chunk.last = time > chunk.last ? time : chunk.last;
    this.inChunk(record(OP.message, u16(id), u32(sequence), u64(time), u64(time), payload));
    if (chunk.bytes >= CHUNK_BYTES) this.endChunk();
  }

  // Of a channel's next message.
  numbersOf(channel) {
    let it = this.channels.get(channel.topic);
    if (!it) {
      it = {id: this.channels.size + 1, count: 0};   // its schema has the same number; 0 is none
      this.channels.set(channel.topic, it);
      const schema = record(OP.schema, u16(it.id), text(channel.schemaName), text(channel.schemaEncoding ?? 'jsonschema'), sized(schemaOf(channel)));
      const definition = record(OP.channel, u16(it.id), u16(it.id), text(channel.topic), text(channel.encoding), u32(0));
      this.definitions.push(schema, definition);
      this.inChunk(schema);
      this.inChunk(definition);
    }
    it.count += 1;
    return {id: it.id, sequence: it.count};
  }

  inChunk(bytes) {
    this.chunk.parts.push(bytes);
    this.chunk.bytes += bytes.length;
  }

  endChunk() {
    const {parts, bytes, begin, last, index} = this.chunk;
    if (begin === null) return;
    const start = this.bytes;
    const times = [u64(begin), u64(last)];
    const chunk = record(OP.chunk, ...times, u64(bytes), u32(0), text(''), u64(bytes), ...parts);
    this.write(chunk);
    const offsets = [];
    const indexStart = this.bytes;
    for (const [id, messages] of index) {
      messages.sort(([a], [b]) => (a < b ? -1 : a > b ? 1 : 0));   // a replay may have gone back
      offsets.push(u16(id), u64(this.bytes));
      this.write(record(OP.messageIndex, u16(id), sized(...messages.flatMap(([time, at]) => [u64(time), u64(at)]))));
    }
    this.indexes.push(record(OP.chunkIndex, ...times, u64(start), u64(chunk.length), sized(...offsets), u64(this.bytes - indexStart), text(''), u64(bytes), u64(bytes)));
    this.begin = this.begin === null || begin < this.begin ? begin : this.begin;
    this.last = last > this.last ? last : this.last;
    this.newChunk();
  }

  end() {
    this.endChunk();
    this.write(record(OP.dataEnd, u32(0)));
    const summary = this.bytes;
    const counts = [...this.channels.values()].flatMap(({id, count}) => [u16(id), u64(count)]);
    this.write(...this.definitions,
      record(OP.statistics, u64(this.count), u16(this.channels.size), u32(this.channels.size), u32(0), u32(0), u32(this.indexes.length), u64(this.begin ?? 0), u64(this.last), sized(...counts)),
      ...this.indexes);
    this.write(record(OP.footer, u64(summary), u64(0), u32(0)), MAGIC);
    return new Blob(this.parts, {type: 'application/octet-stream'});
  }
}
