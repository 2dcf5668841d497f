/** Colours: those of page.css for the canvas, and the scale that shows a vehicle's spacing, speed or force. */

const STEPS = 24;

/** What colours can show. Small spacings stand out, as do large speeds and forces. */
export const QUANTITIES = {
  spacing: { label: "Spacing", unit: "m", factor: 1, smallStandsOut: true },
  speed: { label: "Speed", unit: "m/s", factor: 1, smallStandsOut: false },
  force: { label: "Force", unit: "%", factor: 100, smallStandsOut: false },
};

/** The quantities that these episodes hold. */
export function shownQuantities(episodes) {
  return Object.keys(QUANTITIES).filter((name) => episodes.every((episode) => episode.values(name)));
}

/** The page's colours as the browser resolves them now, by the name of their CSS variable; `scale` has all steps, `teams` a colour each. */
export function resolvePalette(names) {
  const probe = document.body.appendChild(document.createElement("i"));
  const resolve = (name) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
  const palette = Object.fromEntries(names.map((name) => [name, resolve(name)]));
  const stops = [0, 1, 2, 3, 4].map((k) => resolve(`scale-${k}`).match(/[\d.]+/g).map(Number));
  const teams = ["series-0", "series-2", "series-3", "ink"].map(resolve);
  probe.remove();
  return { ...palette, teams, scale: Array.from({ length: STEPS }, (_, k) => mix(stops, k / (STEPS - 1))) };
}

/** How a quantity becomes a step of the scale: `low` and `high` [its unit] bound it, for all episodes alike. */
export class Scale {
  constructor(quantity, episodes) {
    Object.assign(this, QUANTITIES[quantity], { quantity, low: 0, high: 1 });
    if (quantity === "spacing") this.low = 2 * episodes[0].hull_radius_m;
    if (quantity !== "force") {
      this.high = Math.max(...episodes.map((episode) => commonMost(episode.values(quantity))), this.low + 1);
    }
  }

  /** Step of a value, from 0, which is quiet, to the one that stands out; NaN is quiet. */
  step(value) {
    const share = (value - this.low) / (this.high - this.low) || 0;
    const clear = Math.min(Math.max(this.smallStandsOut ? 1 - share : share, 0), 1);
    return Math.round(clear * (STEPS - 1));
  }
}

/** What nine of ten values lie below. */
function commonMost(values) {
  const stride = Math.ceil(values.length / 20000);
  const some = [];
  for (let k = 0; k < values.length; k += stride) if (Number.isFinite(values[k])) some.push(values[k]);
  some.sort((a, b) => a - b);
  return some.length ? some[Math.floor(0.9 * some.length)] : 1;
}

function mix(stops, share) {
  const at = share * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  const channels = stops[k].map((channel, c) => Math.round(channel + (at - k) * (stops[k + 1][c] - channel)));
  return `rgb(${channels.join(" ")})`;
}
