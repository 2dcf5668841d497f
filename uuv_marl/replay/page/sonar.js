/** What one vehicle detects: arrays and sub-sectors, the nearest in each, echoes, and its action. */

const QUARTER = Math.PI / 2;

/** The sub-sectors of a suite in the order of the recorded arrays: {array, from, to} with angles from the bow [rad]. */
export function subSectors(sonar) {
  return sonar.flatMap((array) =>
    array.bounds_rad.slice(1).map((to, k) => ({ array, from: array.bounds_rad[k], to })),
  );
}

/**
 * What an inspected vehicle detects at a sample, one entry for each sub-sector:
 * {array, from, to, detected: vehicle or -1, distance [m], echo: range [m], echoAt: [ahead, starboard] [m]}, NaN: none.
 */
export function detections(episode, inspected, sample) {
  const at = sample * episode.inspected.length + inspected;
  const sectors = subSectors(episode.sonar);
  const active = sectors.filter((sector) => sector.array.active);
  const row = (name, width) => episode.values(name)?.subarray(at * width, (at + 1) * width) ?? null;
  const detected = row("detected_index", sectors.length);
  const neighbour = row("neighbour", 2 * sectors.length);
  const ranges = row("echo_range", active.length);
  const echoes = row("echo_position", 2 * active.length);
  return sectors.map((sector, k) => {
    const j = active.indexOf(sector);
    return {
      ...sector,
      detected: detected[k],
      distance: Math.hypot(neighbour[2 * k], neighbour[2 * k + 1]),
      echo: j < 0 ? NaN : ranges[j],
      echoAt: j < 0 ? null : [echoes[2 * j], echoes[2 * j + 1]],
    };
  });
}

/** Draw what the inspected vehicle of this rank detects at a sample. */
export function drawSonar(context, episode, inspected, sample, poses, view, palette) {
  const vehicle = episode.inspected[inspected];
  if (episode.isLost(vehicle, sample)) return;
  const own = { x: view.x(poses[3 * vehicle + 1]), y: view.y(poses[3 * vehicle]), heading: poses[3 * vehicle + 2] };
  const sectors = detections(episode, inspected, sample);
  drawArrays(context, own, sectors, view, palette);
  drawDetected(context, own, sectors, poses, view, palette);
  drawEchoes(context, own, sectors, view, palette);
  drawForce(context, own, episode, inspected, sample, palette);
}

/** Begin a path around a sub-sector out to a radius [px]. */
function fan(context, own, sector, radius) {
  context.beginPath();
  context.moveTo(own.x, own.y);
  context.arc(own.x, own.y, radius, own.heading + sector.from - QUARTER, own.heading + sector.to - QUARTER);
  context.closePath();
}

/** Every sub-sector out to its array's range, and filled as far as the nearest vehicle that it detects. */
function drawArrays(context, own, sectors, view, palette) {
  context.lineWidth = 1;
  for (const sector of sectors) {
    const colour = sector.array.active ? palette.active : palette.passive;
    fan(context, own, sector, sector.array.range_m * view.scale);
    context.strokeStyle = context.fillStyle = colour;
    context.globalAlpha = sector.array.active ? 0.07 : 0.03;
    context.fill();
    context.globalAlpha = sector.array.active ? 0.3 : 0.15;
    context.stroke();
    if (sector.detected >= 0) {
      fan(context, own, sector, sector.distance * view.scale);
      context.globalAlpha = 0.2;
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

function drawDetected(context, own, sectors, poses, view, palette) {
  context.beginPath();
  for (const { detected } of sectors.filter((sector) => sector.detected >= 0)) {
    context.moveTo(own.x, own.y);
    context.lineTo(view.x(poses[3 * detected + 1]), view.y(poses[3 * detected]));
  }
  context.lineWidth = 1.5;
  context.strokeStyle = palette.detected;
  context.stroke();
}

/** An arc at the range that an echo reports, a dot at the position that it reports. */
function drawEchoes(context, own, sectors, view, palette) {
  context.strokeStyle = context.fillStyle = palette.echo;
  context.lineWidth = 4;
  const [cos, sin] = [Math.cos(own.heading), Math.sin(own.heading)];
  for (const { from, to, echo, echoAt } of sectors.filter((sector) => sector.echo > 0)) {
    context.beginPath();
    context.arc(own.x, own.y, echo * view.scale, own.heading + from - QUARTER, own.heading + to - QUARTER);
    context.stroke();
    const [north, east] = [cos * echoAt[0] - sin * echoAt[1], sin * echoAt[0] + cos * echoAt[1]];
    context.beginPath();
    context.arc(own.x + east * view.scale, own.y - north * view.scale, 3.5, 0, 4 * QUARTER);
    context.fill();
  }
}

/** The policy's action, 60 px for full force. */
function drawForce(context, own, episode, inspected, sample, palette) {
  const action = episode.values("action");
  const at = 2 * (sample * episode.inspected.length + inspected);
  if (!action || !Number.isFinite(action[at])) return;
  const [ahead, starboard] = [action[at], action[at + 1]];
  const length = 60 * Math.hypot(ahead, starboard);
  const bearing = own.heading + Math.atan2(starboard, ahead);
  if (length < 3) return;
  const tip = { x: own.x + length * Math.sin(bearing), y: own.y - length * Math.cos(bearing) };
  context.strokeStyle = context.fillStyle = palette.force;
  context.lineWidth = 3;
  context.beginPath();
  context.moveTo(own.x, own.y);
  context.lineTo(tip.x, tip.y);
  context.stroke();
  context.beginPath();
  for (const [along, aside] of [[9, 0], [-2, 6], [-2, -6]]) {
    context.lineTo(
      tip.x + along * Math.sin(bearing) + aside * Math.cos(bearing),
      tip.y - along * Math.cos(bearing) + aside * Math.sin(bearing),
    );
  }
  context.fill();
}
