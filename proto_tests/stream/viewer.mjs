// What viewers do with the stream, with their own client library: viewer.mjs URL TOKEN
// URL without a token; ends with an error if something is not as it should be.

import assert from "node:assert/strict";
import protocol from "@foxglove/ws-protocol";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";
import WebSocket from "ws";

const [url, token] = process.argv.slice(2);
const encoder = new TextEncoder();

// A connection, of which `next` gives the next event that a predicate accepts.
class Viewer {
  constructor(address, subprotocol) {
    const socket = new WebSocket(address, [subprotocol]);
    this.client = new protocol.FoxgloveClient({ ws: socket });
    this.waiting = [];
    this.kept = [];
    this.channels = new Map();
    this.client.on("error", (error) => this.take("error", error));
    for (const kind of ["serverInfo", "status", "advertiseServices", "parameterValues", "message",
      "time", "serviceCallResponse", "serviceCallFailure", "close"]) {
      this.client.on(kind, (event) => this.take(kind, event));
    }
    this.client.on("advertise", (channels) => {
      for (const channel of channels) {
        this.channels.set(channel.topic, channel);
      }
      this.take("advertise", channels);
    });
  }

  take(kind, event) {
    if (kind === "message") {  // the library's view is into a buffer of its own
      event = { ...event, data: new Uint8Array(event.data.buffer, event.data.byteOffset,
        event.data.byteLength) };
    }
    const waiter = this.waiting.findIndex((it) => it.kind === kind && it.accept(event));
    if (waiter >= 0) {
      this.waiting.splice(waiter, 1)[0].resolve(event);
    } else {
      this.kept.push({ kind, event });
    }
  }

  next(kind, accept = () => true) {
    const kept = this.kept.findIndex((it) => it.kind === kind && accept(it.event));
    if (kept >= 0) {
      return Promise.resolve(this.kept.splice(kept, 1)[0].event);
    }
    return new Promise((resolve) => this.waiting.push({ kind, accept, resolve }));
  }

  // A decoded message of a topic for which `accept` holds.
  async message(topic, accept = () => true) {
    const channel = this.channels.get(topic);
    assert.ok(channel, `no channel ${topic}`);
    channel.subscription ??= this.client.subscribe(channel.id);
    for (;;) {
      const { data } = await this.next("message",
        (it) => it.subscriptionId === channel.subscription);
      const decoded = decode(channel, data);
      if (accept(decoded)) {
        return decoded;
      }
    }
  }
}

// As Foxglove's front end does it: protobuf by the schema that came with the channel.
function decode(channel, data) {
  if (channel.encoding === "json") {
    assert.equal(JSON.parse(channel.schema).type, "object");
    return JSON.parse(new TextDecoder().decode(data));
  }
  if (channel.encoding === "protobuf") {
    const set = protobuf.Root.fromDescriptor(
      protobufDescriptor().FileDescriptorSet.decode(Buffer.from(channel.schema, "base64")));
    set.resolveAll();
    return set.lookupType(channel.schemaName).toObject(
      set.lookupType(channel.schemaName).decode(data), { defaults: true, arrays: true });
  }
  return data;
}
function protobufDescriptor() {
  return protobuf.descriptor;
}

async function look(subprotocol) {
  const viewer = new Viewer(url, subprotocol);
  const info = await viewer.next("serverInfo");
  assert.equal(info.metadata.ROS_DISTRO, "humble");
  await viewer.next("advertise");
  const grid = await viewer.message("/pheromone/trail");
  assert.equal(grid.frame_id ?? grid.frameId, "map");
  assert.equal(grid.data.length % (grid.column_count ?? grid.columnCount), 0);
  assert.ok((await viewer.message("/tf")).transforms.length >= 1);
  assert.ok(Array.isArray((await viewer.message("/robots")).entities));
  assert.equal((await viewer.message("/status")).health.healthy, true);
  await viewer.next("time");
  // Nothing may be changed.
  const services = await viewer.next("advertiseServices");
  const erase = services.find((it) => it.name === "/erase");
  viewer.client.sendServiceCallRequest({ serviceId: erase.id, callId: 1, encoding: "json",
    data: encoder.encode('{"pheromone":"trail","all":true}') });
  assert.match((await viewer.next("serviceCallFailure")).message, /ticket/);
  viewer.client.close();
  await viewer.next("close");
}

async function ticket() {
  const response = await fetch(`${url.replace(/^ws/, "http")}api/v1/ticket`,
    { method: "POST", headers: { Authorization: `Bearer ${token}` }, body: "{}" });
  return (await response.json()).ticket;
}

async function paint() {
  const viewer = new Viewer(`${url}?ticket=${await ticket()}`, "foxglove.websocket.v1");
  await viewer.next("advertise");
  const empty = await viewer.message("/pheromone/trail");
  assert.ok(empty.data.every((it) => it === 0 || it === 255));
  const brush = viewer.client.advertise(
    { topic: "/brush", encoding: "json", schemaName: "pheromone.brush" });
  viewer.client.sendMessage(brush, encoder.encode(JSON.stringify(
    { pheromone: "trail", x_m: 5, y_m: 5, radius_m: 0.5, units: 1 })));
  await viewer.message("/pheromone/trail", (it) => it.data.some((cell) => cell === 254));
  const services = await viewer.next("advertiseServices");
  const erase = services.find((it) => it.name === "/erase");
  viewer.client.sendServiceCallRequest({ serviceId: erase.id, callId: 2, encoding: "json",
    data: encoder.encode('{"pheromone":"trail","all":true}') });
  const done = await viewer.next("serviceCallResponse");
  assert.equal(JSON.parse(new TextDecoder().decode(done.data)).done, true);
  await viewer.message("/pheromone/trail", (it) => !it.data.some((cell) => cell === 254));
  const click = viewer.client.advertise(
    { topic: "/clicked_point", encoding: "json", schemaName: "geometry_msgs/PointStamped" });
  viewer.client.sendMessage(click, encoder.encode(JSON.stringify(
    { header: { frame_id: "map" }, point: { x: 2, y: 3, z: 0 } })));
  await viewer.message("/pheromone/trail", (it) => it.data.some((cell) => cell > 0 && cell < 255));
  viewer.client.getParameters(["/pheromone/trail/tau_s"], "p");
  const { parameters } = await viewer.next("parameterValues", (it) => it.id === "p");
  assert.equal(parameters[0].value, 30);
  viewer.client.close();
  await viewer.next("close");
}

// Records a stroke of the brush; the name of the recording.
async function record() {
  const viewer = new Viewer(`${url}?ticket=${await ticket()}`, "foxglove.websocket.v1");
  await viewer.next("advertise");
  const services = await viewer.next("advertiseServices");
  const call = (name, body) => {
    viewer.client.sendServiceCallRequest({ serviceId: services.find((it) => it.name === name).id,
      callId: 1, encoding: "json", data: encoder.encode(JSON.stringify(body)) });
    return viewer.next("serviceCallResponse");
  };
  await call("/erase", { pheromone: "trail", all: true });
  await call("/capture", { action: "start" });
  await call("/deposit", { pheromone: "trail", points_m: [[5, 5]], radius_m: 0.5, units: 1 });
  await call("/capture", { action: "stop" });
  viewer.client.close();
  await viewer.next("close");
  const answer = await fetch(`${url.replace(/^ws/, "http")}api/v1/captures`);
  return (await answer.json()).captures.at(-1).name;
}

async function replay(name) {
  const viewer = new Viewer(`${url}replay/${name}`, "foxglove.websocket.v1");
  const info = await viewer.next("serverInfo");
  assert.ok(info.capabilities.includes("playbackControl"));
  assert.ok(!info.capabilities.includes("services") && !info.capabilities.includes("clientPublish"));
  const ns = ({ sec, nsec }) => BigInt(sec) * 1000000000n + BigInt(nsec);
  const [begin, end] = [ns(info.dataStartTime), ns(info.dataEndTime)];
  assert.ok(begin < end && end <= BigInt(Date.now() + 1) * 1000000n);
  await viewer.next("advertise");
  await viewer.message("/pheromone/trail", (it) => it.data.some((cell) => cell === 254));
  const { timestamp } = await viewer.next("time");
  assert.ok(timestamp >= begin && timestamp <= end, `${timestamp} is not of the recording`);
  viewer.client.close();
  await viewer.next("close");
  await seek(name, begin);
}

// The library does not know playbackControl: a request to pause at the beginning, and its answer.
async function seek(name, begin) {
  const socket = new WebSocket(`${url}replay/${name}`, ["foxglove.sdk.v1"]);
  const messages = [];
  let arrived = () => {};
  socket.on("message", (data, isBinary) => {
    if (isBinary && data[0] === 5) {
      messages.push(data);
      arrived();
    }
  });
  await new Promise((resolve) => socket.once("message", resolve));  // greeted
  const request = Buffer.alloc(21);
  request.writeUInt8(3, 0);
  request.writeUInt8(1, 1);
  request.writeFloatLE(2, 2);
  request.writeUInt8(1, 6);
  request.writeBigUInt64LE(begin, 7);
  request.writeUInt32LE(2, 15);
  request.write("me", 19);
  socket.send(request);
  const next = async (accept) => {
    while (!messages.some(accept)) {
      await new Promise((resolve) => { arrived = resolve; });
    }
    return messages.find(accept);
  };
  const answer = await next((it) => it.subarray(19).toString() === "me");
  assert.deepEqual([answer[1], answer.readBigUInt64LE(2), answer.readFloatLE(10), answer[14]],
    [2, begin, 2, 1]);  // buffering
  await next((it) => it[1] === 1 && it.readBigUInt64LE(2) === begin && it.length === 19);
  socket.close();
}

await look("foxglove.websocket.v1");
await look("foxglove.sdk.v1");
await paint();
await replay(await record());
console.log("the viewers' library shows the map, its strokes are on it, and a recording of them");
process.exit(0);
