/** The page: what is shown now, and what keys and buttons change. `window.replay` offers the same to a script. */
import { Camera } from "./camera.js";
import { QUANTITIES, Scale, resolvePalette, shownQuantities } from "./colours.js";
import { decodeEpisodes, inflate } from "../decode.js";
import { Episode } from "./episode.js";
import { listen } from "./gestures.js";
import { SPEEDS, listenToKeys } from "./keys.js";
import { Panel, make } from "./panel.js";
import { Plots } from "./plots.js";
import { Timeline, jumpText } from "./timeline.js";
import { showVehicle } from "./vehicle.js";

const PALETTE = [
  "water", "grid", "track", "obstacle", "keepout", "goal", "trail", "reference", "hit", "near", "lost", "active",
  "passive", "current", "detected", "echo", "force", "ink", "muted", "line", "panel", "series-0", "series-1", "series-2", "series-3",
];
/** How often the numbers are written while the replay plays [ms]. */
const WRITE_MS = 100;
/** How many of the latest drawing times are kept. */
const KEPT_TIMES = 1000;

const at = (id) => document.getElementById(id);

class App {
  constructor(episodes) {
    this.episodes = episodes;
    this.end = Math.max(...episodes.map((episode) => episode.end));
    Object.assign(this, { time: 0, speed: 8, playing: false, trails: true, drawTimes: [] });
    this.selected = episodes[0].inspected[0] ?? null;
    this.selectedEpisode = 0;
    this.quantities = shownQuantities(episodes);
    if (episodes.some((episode) => episode.hasTeams)) this.quantities.unshift("");
    this.camera = new Camera(episodes);
    this.timeline = new Timeline(episodes, (time) => this.seek(time));
    this.plots = new Plots(episodes, (time) => this.seek(time));
    this.panels = episodes.map((episode, k) => new Panel(episode, k, (vehicle) => this.select(k, vehicle)));
    this.#fill();
    this.#listen();
    this.restyle();
    this.setColour(this.quantities[0]);
    new ResizeObserver(() => this.resize()).observe(at("waters"));
  }

  /** Show a time [s]; a running replay pauses. */
  seek(time) {
    this.pause();
    this.time = Math.min(Math.max(time, 0), this.end);
    at("status").textContent = "";
    this.render();
  }

  play() {
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    at("play").dataset.playing = "";
    at("play").setAttribute("aria-label", "Pause");
    let before = performance.now();
    const frame = (now) => {
      if (!this.playing) return;
      this.time = Math.min(this.time + (Math.max(now - before, 0) / 1000) * this.speed, this.end);
      before = now;
      this.render();
      if (this.time < this.end) requestAnimationFrame(frame);
      else this.pause();
    };
    requestAnimationFrame(frame);
  }

  pause() {
    this.playing = false;
    delete at("play").dataset.playing;
    at("play").setAttribute("aria-label", "Play");
    this.#write();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Go to the next event or the one before, and say what it is. */
  jump(forward) {
    const jump = this.timeline.jump(this.time, forward);
    if (!jump) return;
    this.seek(jump.time);
    at("status").textContent = jumpText(jump, this.episodes.length > 1);
  }

  /** Select a vehicle, the same in all episodes, and show the details of one; null for none. */
  select(episode, vehicle) {
    const inside = Number.isInteger(vehicle) && vehicle >= 0 && vehicle < this.episodes[episode].vehicles;
    this.selected = inside ? vehicle : null;
    this.selectedEpisode = episode;
    if (!inside && this.camera.follow === "vehicle") this.follow("swarm");
    this.render();
  }

  /** Colour by `spacing`, `speed` or `force`; by group without a quantity. */
  setColour(quantity) {
    at("legend").style.visibility = quantity ? "" : "hidden";
    this.scale = quantity ? new Scale(quantity, this.episodes) : null;
    at("colour").value = quantity ?? "";
    this.#legend();
    this.render();
  }

  setSpeed(speed) {
    this.speed = speed;
    at("speed").value = String(speed);
  }

  /** Follow the `swarm`, the selected `vehicle`, or see the whole `map`. */
  follow(what) {
    if (what === "vehicle" && this.selected === null) this.selected = this.episodes[0].inspected[0] ?? 0;
    this.camera.look(what);
    at("follow").value = what;
    this.render();
  }

  /** Shift all pictures by so many pixels of a panel. */
  pan(right, down, panel) {
    this.camera.pan(right, down, panel.view);
    this.render();
  }

  /** Magnify all pictures, around a pixel of a panel, by default around its middle. */
  magnify(factor, panel = this.panels[0], x = undefined, y = undefined) {
    this.camera.magnify(factor, panel.view, x, y);
    this.render();
  }

  setTrails(shown) {
    this.trails = shown;
    at("trails").setAttribute("aria-pressed", String(shown));
    this.render();
  }

  /** Bring up to date what depends on the colours and on the size of the page. */
  restyle() {
    this.palette = resolvePalette(PALETTE);
    this.resize();
    this.#legend();
  }

  resize() {
    this.panels.forEach((panel) => panel.resize());
    this.timeline.draw(this.palette);
    this.plots.draw(this.palette);
    this.render();
  }

  render() {
    const look = { palette: this.palette, scale: this.scale, trails: this.trails, selected: this.selected };
    const began = performance.now();
    for (const panel of this.panels) panel.draw(this.time, this.camera, look);
    this.drawTimes.push(performance.now() - began);
    if (this.drawTimes.length > KEPT_TIMES) this.drawTimes.shift();
    this.timeline.show(this.time);
    this.plots.show(this.time);
    at("time").replaceChildren(this.time.toFixed(1), make("small", {}, ` / ${this.end.toFixed(1)} s`));
    this.#write();
  }

  /** The numbers, where they can have changed: with the sample or the selection. */
  #write() {
    if (this.playing && performance.now() - this.writtenAt < WRITE_MS) return;
    this.writtenAt = performance.now();
    const samples = this.episodes.map((episode) => episode.sampleAt(this.time));
    const state = [samples, this.selected, this.selectedEpisode, this.time >= this.end].join();
    if (state === this.written) return;
    this.written = state;
    this.panels.forEach((panel) => panel.show(this.time, this.selected));
    const episode = this.episodes[this.selectedEpisode];
    showVehicle(at("vehicle"), episode, this.selected, this.time, (vehicle) =>
      this.select(this.selectedEpisode, vehicle),
    );
  }

  #fill() {
    const [first] = this.episodes;
    const names = this.episodes.map((episode) => episode.policy);
    at("title").textContent = `${first.scenario}: ${names.join(", ")}`;
    at("subtitle").textContent =
      `${first.vehicles} vehicles, seed ${first.seed}, scenario version ${first.version}, ${first.conditions}`;
    if (first.uninformed.length) at("subtitle").prepend("filled: perceives l(t), hollow: does not; ");
    at("waters").dataset.episodes = this.episodes.length;
    at("waters").append(...this.panels.map((panel) => panel.element));
    at("colour").append(...this.quantities.map((name) => new Option(QUANTITIES[name]?.label ?? "Group", name)));
    at("speed").append(...SPEEDS.map((speed) => new Option(`${speed}×`, speed)));
    this.setSpeed(this.speed);
  }

  #legend() {
    if (!this.scale || !this.palette) return;
    const { unit, factor, smallStandsOut } = this.scale;
    const [low, high] = [this.scale.low, this.scale.high].map((value) => Number((factor * value).toFixed(1)));
    const steps = smallStandsOut ? [...this.palette.scale].reverse() : this.palette.scale;
    at("legend").querySelector("i").style.background = `linear-gradient(90deg, ${steps.join(", ")})`;
    at("legend-low").textContent = low;
    at("legend-high").textContent = `${high} ${unit}`;
    at("legend").setAttribute("aria-label", `from ${low} to ${high} ${unit}`);
  }

  #listen() {
    at("play").addEventListener("click", () => this.toggle());
    at("next").addEventListener("click", () => this.jump(true));
    at("previous").addEventListener("click", () => this.jump(false));
    at("trails").addEventListener("click", () => this.setTrails(!this.trails));
    at("speed").addEventListener("change", (event) => this.setSpeed(Number(event.target.value)));
    at("follow").addEventListener("change", (event) => this.follow(event.target.value));
    at("colour").addEventListener("change", (event) => this.setColour(event.target.value));
    at("help-button").addEventListener("click", () => at("help").showModal());
    at("theme").addEventListener("click", () => this.#theme());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.restyle());
    listenToKeys(this);
    this.panels.forEach((panel, k) => {
      listen(panel.canvas, {
        pan: (right, down) => this.pan(right, down, panel),
        magnify: (factor, x, y) => this.magnify(factor, panel, x, y),
        click: (x, y) => this.select(k, panel.vehicleAt(x, y)),
      });
    });
  }

  #theme() {
    const root = document.documentElement;
    const dark = getComputedStyle(root).colorScheme === "dark" ||
      (root.style.colorScheme === "" && matchMedia("(prefers-color-scheme: dark)").matches);
    root.style.colorScheme = dark ? "light" : "dark";
    this.restyle();
  }
}

/** uPlot, a classic script that travels deflated, defines `uPlot` once it is part of the page. */
async function loadPlots() {
  const code = new TextDecoder().decode(await inflate(at("uplot").textContent));
  document.head.append(make("script", { textContent: code }));
}

async function open() {
  await loadPlots();
  const payload = JSON.parse(at("episodes").textContent);
  const episodes = (await decodeEpisodes(payload)).map((decoded) => new Episode(decoded));
  const app = new App(episodes);
  at("subtitle").textContent += `, uuv_marl ${payload.uuv_marl}`;
  Object.assign(window.replay, {
    seek: (time) => app.seek(time),
    numbers: (episode) => episodes[episode].numbers(app.time),
    select: (episode, vehicle) => app.select(episode, vehicle),
    setColour: (quantity) => app.setColour(quantity),
    follow: (what) => app.follow(what),
    place: (episode, vehicle) => app.panels[episode].place(vehicle),
    play: () => app.play(),
    pause: () => app.pause(),
    drawTimes: app.drawTimes,
  });
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (window === window.top && !calm) app.play();
}

window.replay = {
  ready: open().catch((error) => {
    document.querySelector("main").replaceChildren(make("p", {}, `This replay can't be shown: ${error.message}`));
    document.querySelector("main p").setAttribute("role", "alert");
    throw error;
  }),
};
