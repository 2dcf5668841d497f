/** Where the pictures look: one zoom and one way of following for all episodes, so that they can be compared. */
export const FOLLOW = ["swarm", "vehicle", "map"];

export class Camera {
  constructor(episodes) {
    this.extent = bounds(episodes);
    const widest = Math.max(...episodes.map(swarmWidth));
    const whole = Math.max(this.extent.high[0] - this.extent.low[0], this.extent.high[1] - this.extent.low[1]);
    this.width = Math.min(Math.max(1.6 * widest, 40), whole);
    this.look("swarm");
  }

  /** Follow the swarm's centre, the selected vehicle, or nothing: then the whole map is shown. */
  look(follow) {
    this.follow = follow;
    this.zoom = 1;
    this.away = [0, 0];
  }

  /** How an episode is seen now, on a picture of this size [px]; `poses` as of `Episode.poses`. */
  view(episode, time, poses, selected, width, height) {
    const { low, high } = this.extent;
    const fit = Math.min((height - 50) / (high[0] - low[0]), width / (high[1] - low[1]));
    const close = Math.min(width, height) / (this.follow === "vehicle" ? 0.7 * this.width : this.width);
    let at = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    if (this.follow === "swarm") at = episode.centre(time, poses);
    if (this.follow === "vehicle") at = [poses[3 * selected], poses[3 * selected + 1]];
    const scale = this.zoom * (this.follow === "map" ? fit : close);
    return new View(at[0] + this.away[0], at[1] + this.away[1], scale, width, height);
  }

  /** Shift the picture by so many pixels. */
  pan(right, down, view) {
    this.away = [this.away[0] + down / view.scale, this.away[1] - right / view.scale];
  }

  /** Magnify, keeping what is at a pixel of the picture where it is. */
  magnify(factor, view, x = view.width / 2, y = view.height / 2) {
    const zoom = Math.min(Math.max(this.zoom * factor, 0.05), 60);
    const shift = 1 - this.zoom / zoom;
    this.zoom = zoom;
    this.pan((view.width / 2 - x) * shift, (view.height / 2 - y) * shift, view);
  }
}

/** A picture's frame: north up, east right, `scale` in pixels per metre. */
export class View {
  constructor(north, east, scale, width, height) {
    Object.assign(this, { north, east, scale, width, height });
  }

  x(east) {
    return this.width / 2 + (east - this.east) * this.scale;
  }

  y(north) {
    return this.height / 2 - (north - this.north) * this.scale;
  }
}

/** North and east between which all episodes' maps and starts lie, with a margin [m]. */
function bounds(episodes) {
  const low = [Infinity, Infinity];
  const high = [-Infinity, -Infinity];
  const hold = (north, east, radius) => {
    [north, east].forEach((value, axis) => {
      low[axis] = Math.min(low[axis], value - radius);
      high[axis] = Math.max(high[axis], value + radius);
    });
  };
  for (const episode of episodes) {
    const corners = episode.paths.flatMap((path) => path.corners);
    const discs = episode.values("obstacles");
    const start = episode.poses(0);
    for (let k = 0; k < corners.length; k += 2) hold(corners[k], corners[k + 1], 40);
    hold(corners.at(-2), corners.at(-1), episode.arrival.spread_m);
    for (let k = 0; k < discs.length; k += 3) hold(discs[k], discs[k + 1], discs[k + 2] + 20);
    for (let k = 0; k < start.length; k += 3) hold(start[k], start[k + 1], 15);
  }
  return { low, high };
}

/** Width [m] that holds nine of ten vehicles for three quarters of the episode. */
function swarmWidth(episode) {
  const radii = [];
  for (let part = 0; part <= 20; part++) {
    const time = (part / 20) * episode.end;
    const poses = episode.poses(time);
    const [north, east] = episode.centre(time, poses);
    const away = Array.from({ length: episode.vehicles }, (_, i) =>
      episode.isLost(i, episode.sampleAt(time)) ? 0 : Math.hypot(poses[3 * i] - north, poses[3 * i + 1] - east),
    );
    radii.push(away.sort((a, b) => a - b)[Math.floor(0.9 * (away.length - 1))]);
  }
  return 2 * radii.sort((a, b) => a - b)[15];
}
