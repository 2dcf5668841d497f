/** The current: arrows at fixed places of the water, as long as it is fast. */
import { label } from "./shapes.js";

/** Length of an arrow of the speed in the key [px]. */
const ARROW = 22;
/** Arrows are about this far apart [px], and get no longer than so many times ARROW. */
const APART = 48;
const MOST = 1.6;

/** North and east of the water's velocity [m/s] at a place, at a sample: a drift, and Lamb-Oseen eddies that stand still. */
export function flowAt(episode, sample, north, east) {
  const drift = episode.values("drift");
  const eddies = episode.values("eddies");
  const core = episode.current.core_m;
  const flow = [drift[2 * sample], drift[2 * sample + 1]];
  for (let k = 0; k < eddies.length; k += 3) {
    const [dn, de] = [north - eddies[k], east - eddies[k + 1]];
    const square = (dn * dn + de * de) / (core * core);
    const share = (eddies[k + 2] / (2 * Math.PI * core * core)) * (square > 0 ? -Math.expm1(-square) / square : 1);
    flow[0] -= share * de;
    flow[1] += share * dn;
  }
  return flow;
}

/** Arrows all over the picture. They stay where they are while the view moves. */
export function drawCurrent(context, episode, sample, view, palette) {
  const step = 2 ** Math.round(Math.log2(APART / view.scale));
  const [north, east] = [view.height / 2 / view.scale, view.width / 2 / view.scale];
  context.beginPath();
  for (let n = Math.floor((view.north - north) / step) + 0.5; n * step < view.north + north; n++) {
    for (let e = Math.floor((view.east - east) / step) + 0.5; e * step < view.east + east; e++) {
      const [v_n, v_e] = flowAt(episode, sample, n * step, e * step);
      const speed = Math.hypot(v_n, v_e);
      const share = Math.min(speed / episode.current.shown_mps, MOST);
      if (share < 0.08) continue;
      const [right, down] = [(ARROW * share * v_e) / speed, (-ARROW * share * v_n) / speed];
      arrow(context, view.x(e * step) - right / 2, view.y(n * step) - down / 2, right, down);
    }
  }
  context.lineWidth = 1;
  context.strokeStyle = palette.current;
  context.stroke();
}

/** How long an arrow of a round speed is, above the scale bar. */
export function drawCurrentKey(context, episode, view, palette) {
  const y = view.height - 46;
  context.beginPath();
  arrow(context, 16, y, ARROW, 0);
  context.lineWidth = 1.5;
  context.strokeStyle = palette.ink;
  context.stroke();
  label(context, `current ${episode.current.shown_mps} m/s`, 16 + ARROW + 6, y + 4, palette);
}

/** Add an arrow to the path, from a place so many pixels to the right and down. */
function arrow(context, x, y, right, down) {
  const length = Math.hypot(right, down);
  const wing = Math.min(5, 0.5 * length) / length;
  context.moveTo(x, y);
  context.lineTo(x + right, y + down);
  for (const side of [0.6, -0.6]) {
    context.moveTo(x + right, y + down);
    context.lineTo(x + right - wing * (right + side * down), y + down - wing * (down - side * right));
  }
}
