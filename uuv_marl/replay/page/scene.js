/** The water: paths, obstacles, trails, vehicles, and what happens to them. */
import { drawGrid, drawInset, drawMap, drawScaleBar } from "./map.js";
import { drawCurrent, drawCurrentKey } from "./current.js";
import { circle, cross, dart, label } from "./shapes.js";
import { drawSonar } from "./sonar.js";

/** How long a collision is marked [s of the episode]. */
const FLASH_S = 2;
/** How far trails reach back [s]. */
const TRAIL_S = 16;
/** Pieces of trails that are drawn at most; beyond it they leave out samples. */
const TRAIL_PIECES = 6000;

/**
 * Draw an episode at a time.
 * @param context 2D context whose unit is a CSS pixel.
 * @param look {palette, scale: Scale, trails: boolean, selected: vehicle or null, inset: View or null}
 */
export function drawScene(context, episode, time, poses, view, look) {
  const sample = episode.sampleAt(time);
  const size = hullSize(episode, view);
  context.fillStyle = look.palette.water;
  context.fillRect(0, 0, view.width, view.height);
  drawGrid(context, view, look.palette);
  if (episode.current) drawCurrent(context, episode, sample, view, look.palette);
  drawMap(context, episode, time, view, look.palette, 1);
  if (look.trails) drawTrails(context, episode, sample, poses, view, look.palette);
  const shown = look.selected !== null && episode.inspected.indexOf(look.selected);
  if (shown >= 0 && shown !== false) drawSonar(context, episode, shown, sample, poses, view, look.palette);
  drawVehicles(context, episode, sample, poses, view, size, look);
  drawMessages(context, episode, sample, poses, view, size, look.palette);
  drawMarks(context, episode, poses, view, size, look);
  episode.paths.forEach(({ team, corners }, path) => {
    const colour = look.palette.teams[team] ?? look.palette.reference;
    if (corners.length > 2) drawReference(context, episode.reference(time, path), view, look.palette, colour);
  });
  drawFlashes(context, episode, time, poses, view, size, look.palette);
  drawScaleBar(context, view, look.palette);
  if (episode.current) drawCurrentKey(context, episode, view, look.palette);
  if (look.inset) drawInset(context, episode, time, poses, view, look);
}

/** Length of a drawn vehicle [px]: as large as can be told apart, and never smaller than it is. */
function hullSize(episode, view) {
  const apart = episode.metrics.mean_min_spacing_m ?? 10;
  return Math.max(2 * episode.hull_radius_m * view.scale, Math.min(14, 0.8 * apart * view.scale), 3);
}

/** Where all vehicles came from, paler the longer ago. */
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
        if (step) context.lineTo(view.x(position[at + 1]), view.y(position[at]));
        else if (band) context.moveTo(view.x(position[at + 1]), view.y(position[at]));
      });
    }
    context.globalAlpha = 0.7 * (1 - band / bands);
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** All vehicles, colour by colour. Small paths one by one are filled faster than one path that spans the picture. */
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
    const colour = look.scale ? look.palette.scale[look.scale.step(value)] : look.palette.teams[episode.team[i]];
    if (!paths.has(colour)) paths.set(colour, []);
    paths.get(colour).push(i);
  }
  context.lineWidth = 2;
  context.strokeStyle = look.palette.lost;
  context.stroke();
  for (const [colour, vehicles] of paths) {
    context.strokeStyle = colour;
    for (const i of vehicles) {
      context.beginPath();
      dart(context, view.x(poses[3 * i + 1]), view.y(poses[3 * i]), poses[3 * i + 2], size);
      const hollow = episode.uninformed.includes(i);
      context.fillStyle = hollow ? look.palette.water : colour;
      context.fill();
      if (hollow) context.stroke();
    }
  }
}

/** Two rings around those who send a message. */
function drawMessages(context, episode, sample, poses, view, size, palette) {
  const sending = episode.values("sending");
  if (!sending) return;
  context.lineWidth = 1.5;
  context.strokeStyle = palette.echo;
  context.beginPath();
  for (let i = 0; i < episode.vehicles; i++) {
    if (!sending[sample * episode.vehicles + i]) continue;
    const [x, y] = [view.x(poses[3 * i + 1]), view.y(poses[3 * i])];
    circle(context, x, y, 0.9 * size + 4);
    circle(context, x, y, 1.5 * size + 8);
  }
  context.stroke();
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

function drawReference(context, [north, east], view, palette, colour) {
  const [x, y] = [view.x(east), view.y(north)];
  context.beginPath();
  circle(context, x, y, 7);
  circle(context, x, y, 1.5);
  context.lineWidth = 4.5;
  context.strokeStyle = palette.water;
  context.stroke();
  context.lineWidth = 2;
  context.strokeStyle = colour;
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

