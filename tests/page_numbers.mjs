// What the replay page's own modules read from a page: node page_numbers.mjs PAGE TIME... prints JSON, by episode and time.
import { readFileSync } from "node:fs";
import { decodeEpisodes } from "../uuv_marl/replay/decode.js";
import { flowAt } from "../uuv_marl/replay/page/current.js";
import { Episode } from "../uuv_marl/replay/page/episode.js";
import { detections } from "../uuv_marl/replay/page/sonar.js";
import { jumps } from "../uuv_marl/replay/page/timeline.js";

const [page, ...times] = process.argv.slice(2);
const payload = readFileSync(page, "utf8").match(/<script type="application\/json" id="episodes">(.*?)<\/script>/s)[1];
const episodes = (await decodeEpisodes(JSON.parse(payload))).map((decoded) => new Episode(decoded));
const flow = (episode, sample, poses) =>
  Array.from({ length: poses.length / 3 }, (_, i) => flowAt(episode, sample, poses[3 * i], poses[3 * i + 1]));
const read = (episode, time) => ({
  ...episode.numbers(time),
  poses: [...episode.poses(time)],
  discs: [...episode.discs(time)],
  references: episode.paths.map((_, path) => episode.reference(time, path)),
  marks: [...episode.marks(time)],
  flow: episode.current && flow(episode, episode.sampleAt(time), episode.poses(time)),
  hearing: episode.inspected.map((_, rank) => detections(episode, rank, episode.sampleAt(time))),
});
const numbers = episodes.map((episode) => times.map((time) => read(episode, Number(time))));
console.log(JSON.stringify({ numbers, jumps: jumps(episodes).map((jump) => jump.time) }));
