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
  const values = Float32Array.from(whole, (number) => number * scale);
  if (missing !== null) {
    integers(await inflate(missing), rows, columns, 1, 1).forEach((gone, k) => { if (gone) values[k] = NaN; });
  }
  return { shape, data: values };
}

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers, time by time, from their differences: column by column, every stride-th row first. */
function integers(bytes, rows, columns, stride, order) {
  const whole = new Int32Array(rows * columns);
  const next = reader(bytes, whole.length);
  for (let column = 0; column < columns; column++) {
    const sums = [0, 0, 0];
    for (let row = 0; row < rows; row += stride) {
      sums[order] = next();
      for (let k = order; k > 0; k--) sums[k - 1] = (sums[k - 1] + sums[k]) | 0;
      whole[row * columns + column] = sums[0];
    }
  }
  for (let half = stride >> 1; half > 0; half >>= 1) {
    for (let column = 0; column < columns; column++) {
      for (let row = half; row < rows; row += 2 * half) {
        whole[row * columns + column] = between(whole, row, column, half, rows, columns) + next();
      }
    }
  }
  return whole;
}

/** The signed numbers one by one; their lowest bytes come first, then the next ones. */
function reader(bytes, count) {
  const planes = count ? bytes.length / count : 0;
  let k = 0;
  return () => {
    let unsigned = 0;
    for (let plane = 0; plane < planes; plane++) unsigned |= bytes[plane * count + k] << (8 * plane);
    k++;
    return (unsigned >>> 1) ^ -(unsigned & 1);
  };
}

/** What samples before and after a row say of it. */
function between(whole, row, column, half, rows, columns) {
  const at = (step) => whole[(row + step * half) * columns + column];
  if (row + half >= rows) return at(-1);
  if (row < 3 * half || row + 3 * half >= rows) return (at(-1) + at(1)) >> 1;
  return (9 * (at(-1) + at(1)) - at(-3) - at(3) + 8) >> 4;
}
