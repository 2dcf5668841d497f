/** Shapes that the pictures are made of; all lengths in pixels. */

const TURN = 2 * Math.PI;

/** Add a circle to the path. */
export function circle(context, x, y, radius) {
  context.moveTo(x + radius, y);
  context.arc(x, y, radius, 0, TURN);
}

/** Fill a star with five points. */
export function star(context, x, y, radius) {
  context.beginPath();
  for (let k = 0; k < 10; k++) {
    const length = k % 2 ? 0.45 * radius : radius;
    context.lineTo(x + length * Math.sin((k * Math.PI) / 5), y - length * Math.cos((k * Math.PI) / 5));
  }
  context.fill();
}

/** Add a vehicle's outline to the path: a dart with its bow ahead. */
export function dart(context, x, y, heading, size) {
  const ahead_x = Math.sin(heading) * size;
  const ahead_y = -Math.cos(heading) * size;
  context.moveTo(x + 0.6 * ahead_x, y + 0.6 * ahead_y);
  context.lineTo(x - 0.4 * ahead_x - 0.34 * ahead_y, y - 0.4 * ahead_y + 0.34 * ahead_x);
  context.lineTo(x - 0.22 * ahead_x, y - 0.22 * ahead_y);
  context.lineTo(x - 0.4 * ahead_x + 0.34 * ahead_y, y - 0.4 * ahead_y - 0.34 * ahead_x);
  context.closePath();
}

/** A cross where a vehicle was lost. */
export function cross(context, x, y, size) {
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y + size);
  context.moveTo(x - size, y + size);
  context.lineTo(x + size, y - size);
}

/** A short text that is read on any ground. */
export function label(context, text, x, y, palette) {
  context.font = "600 12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = palette.water;
  context.strokeText(text, x, y);
  context.fillStyle = palette.ink;
  context.fillText(text, x, y);
  context.lineJoin = "miter";
}
