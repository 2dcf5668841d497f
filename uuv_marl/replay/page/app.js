/** The page: what is shown now, and what keys and buttons change. `window.replay` offers the same to a script. */
import { Camera, FOLLOW } from "./camera.js";
import { QUANTITIES, Scale, resolvePalette, shownQuantities } from "./colours.js";
import { decodeEpisodes, inflate } from "../decode.js";
import { Episode } from "./episode.js";
import { listen } from "./gestures.js";
import { Panel, make } from "./panel.js";
import { Plots } from "./plots.js";
import { Timeline, jumpText } from "./timeline.js";
import { showVehicle } from "./vehicle.js";

const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32];
const PALETTE = [
  "water", "grid", "track", "obstacle", "keepout", "goal", "trail", "reference", "hit", "near", "lost", "active",
  "passive", "heard", "echo", "force", "ink", "muted", "line", "panel", "series-0", "series-1", "series-2", "series-3",
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

  /** Go to the next event or the one before, say what it was, and select whom it concerns. */
  jump(forward) {
    const jump = this.timeline.jump(this.time, forward);
    if (!jump) return;
    this.seek(jump.time);
    at("status").textContent = jumpText(jump, this.episodes.length > 1);
  }

  /** Select a vehicle, the same in all episodes, and show the details of one; null for nobody. */
  select(episode, vehicle) {
    const inside = Number.isInteger(vehicle) && vehicle >= 0 && vehicle < this.episodes[episode].vehicles;
    this.selected = inside ? vehicle : null;
    this.selectedEpisode = episode;
    if (!inside && this.camera.follow === "vehicle") this.follow("swarm");
    this.render();
  }

  /** Colour by `spacing`, `speed` or `force`. */
  setColour(quantity) {
    this.scale = quantity ? new Scale(quantity, this.episodes) : null;
    at("colour").value = quantity ?? "";
    this.#legend();
    this.render();
  }

  setSpeed(speed) {
    this.speed = speed;
    at("speed").value = String(speed);
  }

  /** Follow the `swarm`, the selected `vehicle`, or see the whole `course`. */
  follow(what) {
    if (what === "vehicle" && this.selected === null) this.selected = this.episodes[0].inspected[0] ?? 0;
    this.camera.look(what);
    at("follow").value = what;
    this.render();
  }

  setTrails(shown) {
    this.trails = shown;
    at("trails").setAttribute("aria-pressed", String(shown));
    this.render();
  }

  /** Everything that depends on the colours and on the size of the page. */
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
      `${first.vehicles} vehicles, seed ${first.seed}, scenario version ${first.version}, uuv_marl`;
    at("waters").dataset.episodes = this.episodes.length;
    at("waters").append(...this.panels.map((panel) => panel.element));
    at("colour").append(...this.quantities.map((name) => new Option(QUANTITIES[name].label, name)));
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
    addEventListener("keydown", (event) => this.#key(event));
    this.panels.forEach((panel, k) => {
      const move = (change) => {
        change();
        this.render();
      };
      listen(panel.canvas, {
        pan: (right, down) => move(() => this.camera.pan(right, down, panel.view)),
        magnify: (factor, x, y) => move(() => this.camera.magnify(factor, panel.view, x, y)),
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

  #key(event) {
    const typing = event.target.matches("select, input[type=number]") || at("help").open;
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const sample = this.episodes[0].period_s;
    const magnify = (factor) => {
      this.camera.magnify(factor, this.panels[0].view);
      this.render();
    };
    const next = (all, now, step = 1) => all[(all.indexOf(now) + step + all.length) % all.length];
    const faster = (step) => SPEEDS[Math.min(Math.max(SPEEDS.indexOf(this.speed) + step, 0), SPEEDS.length - 1)];
    const keys = {
      " ": () => this.toggle(),
      ArrowRight: () => this.seek(this.time + (event.shiftKey ? 10 : sample)),
      ArrowLeft: () => this.seek(this.time - (event.shiftKey ? 10 : sample)),
      ArrowUp: () => this.setSpeed(faster(1)),
      ArrowDown: () => this.setSpeed(faster(-1)),
      Home: () => this.seek(0),
      End: () => this.seek(this.end),
      "+": () => magnify(1.25),
      "=": () => magnify(1.25),
      "-": () => magnify(0.8),
      f: () => this.follow(next(FOLLOW, this.camera.follow)),
      t: () => this.setTrails(!this.trails),
      c: () => this.setColour(next(this.quantities, this.scale?.quantity)),
      n: () => this.jump(true),
      p: () => this.jump(false),
      Escape: () => this.select(this.selectedEpisode, null),
      "?": () => at("help").showModal(),
    };
    if (!keys[event.key] || (event.key === " " && event.target.matches("button"))) return;
    event.preventDefault();
    keys[event.key]();
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
