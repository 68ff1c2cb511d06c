// The little of protobuf that the page reads: foxglove.Log, as the channel /events carries it.

const decoder = new TextDecoder();
const LEVELS = ['unknown', 'debug', 'info', 'warning', 'error', 'fatal'];

function* fieldsOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  const varint = () => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const byte = view.getUint8(at);
      at += 1;
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.byteLength) {
    const key = varint();
    const wire = key & 7;
    let value = null;
    if (wire === 0) {
      value = varint();
    } else if (wire === 2) {
      const length = varint();
      value = bytes.subarray(at, at + length);
      at += length;
    } else if (wire === 1 || wire === 5) {
      at += wire === 1 ? 8 : 4;
    } else {
      throw new Error(`protobuf: wire type ${wire}`);
    }
    yield [Math.floor(key / 8), value];
  }
}

/** {timeMs, level, text, name} */
export function decodeLog(bytes) {
  const log = {timeMs: 0, level: 'info', text: '', name: ''};
  for (const [field, value] of fieldsOf(bytes)) {
    if (field === 1) {
      for (const [part, n] of fieldsOf(value)) log.timeMs += part === 1 ? n * 1000 : n / 1e6;
    } else if (field === 2) {
      log.level = LEVELS[value] ?? 'unknown';
    } else if (field === 3) {
      log.text = decoder.decode(value);
    } else if (field === 4) {
      log.name = decoder.decode(value);
    }
  }
  return log;
}
