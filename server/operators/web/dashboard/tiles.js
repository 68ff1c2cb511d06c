// The message pheromone.Tiles: a map's levels in tiles of 32 x 32 cells, only those that changed.
// The format is in server/formats/foxglove/pheromone_raster.h. Levels: 0 to 254 of `scale`, 255 blocked.

const HEADER_BYTES = 42;
export const BLOCKED = 255;

// Field 1 of the protobuf message, which is all of it.
function dataOf(message) {
  let at = 1;
  while (at < 6 && message[at] >= 128) at += 1;
  if (message[0] !== 0x0A) throw new Error('tiles: not protobuf');
  return message.subarray(at + 1);
}

/** Throws if the message is not one. `tiles` are views into the message. */
export function decodeTiles(message) {
  const bytes = dataOf(message);
  if (bytes.byteLength < HEADER_BYTES) throw new Error(`tiles: ${bytes.byteLength} bytes`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (view.getUint8(0) !== 1) throw new Error(`tiles: version ${view.getUint8(0)}`);
  const side = view.getUint8(2);
  const header = {
    type: view.getUint8(1),
    side,
    full: (view.getUint8(3) & 1) !== 0,
    columns: view.getUint16(4, true),
    rows: view.getUint16(6, true),
    xM: Number(view.getBigInt64(8, true)) / 1e6,
    yM: Number(view.getBigInt64(16, true)) / 1e6,
    cellM: view.getUint32(24, true) / 1e6,
    scale: view.getFloat32(28, true),
    fieldTimeMs: Number(view.getBigUint64(32, true)),
    tiles: [],
  };
  let at = HEADER_BYTES;
  for (let left = view.getUint16(40, true); left > 0; left -= 1) {
    if (at + 4 > bytes.byteLength) throw new Error('tiles: cut off');
    const x = view.getUint16(at, true) * side;
    const y = view.getUint16(at + 2, true) * side;
    const width = Math.min(side, header.columns - x);
    const height = Math.min(side, header.rows - y);
    at += 4;
    if (width <= 0 || height <= 0 || at + width * height > bytes.byteLength) {
      throw new Error('tiles: a tile outside the map, or cut off');
    }
    header.tiles.push({x, y, width, height, levels: bytes.subarray(at, at + width * height)});
    at += width * height;
  }
  return header;
}
