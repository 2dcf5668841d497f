/** What vehicles are among: grid, paths, obstacles, scale bar, and the inset that shows all of it. */
import { View } from "./camera.js";
import { circle, label, star } from "./shapes.js";

/** Lines at round distances. */
export function drawGrid(context, view, palette) {
  const step = roundStep(120 / view.scale);
  const north = view.height / 2 / view.scale;
  const east = view.width / 2 / view.scale;
  context.beginPath();
  for (let at = Math.ceil((view.east - east) / step) * step; at < view.east + east; at += step) {
    context.moveTo(Math.round(view.x(at)) + 0.5, 0);
    context.lineTo(Math.round(view.x(at)) + 0.5, view.height);
  }
  for (let at = Math.ceil((view.north - north) / step) * step; at < view.north + north; at += step) {
    context.moveTo(0, Math.round(view.y(at)) + 0.5);
    context.lineTo(view.width, Math.round(view.y(at)) + 0.5);
  }
  context.lineWidth = 1;
  context.strokeStyle = palette.grid;
  context.stroke();
}

/** The next of 1, 2, 5, 10, 20, ... from a number. */
function roundStep(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return power * [1, 2, 5, 10].find((step) => step * power >= number * 0.999);
}

/** Each group's trajectory with start and goal, arrival radius, obstacles with their keep-out ring. */
export function drawMap(context, episode, time, view, palette, weight) {
  const discs = episode.discs(time);
  const followed = episode.paths.filter(({ corners }) => corners.length > 2);
  context.lineWidth = 1.5 * weight;
  for (const { team, corners } of followed) {
    context.strokeStyle = palette.teams[team] ?? palette.track;
    context.setLineDash([7 * weight, 6 * weight]);
    context.beginPath();
    for (let k = 0; k < corners.length; k += 2) context.lineTo(view.x(corners[k + 1]), view.y(corners[k]));
    context.stroke();
    context.setLineDash([2, 4]);
    context.beginPath();
    circle(context, view.x(corners.at(-1)), view.y(corners.at(-2)), episode.arrival.spread_m * view.scale);
    context.stroke();
  }
  context.setLineDash([]);

  context.beginPath();
  for (let k = 0; k < discs.length; k += 3) {
    circle(context, view.x(discs[k + 1]), view.y(discs[k]), discs[k + 2] * view.scale);
  }
  context.fillStyle = palette.obstacle;
  context.fill();
  context.beginPath();
  for (let k = 0; k < discs.length; k += 3) {
    const radius = discs[k + 2] + episode.constraints.s_o_m;
    circle(context, view.x(discs[k + 1]), view.y(discs[k]), radius * view.scale);
  }
  context.setLineDash([4, 4]);
  context.strokeStyle = palette.keepout;
  context.stroke();
  context.setLineDash([]);
  context.beginPath();
  const marks = episode.marks(time);
  for (let k = 0; k < marks.length; k += 3) {
    circle(context, view.x(marks[k + 1]), view.y(marks[k]), marks[k + 2] * view.scale);
  }
  context.strokeStyle = palette.goal;
  context.stroke();

  for (const { team, corners } of followed) {
    context.beginPath();
    circle(context, view.x(corners[1]), view.y(corners[0]), 5 * weight);
    context.fillStyle = palette.water;
    context.fill();
    context.strokeStyle = palette.teams[team] ?? palette.track;
    context.stroke();
  }
  for (const { team, corners } of episode.paths) {
    const [x, y, isFollowed] = [view.x(corners.at(-1)), view.y(corners.at(-2)), corners.length > 2];
    context.fillStyle = context.strokeStyle = palette.teams[team] ?? palette.goal;
    context.beginPath();
    if (isFollowed && weight === 1) circle(context, x, y, episode.arrival.radius_m * view.scale);
    context.stroke();
    star(context, x, y, (isFollowed ? 9 : 5) * weight);
  }
}

/** A length that one reads off, and where north is. */
export function drawScaleBar(context, view, palette) {
  const metres = roundStep(70 / view.scale);
  const [left, right, y] = [16, 16 + metres * view.scale, view.height - 16];
  context.lineWidth = 2;
  context.strokeStyle = palette.ink;
  context.beginPath();
  context.moveTo(left, y - 5);
  context.lineTo(left, y);
  context.lineTo(right, y);
  context.lineTo(right, y - 5);
  context.stroke();
  label(context, `${metres} m`, left + 6, y - 6, palette);
  const x = view.width - 22;
  context.fillStyle = palette.ink;
  context.beginPath();
  context.moveTo(x, 12);
  context.lineTo(x + 5, 26);
  context.lineTo(x, 23);
  context.lineTo(x - 5, 26);
  context.fill();
  label(context, "N", x - 4, 40, palette);
}

/** The whole map in a corner, and the part of it that the picture shows. */
export function drawInset(context, episode, time, poses, view, look) {
  const inset = look.inset;
  context.save();
  context.translate(10, 10);
  context.beginPath();
  context.roundRect(0, 0, inset.width, inset.height, 6);
  context.fillStyle = look.palette.panel;
  context.globalAlpha = 0.8;
  context.fill();
  context.globalAlpha = 1;
  context.clip();
  drawMap(context, episode, time, inset, look.palette, 0.5);
  const dot = episode.vehicles > 200 ? 1 : 1.8;
  for (let i = 0; i < episode.vehicles; i++) {
    context.fillStyle = episode.hasTeams ? look.palette.teams[episode.team[i]] : look.palette.scale[8];
    context.fillRect(inset.x(poses[3 * i + 1]) - dot / 2, inset.y(poses[3 * i]) - dot / 2, dot, dot);
  }
  const [north, east] = [view.height / 2 / view.scale, view.width / 2 / view.scale];
  context.lineWidth = 1;
  context.strokeStyle = look.palette.ink;
  context.strokeRect(
    inset.x(view.east - east), inset.y(view.north + north), 2 * east * inset.scale, 2 * north * inset.scale,
  );
  context.restore();
}

/** The frame of the inset in a picture's corner, or null where the picture has no room or shows it all. */
export function insetView(extent, view) {
  const [tall, wide] = [extent.high[0] - extent.low[0], extent.high[1] - extent.low[1]];
  const most = Math.min(140, 0.22 * view.width, 0.3 * view.height);
  const scale = most / Math.max(tall, wide);
  if (most < 60 || scale > 0.75 * view.scale) return null;
  const [north, east] = [(extent.low[0] + extent.high[0]) / 2, (extent.low[1] + extent.high[1]) / 2];
  return new View(north, east, scale, wide * scale, tall * scale);
}
