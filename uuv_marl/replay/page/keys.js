/** The keyboard: what every key changes. */
import { FOLLOW } from "./camera.js";

/** How much faster than the episode a replay can run. */
export const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32];

/** Let keys control the app, wherever the focus is, but where one types or chooses. */
export function listenToKeys(app) {
  const help = document.getElementById("help");
  addEventListener("keydown", (event) => {
    if (event.target.matches("select, input[type=number]") || help.open) return;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const press = { ...actions(app, event.shiftKey), "?": () => help.showModal() }[event.key];
    if (!press || (event.key === " " && event.target.matches("button"))) return;
    event.preventDefault();
    press();
  });
}

function actions(app, shift) {
  const step = shift ? 10 : app.episodes[0].period_s;
  const next = (all, now) => all[(all.indexOf(now) + 1) % all.length];
  const speed = (steps) => SPEEDS[Math.min(Math.max(SPEEDS.indexOf(app.speed) + steps, 0), SPEEDS.length - 1)];
  return {
    " ": () => app.toggle(),
    ArrowRight: () => app.seek(app.time + step),
    ArrowLeft: () => app.seek(app.time - step),
    ArrowUp: () => app.setSpeed(speed(1)),
    ArrowDown: () => app.setSpeed(speed(-1)),
    Home: () => app.seek(0),
    End: () => app.seek(app.end),
    "+": () => app.magnify(1.25),
    "=": () => app.magnify(1.25),
    "-": () => app.magnify(0.8),
    f: () => app.follow(next(FOLLOW, app.camera.follow)),
    t: () => app.setTrails(!app.trails),
    c: () => app.setColour(next(app.quantities, app.scale?.quantity ?? "")),
    n: () => app.jump(true),
    p: () => app.jump(false),
    Escape: () => app.select(app.selectedEpisode, null),
  };
}
