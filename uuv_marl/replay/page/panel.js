/** One episode's part of the page: its name and state, its water, and the numbers of the present time. */
import { insetView } from "./map.js";
import { drawScene } from "./scene.js";

const NUMBERS = [
  { name: "min_spacing_m", label: "spacing", unit: "m", lowest: "lowest_spacing_m", bound: "s_u_m" },
  { name: "obstacle_clearance_m", label: "clearance", unit: "m", lowest: "lowest_clearance_m", bound: "s_o_m" },
  { name: "centre_error_m", label: "centre to l(t)", unit: "m" },
  { name: "collisions", label: "collisions", unit: "" },
];

/** A new element with properties and children. */
export function make(tag, properties = {}, ...children) {
  const { data = {}, ...rest } = properties;
  const element = Object.assign(document.createElement(tag), rest);
  Object.assign(element.dataset, data);
  element.append(...children);
  return element;
}

export class Panel {
  /** @param select called with a vehicle, or null for none. */
  constructor(episode, index, select) {
    this.episode = episode;
    this.select = select;
    this.canvas = make("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${episode.policy}: ${episode.vehicles} vehicles in the water`);
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.state = make("span", { className: "badge", data: { state: index } });
    this.hits = make("span", { className: "badge", data: { hits: index } });
    this.chips = episode.inspected.map((vehicle) => {
      const chip = make("button", { className: "chip", type: "button", data: { vehicle } }, `UUV ${vehicle}`);
      chip.title = "Show what its sonar detects";
      chip.addEventListener("focus", () => select(vehicle));
      chip.addEventListener("click", () => select(vehicle));
      return chip;
    });
    const swatch = make("i", { className: "swatch" });
    swatch.style.setProperty("--series", `var(--series-${index})`);
    this.cells = NUMBERS.map((number) => make("dd", { data: { episode: index, number: number.name } }));
    this.element = make(
      "article", { className: "panel" },
      make("header", {}, make("h2", {}, swatch, episode.policy), ...this.chips, this.state, this.hits),
      make("div", { className: "water" }, this.canvas),
      make(
        "dl", { className: "numbers" },
        ...NUMBERS.map((number, k) => make("div", {}, make("dt", {}, number.label), this.cells[k])),
      ),
    );
    this.element.setAttribute("aria-label", episode.policy);
  }

  /** Take the size that the page gives, at the screen's resolution. */
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  draw(time, camera, look) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.poses = this.episode.poses(time);
    this.view = camera.view(this.episode, time, this.poses, look.selected ?? 0, width, height);
    const inset = camera.follow === "map" ? null : insetView(camera.extent, this.view);
    drawScene(this.context, this.episode, time, this.poses, this.view, { ...look, inset });
  }

  /** The numbers of a time, and which vehicle is selected. */
  show(time, selected) {
    const numbers = this.episode.numbers(time);
    NUMBERS.forEach((number, k) => {
      const value = numbers[number.name];
      this.cells[k].textContent = value === null ? "–" : number.unit ? value.toFixed(1) : String(value);
      const bound = this.episode.constraints[number.bound];
      const isBad = value !== null && (number.bound ? value < bound : number.name === "collisions" && value > 0);
      this.cells[k].classList.toggle("below", isBad);
      if (number.unit && value !== null) this.cells[k].append(make("small", {}, number.unit));
      const lowest = numbers[number.lowest];
      if (Number.isFinite(lowest)) this.cells[k].append(make("small", { className: "least" }, `least ${lowest.toFixed(1)}`));
    });
    const ended = time >= this.episode.end - 1e-3;
    this.state.textContent = numbers.arrived
      ? `arrived ${this.episode.metrics.task_time_s.toFixed(1)} s`
      : ended ? "never arrived" : "under way";
    this.state.classList.toggle("arrived", numbers.arrived);
    const parts = [];
    if (numbers.collisions) parts.push(numbers.collisions === 1 ? "1 collision" : `${numbers.collisions} collisions`);
    if (numbers.lost) parts.push(`${numbers.lost} lost`);
    this.hits.textContent = parts.join(", ");
    this.hits.classList.toggle("hit", numbers.collisions > 0);
    this.chips.forEach((chip) => chip.setAttribute("aria-pressed", String(Number(chip.dataset.vehicle) === selected)));
  }

  /** Where a vehicle is drawn in the window [px]. */
  place(vehicle) {
    const { left, top } = this.canvas.getBoundingClientRect();
    return [left + this.view.x(this.poses[3 * vehicle + 1]), top + this.view.y(this.poses[3 * vehicle])];
  }

  /** The vehicle that is drawn at most 18 px from a place of the picture, or null. */
  vehicleAt(x, y) {
    let [best, distance] = [null, 18];
    for (let i = 0; i < this.episode.vehicles; i++) {
      const away = Math.hypot(this.view.x(this.poses[3 * i + 1]) - x, this.view.y(this.poses[3 * i]) - y);
      if (away < distance) [best, distance] = [i, away];
    }
    return best;
  }
}
