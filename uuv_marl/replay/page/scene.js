/** The water: course, obstacles, trails, vehicles, and what happens to them. */
import { drawSonar } from "./sonar.js";
import { View } from "./camera.js";

/** How long a collision is marked [s of the episode]. */
const FLASH_S = 2;
/** How far trails reach back [s]. */
const TRAIL_S = 16;
/** Pieces of trails that are drawn at most; beyond it they leave out samples. */
const TRAIL_PIECES = 6000;
const TURN = 2 * Math.PI;

/**
 * Draw an episode at a time.
 * @param context 2D context whose unit is a CSS pixel.
 * @param look {palette, scale: Scale, trails: boolean, selected: vehicle or null, map: View or null}
 */
export function drawScene(context, episode, time, poses, view, look) {
  const sample = episode.sampleAt(time);
  const size = hullSize(episode, view);
  context.fillStyle = look.palette.water;
  context.fillRect(0, 0, view.width, view.height);
  drawGrid(context, view, look.palette);
  drawCourse(context, episode, view, look.palette, 1);
  if (look.trails) drawTrails(context, episode, sample, poses, view, look.palette);
  const shown = look.selected !== null && episode.inspected.indexOf(look.selected);
  if (shown >= 0 && shown !== false) drawSonar(context, episode, shown, sample, poses, view, look.palette);
  drawVehicles(context, episode, sample, poses, view, size, look);
  drawMarks(context, episode, poses, view, size, look);
  drawReference(context, episode.reference(time), view, look.palette);
  drawFlashes(context, episode, time, poses, view, size, look.palette);
  drawScaleBar(context, view, look.palette);
  if (look.map) drawMap(context, episode, time, poses, view, look);
}

/** Length of a drawn vehicle [px]: as large as can be told apart, and never smaller than it is. */
function hullSize(episode, view) {
  const apart = episode.metrics.mean_min_spacing_m ?? 10;
  return Math.max(2 * episode.contact_m * view.scale, Math.min(14, 0.8 * apart * view.scale), 3);
}

function drawGrid(context, view, palette) {
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

function circle(context, x, y, radius) {
  context.moveTo(x + radius, y);
  context.arc(x, y, radius, 0, TURN);
}

/** Trajectory with start and goal, arrival radius, obstacles with their keep-out ring. */
function drawCourse(context, episode, view, palette, weight) {
  const corners = episode.values("waypoints");
  const discs = episode.values("obstacles");
  const [goal_x, goal_y] = [view.x(corners.at(-1)), view.y(corners.at(-2))];
  context.lineWidth = 1.5 * weight;
  context.strokeStyle = palette.track;
  context.setLineDash([7 * weight, 6 * weight]);
  context.beginPath();
  for (let k = 0; k < corners.length; k += 2) context.lineTo(view.x(corners[k + 1]), view.y(corners[k]));
  context.stroke();
  context.setLineDash([2, 4]);
  context.beginPath();
  circle(context, goal_x, goal_y, episode.arrival.spread_m * view.scale);
  context.stroke();
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
  circle(context, view.x(corners[1]), view.y(corners[0]), 5 * weight);
  context.fillStyle = palette.water;
  context.fill();
  context.strokeStyle = palette.track;
  context.stroke();
  context.fillStyle = context.strokeStyle = palette.goal;
  if (weight === 1) {
    context.beginPath();
    circle(context, goal_x, goal_y, episode.arrival.radius_m * view.scale);
    context.stroke();
  }
  star(context, goal_x, goal_y, 9 * weight);
}

function star(context, x, y, radius) {
  context.beginPath();
  for (let k = 0; k < 10; k++) {
    const length = k % 2 ? 0.45 * radius : radius;
    context.lineTo(x + length * Math.sin((k * Math.PI) / 5), y - length * Math.cos((k * Math.PI) / 5));
  }
  context.fill();
}

/** Where everybody came from, paler the longer ago. */
function drawTrails(context, episode, sample, poses, view, palette) {
  const position = episode.values("position");
  const n = episode.vehicles;
  const first = episode.sampleAt(episode.time[sample] - TRAIL_S);
  const stride = Math.max(1, Math.ceil(((sample - first) * n) / TRAIL_PIECES));
  const samples = [];
  for (let k = sample - (sample % stride); k >= Math.max(first, 0); k -= stride) samples.push(k);
  const bands = 4;
  const length = Math.ceil(samples.length / bands);
  context.lineWidth = 1;
  context.strokeStyle = palette.trail;
  for (let band = 0; band < bands; band++) {
    const part = samples.slice(band * length, (band + 1) * length + 1);
    context.beginPath();
    for (let i = 0; i < n; i++) {
      if (episode.isLost(i, sample)) continue;
      if (band === 0) context.moveTo(view.x(poses[3 * i + 1]), view.y(poses[3 * i]));
      part.forEach((k, step) => {
        const at = 2 * (k * n + i);
        if (band || step) context.lineTo(view.x(position[at + 1]), view.y(position[at]));
        if (band && !step) context.moveTo(view.x(position[at + 1]), view.y(position[at]));
      });
    }
    context.globalAlpha = 0.7 * (1 - band / bands);
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Add a vehicle's outline to the path: a dart with its bow ahead. */
function dart(context, x, y, heading, size) {
  const ahead_x = Math.sin(heading) * size;
  const ahead_y = -Math.cos(heading) * size;
  context.moveTo(x + 0.6 * ahead_x, y + 0.6 * ahead_y);
  context.lineTo(x - 0.4 * ahead_x - 0.34 * ahead_y, y - 0.4 * ahead_y + 0.34 * ahead_x);
  context.lineTo(x - 0.22 * ahead_x, y - 0.22 * ahead_y);
  context.lineTo(x - 0.4 * ahead_x + 0.34 * ahead_y, y - 0.4 * ahead_y - 0.34 * ahead_x);
  context.closePath();
}

/** A cross where a vehicle was lost. */
function cross(context, x, y, size) {
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y + size);
  context.moveTo(x - size, y + size);
  context.lineTo(x + size, y - size);
}

/** Everybody, colour by colour. Small paths one by one are filled faster than one path that spans the picture. */
function drawVehicles(context, episode, sample, poses, view, size, look) {
  const values = look.scale && episode.values(look.scale.quantity);
  const paths = new Map();
  context.beginPath();
  for (let i = 0; i < episode.vehicles; i++) {
    if (episode.isLost(i, sample)) {
      cross(context, view.x(poses[3 * i + 1]), view.y(poses[3 * i]), 0.35 * size);
      continue;
    }
    const value = values ? values[sample * episode.vehicles + i] : NaN;
    const colour = look.palette.scale[look.scale?.step(value) ?? 0];
    if (!paths.has(colour)) paths.set(colour, []);
    paths.get(colour).push(i);
  }
  context.lineWidth = 2;
  context.strokeStyle = look.palette.lost;
  context.stroke();
  for (const [colour, vehicles] of paths) {
    context.fillStyle = colour;
    for (const i of vehicles) {
      context.beginPath();
      dart(context, view.x(poses[3 * i + 1]), view.y(poses[3 * i]), poses[3 * i + 2], size);
      context.fill();
    }
  }
}

/** Rings around the inspected, and the selected vehicle's name. */
function drawMarks(context, episode, poses, view, size, look) {
  context.lineWidth = 1.5;
  context.strokeStyle = look.palette.ink;
  for (const i of new Set([...episode.inspected, look.selected ?? episode.inspected[0]])) {
    if (i === undefined || i >= episode.vehicles) continue;
    const [x, y] = [view.x(poses[3 * i + 1]), view.y(poses[3 * i])];
    context.globalAlpha = i === look.selected ? 1 : 0.45;
    context.beginPath();
    circle(context, x, y, 0.75 * size + 3);
    context.stroke();
    if (i === look.selected) label(context, `UUV ${i}`, x + size + 5, y - size, look.palette);
  }
  context.globalAlpha = 1;
}

/** A short text that is read on any ground. */
function label(context, text, x, y, palette) {
  context.font = "600 12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = palette.water;
  context.strokeText(text, x, y);
  context.fillStyle = palette.ink;
  context.fillText(text, x, y);
  context.lineJoin = "miter";
}

function drawReference(context, [north, east], view, palette) {
  const [x, y] = [view.x(east), view.y(north)];
  context.beginPath();
  circle(context, x, y, 7);
  circle(context, x, y, 1.5);
  context.lineWidth = 4.5;
  context.strokeStyle = palette.water;
  context.stroke();
  context.lineWidth = 2;
  context.strokeStyle = palette.reference;
  context.stroke();
}

/** Rings that grow from those who collided, came too near or were lost a moment ago. */
function drawFlashes(context, episode, time, poses, view, size, palette) {
  for (const event of episode.events) {
    const age = (time - event.time_s) / FLASH_S;
    if (event.kind === "arrived" || age < -1e-3 || age > 1) continue;
    const hit = event.kind === "collision" || event.kind === "obstacle";
    context.globalAlpha = Math.min(1, 1.4 * (1 - age));
    context.lineWidth = hit ? 3 : 2;
    context.strokeStyle = hit ? palette.hit : event.kind === "lost" ? palette.lost : palette.near;
    context.beginPath();
    for (const i of event.vehicles) {
      circle(context, view.x(poses[3 * i + 1]), view.y(poses[3 * i]), size * (hit ? 1.2 + age : 0.9 + 0.5 * age) + 3);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** A length that one reads off, and where north is. */
function drawScaleBar(context, view, palette) {
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

/** The whole course in a corner, and the part of it that the picture shows. */
function drawMap(context, episode, time, poses, view, look) {
  const map = look.map;
  context.save();
  context.translate(10, 10);
  context.beginPath();
  context.roundRect(0, 0, map.width, map.height, 6);
  context.fillStyle = look.palette.panel;
  context.globalAlpha = 0.8;
  context.fill();
  context.globalAlpha = 1;
  context.clip();
  drawCourse(context, episode, map, look.palette, 0.5);
  context.fillStyle = look.palette.scale[8];
  const dot = episode.vehicles > 200 ? 1 : 1.8;
  for (let i = 0; i < episode.vehicles; i++) {
    context.fillRect(map.x(poses[3 * i + 1]) - dot / 2, map.y(poses[3 * i]) - dot / 2, dot, dot);
  }
  const [north, east] = [view.height / 2 / view.scale, view.width / 2 / view.scale];
  context.lineWidth = 1;
  context.strokeStyle = look.palette.ink;
  context.strokeRect(
    map.x(view.east - east), map.y(view.north + north), 2 * east * map.scale, 2 * north * map.scale,
  );
  context.restore();
}

/** The frame of the small map in a picture's corner, or null where the picture has no room or shows it all. */
export function mapView(course, view) {
  const [tall, wide] = [course.high[0] - course.low[0], course.high[1] - course.low[1]];
  const most = Math.min(140, 0.22 * view.width, 0.3 * view.height);
  const scale = most / Math.max(tall, wide);
  if (most < 60 || scale > 0.75 * view.scale) return null;
  const [north, east] = [(course.low[0] + course.high[0]) / 2, (course.low[1] + course.high[1]) / 2];
  return new View(north, east, scale, wide * scale, tall * scale);
}
