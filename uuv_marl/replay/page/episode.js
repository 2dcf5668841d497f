/** An episode, and its state at any time: positions and measurements. */
export class Episode {
  /** @param decoded one of `decodeEpisodes`; its fields (policy, seed, events, arrays, ...) become this episode's. */
  constructor(decoded) {
    Object.assign(this, decoded);
    this.time = this.values("time_s");
    this.end = this.time.at(-1);
    this.hasTeams = this.team.some((team) => team > 0);
    this.lastSeen = this.#lastSeen();
    this.lowestSpacing = lowestSoFar(this.values("min_spacing_m"));
    this.lowestClearance = lowestSoFar(this.values("obstacle_clearance_m"));
  }

  /** The numbers of an array, row after row, or null where the recording lacks it. */
  values(name) {
    return this.arrays[name]?.data ?? null;
  }

  /** Index of the last sample at or before a time. */
  sampleAt(time) {
    let low = 0;
    let high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time + 1e-4) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Sample and share of the way to the next one, from 0 to below 1. */
  #between(time) {
    const sample = this.sampleAt(time);
    const next = Math.min(sample + 1, this.time.length - 1);
    const span = this.time[next] - this.time[sample];
    return [sample, next, span > 0 ? Math.min(Math.max((time - this.time[sample]) / span, 0), 1) : 0];
  }

  /** Last sample at which each vehicle was there. */
  #lastSeen() {
    const position = this.values("position");
    const seen = new Int32Array(this.vehicles);
    for (let i = 0; i < this.vehicles; i++) {
      let sample = this.time.length - 1;
      while (sample > 0 && Number.isNaN(position[2 * (sample * this.vehicles + i)])) sample--;
      seen[i] = sample;
    }
    return seen;
  }

  /** Whether a vehicle is lost at a sample. */
  isLost(vehicle, sample) {
    return sample > this.lastSeen[vehicle];
  }

  /** North, east [m] and heading [rad] of all vehicles; the lost stay where they were seen last. */
  poses(time) {
    const [sample, next, share] = this.#between(time);
    const position = this.values("position");
    const heading = this.values("heading");
    const poses = new Float32Array(3 * this.vehicles);
    for (let i = 0; i < this.vehicles; i++) {
      const a = Math.min(sample, this.lastSeen[i]) * this.vehicles + i;
      const b = Math.min(next, this.lastSeen[i]) * this.vehicles + i;
      poses[3 * i] = position[2 * a] + share * (position[2 * b] - position[2 * a]);
      poses[3 * i + 1] = position[2 * a + 1] + share * (position[2 * b + 1] - position[2 * a + 1]);
      poses[3 * i + 2] = heading[a] + share * shortWay(heading[b] - heading[a]);
    }
    return poses;
  }

  /** North and east of a path's l(t) [m]. */
  reference(time, path = 0) {
    const [sample, next, share] = this.#between(time);
    const at = this.values("reference");
    const [from, to] = [sample, next].map((k) => 2 * (k * this.paths.length + path));
    return [0, 1].map((axis) => at[from + axis] + share * (at[to + axis] - at[from + axis]));
  }

  /** Centre north, east and radius [m] of the circles that the task draws, one after the other. */
  marks(time) {
    const row = 3 * this.arrays.marks.shape[1];
    return this.values("marks").subarray(row * this.sampleAt(time), row * (this.sampleAt(time) + 1));
  }

  /** Centre north, east and radius [m] of the obstacles, one after the other. */
  discs(time) {
    const [sample, next, share] = this.#between(time);
    const discs = this.values("obstacles");
    const centre = this.values("traffic");
    const row = (2 * discs.length) / 3;
    return discs.map((value, k) => {
      if (!centre || k % 3 === 2) return value;
      const at = 2 * Math.floor(k / 3) + (k % 3);
      return centre[sample * row + at] + share * (centre[next * row + at] - centre[sample * row + at]);
    });
  }

  /** Mean north and east [m] of those that are not lost; of all of them where all are lost. */
  centre(time, poses = this.poses(time)) {
    const sample = this.sampleAt(time);
    const all = Array.from({ length: this.vehicles }, (_, i) => i);
    const living = all.filter((i) => !this.isLost(i, sample));
    const counted = living.length ? living : all;
    const mean = (axis) => counted.reduce((sum, i) => sum + poses[3 * i + axis], 0) / counted.length;
    return [mean(0), mean(1)];
  }

  /** What was measured at the sample at or before a time; null where there is nothing to measure. */
  numbers(time) {
    const sample = this.sampleAt(time);
    const number = (array) => (array && Number.isFinite(array[sample]) ? array[sample] : null);
    const arrived = this.metrics.task_time_s;
    return {
      time_s: this.time[sample],
      min_spacing_m: number(this.values("min_spacing_m")),
      obstacle_clearance_m: number(this.values("obstacle_clearance_m")),
      centre_error_m: number(this.values("centre_error_m")),
      collisions: number(this.values("collisions")),
      lowest_spacing_m: number(this.lowestSpacing),
      lowest_clearance_m: number(this.lowestClearance),
      arrived: arrived !== null && arrived <= time + 1e-4,
      lost: this.lastSeen.filter((seen) => sample > seen).length,
    };
  }
}

/** An angle [rad] by the short way, in [-pi, pi). */
export function shortWay(angle) {
  return angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));
}

function lowestSoFar(values) {
  let lowest = Infinity;
  return values && Float32Array.from(values, (value) => (lowest = value < lowest ? value : lowest));
}
