const TYPES = { float32: Float32Array, int8: Int8Array, uint8: Uint8Array, uint32: Uint32Array };

/**
 * The values and the arrays of a message.
 *
 * @param {ArrayBuffer} buffer
 * @returns {[any, Record<string, any>]}
 */
export function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const after = (/** @type {number} */ bytes) => bytes + ((4 - (bytes % 4)) % 4);
  /** @type {Record<string, any>} */
  const found = {};
  let place = 4 + after(length);
  for (const { name, type, length: count } of head.arrays) {
    found[name] = new TYPES[/** @type {keyof typeof TYPES} */ (type)](buffer, place, count);
    place += after(found[name].byteLength);
  }
  return [head, found];
}
