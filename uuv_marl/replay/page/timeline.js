/** The time line: the scrubber, a row of marks for each episode, and jumps from event to event. */

/** How far apart events must be to be jumped to one by one [s]. */
const APART_S = 0.4;
const ROW_PX = 8;
/** Half the width of the scrubber's thumb [px], by which its ends lie inside. */
const INSET_PX = 8;
const WEIGHT = { arrived: 4, collision: 3, obstacle: 3, lost: 2, near: 1, near_obstacle: 1 };
const COLOUR = {
  arrived: "reference", collision: "hit", obstacle: "hit", lost: "lost", near: "near", near_obstacle: "near",
};

/** Text of an event, as `collision of 3 and 17`. */
export function eventText({ kind, vehicles }) {
  const who = vehicles.map(String);
  const all = who.length > 1 ? `${who.slice(0, -1).join(", ")} and ${who.at(-1)}` : (who[0] ?? "a vehicle");
  const texts = {
    arrived: "the swarm has arrived",
    collision: vehicles.length ? `collision of ${all}` : "collision",
    obstacle: `${all} hit an obstacle`,
    lost: `${all} is lost`,
    near: `${all} nearer than s_u`,
    near_obstacle: `${all} nearer than s_o to an obstacle`,
  };
  return texts[kind] ?? kind;
}

/** All episodes' events in time order, those at nearly one time together: [{time, events: [{episode, event}]}]. */
export function jumps(episodes) {
  const all = episodes.flatMap((episode) => episode.events.map((event) => ({ episode, event })));
  all.sort((a, b) => a.event.time_s - b.event.time_s);
  const groups = [];
  for (const one of all) {
    const last = groups.at(-1);
    if (last && one.event.time_s - last.time < APART_S) last.events.push(one);
    else groups.push({ time: one.event.time_s, events: [one] });
  }
  return groups;
}

/** What happened at a jump, the weightiest first. */
export function jumpText(jump, severalEpisodes) {
  const events = [...jump.events].sort((a, b) => WEIGHT[b.event.kind] - WEIGHT[a.event.kind]);
  const { episode, event } = events[0];
  const more = events.length > 1 ? `, and ${events.length - 1} more` : "";
  return `${event.time_s.toFixed(1)} s: ${severalEpisodes ? `${episode.policy}: ` : ""}${eventText(event)}${more}`;
}

export class Timeline {
  /** @param seek called with a time [s]. */
  constructor(episodes, seek) {
    this.episodes = episodes;
    this.end = Math.max(...episodes.map((episode) => episode.end));
    this.jumps = jumps(episodes);
    this.canvas = document.getElementById("marks");
    this.canvas.style.height = `${ROW_PX * episodes.length}px`;
    this.scrubber = document.getElementById("scrubber");
    this.scrubber.max = this.end;
    this.scrubber.addEventListener("input", () => seek(Number(this.scrubber.value)));
    this.canvas.addEventListener("click", (event) => seek(this.#timeAt(event.offsetX)));
    this.canvas.addEventListener("pointermove", (event) => {
      const near = this.#nearest(this.#timeAt(event.offsetX));
      this.canvas.title = near ? jumpText(near, episodes.length > 1) : "";
    });
  }

  show(time) {
    this.scrubber.value = time;
    this.scrubber.setAttribute("aria-valuetext", `${time.toFixed(1)} s of ${this.end.toFixed(1)} s`);
  }

  /** The jump after a time, or before it, or null. */
  jump(time, forward) {
    const found = forward
      ? this.jumps.find((jump) => jump.time > time + 0.05)
      : this.jumps.findLast((jump) => jump.time < time - 0.05);
    return found ?? null;
  }

  #timeAt(x) {
    const share = (x - INSET_PX) / (this.canvas.clientWidth - 2 * INSET_PX);
    return Math.min(Math.max(share, 0), 1) * this.end;
  }

  #nearest(time) {
    const away = (jump) => Math.abs(jump.time - time);
    const best = this.jumps.reduce((a, b) => (a && away(a) <= away(b) ? a : b), null);
    return best && away(best) < 0.015 * this.end ? best : null;
  }

  /** Draw the marks: heavy events high and on top of light ones. */
  draw(palette) {
    const ratio = window.devicePixelRatio || 1;
    const width = this.canvas.clientWidth;
    this.canvas.width = width * ratio;
    this.canvas.height = ROW_PX * this.episodes.length * ratio;
    const context = this.canvas.getContext("2d");
    context.scale(ratio, ratio);
    this.episodes.forEach((episode, row) => {
      context.fillStyle = palette[`series-${row}`];
      context.fillRect(0, ROW_PX * row + 2, 5, 4);
      for (const event of [...episode.events].sort((a, b) => WEIGHT[a.kind] - WEIGHT[b.kind])) {
        const x = INSET_PX + (event.time_s / this.end) * (width - 2 * INSET_PX);
        const light = event.kind.startsWith("near");
        context.fillStyle = palette[COLOUR[event.kind]] ?? palette.muted;
        context.fillRect(x - (light ? 0.5 : 1), ROW_PX * row + (light ? 3 : 0), light ? 1 : 2.5, light ? 4 : 7);
      }
    });
  }
}
