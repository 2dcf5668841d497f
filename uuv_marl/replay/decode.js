// Episodes back from the payload of uuv_marl/replay/encode.py: arrays in SI units, NaN where a number is missing.

/** Episodes with `arrays.NAME = {shape, data}`, where data is a Float32Array or, of whole numbers, an Int32Array. */
export async function decodeEpisodes(payload) {
  if (payload.schema !== 1) throw new Error(`the page reads schema 1, and its episodes have ${payload.schema}`);
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

async function decodeArray({ shape, dtype, scale, stride, order, missing, data }) {
  const [rows, ...rest] = shape;
  const columns = rest.reduce((product, size) => product * size, 1);
  const whole = integers(await inflate(data), rows, columns, stride, order);
  if (dtype === "int32") return { shape, data: whole };
  if (scale === null) return { shape, data: new Float32Array(whole.buffer) };
  const values = new Float32Array(whole.length);
  for (let k = 0; k < values.length; k++) values[k] = whole[k] * scale;
  if (missing !== null) {
    integers(await inflate(missing), rows, columns, 1, 1).forEach((gone, k) => { if (gone) values[k] = NaN; });
  }
  return { shape, data: values };
}

/** The bytes that were packed as text: deflated, in base64. */
export async function inflate(text) {
  const letters = atob(text);
  const packed = new Uint8Array(letters.length);
  for (let k = 0; k < packed.length; k++) packed[k] = letters.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers, time by time, from their differences: column by column, every stride-th row first. */
function integers(bytes, rows, columns, stride, order) {
  const differences = signed(bytes, rows * columns);
  const whole = new Int32Array(rows * columns);
  const column = new Int32Array(rows);
  for (let c = 0; c < columns; c++) {
    const sums = [0, 0, 0];
    const coarse = Math.ceil(rows / stride);
    for (let row = 0, k = c * coarse; row < rows; row += stride) {
      sums[order] = differences[k++];
      for (let j = order; j > 0; j--) sums[j - 1] = (sums[j - 1] + sums[j]) | 0;
      column[row] = sums[0];
    }
    let begin = coarse * columns;
    for (let half = stride >> 1; half > 0; half >>= 1) {
      const finer = Math.max(0, Math.ceil((rows - half) / (2 * half)));
      for (let row = half, k = begin + c * finer; row < rows; row += 2 * half) {
        column[row] = between(column, row, half) + differences[k++];
      }
      begin += finer * columns;
    }
    for (let row = 0; row < rows; row++) whole[row * columns + c] = column[row];
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

/** What the samples of a column before and after a row say of it. */
function between(column, row, half) {
  const before = column[row - half];
  const after = column[row + half];
  if (row + half >= column.length) return before;
  if (row < 3 * half || row + 3 * half >= column.length) return (before + after) >> 1;
  return (9 * (before + after) - column[row - 3 * half] - column[row + 3 * half] + 8) >> 4;
}
