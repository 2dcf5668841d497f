/** The selected vehicle: its numbers, and which vehicle it detects in every sub-sector. */
import { make } from "./panel.js";
import { detections } from "./sonar.js";

/** Write it into the page; `choose` is called with the vehicle that the reader types. */
export function showVehicle(place, episode, vehicle, time, choose) {
  const input = place.querySelector("input") ?? numberField(place, episode, choose);
  if (document.activeElement !== input) input.value = vehicle ?? "";
  place.querySelector(".badge").textContent = episode.policy;
  const body = place.querySelector("div");
  body.replaceChildren(...(vehicle === null ? [hint()] : details(episode, vehicle, episode.sampleAt(time))));
}

function numberField(place, episode, choose) {
  const input = make("input", { type: "number", min: 0, max: episode.vehicles - 1, id: "vehicle-number" });
  input.addEventListener("change", () => choose(input.value === "" ? null : Number(input.value)));
  const label = make("label", { htmlFor: "vehicle-number" }, make("h2", {}, "UUV"));
  place.replaceChildren(make("div", {}), "");
  place.prepend(make("header", { className: "row" }, label, input, make("span", { className: "badge" })));
  place.querySelector("header").style.padding = "0";
  return input;
}

function hint() {
  return make("p", {}, "Click a vehicle, or Tab to one whose sonar was recorded.");
}

function details(episode, vehicle, sample) {
  if (episode.isLost(vehicle, sample)) return [make("p", {}, "lost: it is silent, and no vehicle detects it")];
  const at = sample * episode.vehicles + vehicle;
  const value = (name, digits, unit, factor = 1) => {
    const number = episode.values(name)?.[at];
    return Number.isFinite(number) ? `${(number * factor).toFixed(digits)} ${unit}` : "–";
  };
  const degrees = ((episode.values("heading")[at] * 180) / Math.PI + 360) % 360;
  const rows = [
    ["speed", value("speed", 1, "m/s")],
    ["heading", `${degrees.toFixed(0)}°`],
    ["spacing", value("spacing", 1, "m")],
    ["force", value("force", 0, "%", 100)],
  ];
  if (episode.hasTeams) rows.unshift(["group", episode.team[vehicle] + 1]);
  if (episode.uninformed.includes(vehicle)) rows.push(["l(t)", "not perceived"]);
  const list = make("dl", {}, ...rows.flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]));
  const inspected = episode.inspected.indexOf(vehicle);
  if (inspected < 0) return [list, make("p", {}, `Its sonar was not recorded; --inspect ${vehicle} records it.`)];
  return [list, ...arrays(episode, inspected, sample)];
}

/** A row of sub-sectors for each array, from port to starboard: the vehicle that it detects, its distance, an echo. */
function arrays(episode, inspected, sample) {
  const sectors = detections(episode, inspected, sample);
  return episode.sonar.map((array) => {
    const cells = sectors.filter((sector) => sector.array === array).map(sectorCell);
    const row = make("div", { className: "sectors" }, ...cells);
    row.style.setProperty("--kind", array.active ? "var(--active)" : "var(--passive)");
    const title = `${array.name}, ${array.active ? "active" : "passive"}, ${array.range_m} m`;
    return make("div", { className: "array" }, make("h3", {}, title), row);
  });
}

function sectorCell({ detected, distance, echo }) {
  const cell = make("div", {}, detected >= 0 ? String(detected) : "·");
  cell.append(make("small", {}, detected >= 0 ? `${distance.toFixed(0)} m` : echo > 0 ? `${echo.toFixed(0)} m` : " "));
  cell.classList.toggle("detected", detected >= 0);
  cell.classList.toggle("echo", echo > 0);
  cell.title = [detected >= 0 && `detects UUV ${detected} at ${distance.toFixed(1)} m`, echo > 0 && `echo at ${echo.toFixed(1)} m`]
    .filter(Boolean).join("; ");
  return cell;
}
