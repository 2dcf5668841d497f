// Drives a Chromium without a network. On stdin JSON {chromium, folder, views: [{page, width, height, scheme, steps}]},
// a step being ["js", expression, name of its value], ["clickOn", expression of [x, y]], ["wheelOn", the same, turn],
// ["key", name] or ["picture", path, and the bytes that it has once all is drawn]; on stdout JSON, a view each:
// {values: by name, errors, requests}.
import { spawn } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";

const { chromium, folder, views } = JSON.parse(readFileSync(0, "utf8"));
const options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", "--no-first-run"];
const browser = spawn(chromium, [
  ...options, "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking", `--user-data-dir=${folder}`,
  "about:blank",
]);
const address = await new Promise((found, failed) => {
  let said = "";
  browser.stderr.on("data", (data) => {
    said += data;
    const match = said.match(/DevTools listening on (ws:\S+)/);
    if (match) found(match[1]);
  });
  browser.on("exit", () => failed(new Error(`${chromium} ended: ${said}`)));
});
const socket = new WebSocket(address);
await new Promise((opened) => socket.addEventListener("open", opened));

const answers = new Map();
let heard = () => {};
let count = 0;
socket.addEventListener("message", ({ data }) => {
  const message = JSON.parse(data);
  if (message.id) answers.get(message.id)(message);
  else heard(message);
});

async function send(method, params = {}, sessionId = undefined) {
  const id = ++count;
  const { error, result } = await new Promise((answer) => {
    answers.set(id, answer);
    socket.send(JSON.stringify({ id, method, params, sessionId }));
  });
  if (error) throw new Error(`${method}: ${error.message}`);
  return result;
}

async function show({ page, width, height, scheme, steps }) {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const tab = (method, params) => send(method, params, sessionId);
  const seen = { values: {}, errors: [], requests: [] };
  let loaded;
  const load = new Promise((done) => (loaded = done));
  heard = ({ method, params }) => {
    if (method === "Page.loadEventFired") loaded();
    if (method === "Runtime.exceptionThrown") seen.errors.push(params.exceptionDetails.exception?.description);
    if (method === "Runtime.consoleAPICalled") seen.errors.push(params.args.map((arg) => arg.value).join(" "));
    if (method === "Log.entryAdded") seen.errors.push(params.entry.text);
    if (method === "Network.requestWillBeSent") seen.requests.push(params.request.url);
  };
  for (const domain of ["Page", "Runtime", "Log", "Network"]) await tab(`${domain}.enable`);
  await tab("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 500 });
  await tab("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: scheme }] });
  await tab("Page.navigate", { url: page });
  await load;

  const js = async (expression) => {
    const { result, exceptionDetails } = await tab("Runtime.evaluate", {
      expression, awaitPromise: true, returnByValue: true,
    });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description}`);
    return result.value ?? null;
  };
  const mouse = (type, x, y) => tab("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
  const act = {
    js: async (expression, name) => {
      seen.values[name] = await js(expression);
    },
    click: async (x, y) => {
      await mouse("mousePressed", x, y);
      await mouse("mouseReleased", x, y);
    },
    clickOn: async (expression) => act.click(...(await js(expression))),
    wheelOn: async (expression, deltaY) => {
      const [x, y] = await js(expression);
      await tab("Input.dispatchMouseEvent", { type: "mouseWheel", x, y, deltaX: 0, deltaY });
    },
    key: async (key) => {
      const text = key.length === 1 ? key : undefined;
      const codes = { Tab: 9, ArrowRight: 39, " ": 32 };
      const pressed = { key, text, windowsVirtualKeyCode: codes[key] };
      await tab("Input.dispatchKeyEvent", { type: text ? "keyDown" : "rawKeyDown", ...pressed });
      await tab("Input.dispatchKeyEvent", { type: "keyUp", ...pressed });
    },
    picture: async (path, least = 0) => {
      const end = Date.now() + 20_000;
      let png = Buffer.alloc(0);
      do {
        await js("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))");
        png = Buffer.from((await tab("Page.captureScreenshot", { format: "png" })).data, "base64");
      } while (png.length < least && Date.now() < end);
      writeFileSync(path, png);
    },
  };
  for (const [kind, ...values] of steps) await act[kind](...values);
  await send("Target.closeTarget", { targetId });
  return seen;
}

const seen = [];
for (const view of views) seen.push(await show(view));
const gone = new Promise((closed) => socket.addEventListener("close", closed));
send("Browser.close"); // it may go without an answer
await gone;
console.log(JSON.stringify(seen));
