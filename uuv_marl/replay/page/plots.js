/** Plots that follow the time; a click on one goes to its time. uPlot draws them. */
/* global uPlot */

const HEIGHT_PX = 98;
const DASHES = [[], [6, 3], [2, 3], [8, 3, 2, 3]];
/** What is plotted: array, heading, and the constraint of Eq. 7 that bounds it. */
const PLOTS = [
  { array: "min_spacing_m", title: "Smallest spacing [m]", bound: "s_u_m", sign: "s_u" },
  { array: "obstacle_clearance_m", title: "Clearance from obstacles [m]", bound: "s_o_m", sign: "s_o", most: 60 },
  { array: "centre_error_m", title: "Centre's distance from l(t) [m]" },
];

export class Plots {
  /** @param seek called with the time of a click [s]. */
  constructor(episodes, seek) {
    this.episodes = episodes;
    this.seek = seek;
    this.place = document.getElementById("plots");
    this.plots = [];
    this.time = 0;
  }

  /** Make the plots again, in the palette's colours and the place's width. */
  draw(palette) {
    this.plots.forEach((plot) => plot.destroy());
    this.place.replaceChildren();
    const shown = PLOTS.filter(({ array }) =>
      this.episodes.some((episode) => episode.values(array)?.some(Number.isFinite)),
    );
    this.plots = shown.map((plot) => this.#plot(plot, palette));
  }

  show(time) {
    this.time = time;
    for (const plot of this.plots) plot.now.style.transform = `translateX(${plot.valToPos(time, "x")}px)`;
  }

  #plot(kind, palette) {
    const place = this.place.appendChild(document.createElement("div"));
    place.className = "plot";
    place.appendChild(document.createElement("h3")).textContent = kind.title;
    const axis = {
      stroke: palette.muted, font: "11px system-ui", grid: { stroke: palette.line, width: 1 }, ticks: { show: false },
    };
    const plot = new uPlot(
      {
        width: this.place.clientWidth - 26,
        height: HEIGHT_PX,
        padding: [6, 6, 0, 0],
        legend: { show: false },
        cursor: { y: false, drag: { x: false }, points: { show: false } },
        scales: { x: { time: false }, y: { range: (_, low, high) => range(kind, low, high) } },
        axes: [{ ...axis, size: 22, gap: 2 }, { ...axis, size: 34, gap: 4 }],
        series: [{}, ...this.episodes.map((_, k) => line(k, palette))],
        hooks: {
          draw: [(drawn) => drawBound(drawn, kind, this.episodes[0], palette), () => this.show(this.time)],
        },
      },
      uPlot.join(this.episodes.map((episode) => [Array.from(episode.time), finite(episode, kind.array)])),
      place,
    );
    plot.now = plot.over.appendChild(document.createElement("i"));
    plot.now.className = "now";
    plot.over.classList.add("over");
    plot.over.addEventListener("click", (event) => this.seek(plot.posToVal(event.offsetX, "x")));
    return plot;
  }
}

function line(k, palette) {
  return { stroke: palette[`series-${k}`], width: 1.6, dash: DASHES[k], points: { show: false }, spanGaps: true };
}

function finite(episode, array) {
  const values = episode.values(array);
  return Array.from(episode.time, (_, k) => (values && Number.isFinite(values[k]) ? values[k] : null));
}

/** From zero, or below where a hull is inside an obstacle, up to what matters. */
function range(kind, low, high) {
  return [Math.min(0, low ?? 0), Math.min(1.08 * (high || 1), kind.most ?? Infinity)];
}

/** The constraint as a dashed line with its sign. */
function drawBound(plot, kind, episode, palette) {
  if (!kind.bound) return;
  const { ctx: context, bbox } = plot;
  const y = plot.valToPos(episode.constraints[kind.bound], "y", true);
  if (y < bbox.top) return;
  context.save();
  context.strokeStyle = context.fillStyle = palette.hit;
  context.setLineDash([4, 4]);
  context.beginPath();
  context.moveTo(bbox.left, y);
  context.lineTo(bbox.left + bbox.width, y);
  context.stroke();
  context.textAlign = "right";
  context.font = `${11 * devicePixelRatio}px system-ui`;
  context.fillText(kind.sign, bbox.left + bbox.width - 2, y - 5);
  context.restore();
}
