// Episodes back from the payload of uuv_marl/replay/encode.py: arrays in SI units, NaN where a number is missing.

/** The integer that stands for NaN. */
const MISSING = -(2 ** 31);

/** Episodes with `arrays.NAME = {shape, data}`, where data is a Float32Array or, of whole numbers, an Int32Array. */
export async function decodeEpisodes(payload) {
  if (payload.schema !== 2) throw new Error(`the page reads schema 2, and its episodes have ${payload.schema}`);
  return Promise.all(payload.episodes.map(decodeEpisode));
}

async function decodeEpisode(episode) {
  const decoded = await Promise.all(Object.values(episode.arrays).map(decodeArray));
  const arrays = Object.fromEntries(Object.keys(episode.arrays).map((name, k) => [name, decoded[k]]));
  refine(arrays.heading, arrays.inspected_heading, episode.inspected);
  delete arrays.inspected_heading;
  return { ...episode, arrays };
}

/** Headings of inspected vehicles are known more finely. */
function refine(heading, fine, inspected) {
  if (!fine) return;
  const [times, vehicles] = heading.shape;
  for (let t = 0; t < times; t++) {
    inspected.forEach((vehicle, k) => { heading.data[t * vehicles + vehicle] = fine.data[t * inspected.length + k]; });
  }
}

async function decodeArray({ shape, dtype, unit, data }) {
  const whole = integers(await inflate(data), shape);
  if (dtype === "int32") return { shape, data: whole };
  if (unit === null) return { shape, data: new Float32Array(whole.buffer) };
  return { shape, data: Float32Array.from(whole, (value) => (value === MISSING ? NaN : value * unit)) };
}

/** The bytes that were packed as text: deflated, in base64. */
export async function inflate(text) {
  const letters = atob(text);
  const packed = new Uint8Array(letters.length);
  for (let k = 0; k < packed.length; k++) packed[k] = letters.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers, time by time, from their differences in time, column by column. */
function integers(bytes, [rows, ...rest]) {
  const columns = rest.reduce((product, size) => product * size, 1);
  const differences = signed(bytes, rows * columns);
  const whole = new Int32Array(rows * columns);
  for (let column = 0, k = 0; column < columns; column++) {
    for (let row = 0, sum = 0; row < rows; row++) {
      sum = (sum + differences[k++]) | 0;
      whole[row * columns + column] = sum;
    }
  }
  return whole;
}

/** The signed numbers, of which the lowest bytes come first, then the next ones. */
function signed(bytes, count) {
  const numbers = new Int32Array(count);
  for (let shift = 0, first = 0; first < bytes.length; shift += 8, first += count) {
    for (let k = 0; k < count; k++) numbers[k] |= bytes[first + k] << shift;
  }
  for (let k = 0; k < count; k++) numbers[k] = (numbers[k] >>> 1) ^ -(numbers[k] & 1);
  return numbers;
}
