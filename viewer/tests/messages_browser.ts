// The live page with messages that the test sends instead of a service, for browser.ts.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import type { Browser, Page, WebSocketRoute } from "playwright-core";
import type { ModelData, Scene } from "../src/data";
import type { Point } from "../src/geometry";
import type { Frame, Hello, Message, Metrics, ModelMessage } from "../src/live_data";
import { text, type BrowserTest } from "./visit";

const scene = (known: boolean, origin: Point): Scene => ({ name: "", known, y_axis: "up", primary: 0, corners: [{ name: "1", origin, axis_1: [1, 0], axis_2: [0, 1], unit_m: [2, 2], widths_m: [2, 2] }] });
const model = (primitives: ModelData["primitives"]): ModelData => ({ size: primitives.length, tracks: 20, episodes: 1, interval_s: 0.4, grid: { cell: 1, origin: [0, 0], tile_cells: 8 }, primitives, transitions: [] });
const learnt = model([{ weight: 1, cells: [1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0] }]);
const hello = (known: boolean): Hello => ({ kind: "hello", sila: "0", scene: scene(known, [0, 0]), model: known ? learnt : model([]) });
const metrics = (predictions: number): Metrics => ({ kind: "metrics", horizons_s: [5], all: [], moving: [], nominal: [], coverage: [], scored_pedestrians: 0, novelty: 0, drift: { known: false, alarm: false, error_m: 0, reference_m: 0, half_width_m: 0 },
  detections: 0, predictions, dropped: 0, rejected: 0, scored: 0, pedestrians: 1, learning: false, tracks_waiting: 0, last_error: "", size: 1, episodes: 1, tracks: 20, learning_curve: "" });
const walker = ([x, y]: Point): Frame => ({ kind: "frame", count: 1, pedestrians: [{ id: "1:a", name: "a", trail: [x - 1, y, x, y], novelty: 0, fallback: false, modes: [{ weight: 1, path: [x + 3, y], primitives: [0] }] }] });

/** Opens the page; `connected` gives the connections in their order. */
async function live(browser: Browser, act: (page: Page, connected: (index: number) => Promise<(message: Message) => void>, close: () => Promise<void>) => Promise<void>): Promise<void> {
  const page = await browser.newPage();
  const complaints: string[] = [];
  page.on("pageerror", (error) => complaints.push(String(error)));
  const body = await readFile(new URL("../../dist/live.html", import.meta.url), "utf8");
  await page.route("http://sila.test/", (route) => route.fulfill({ contentType: "text/html", body }));
  const sockets: WebSocketRoute[] = [];
  await page.routeWebSocket("ws://sila.test/live", (socket) => { sockets.push(socket); });
  await page.goto("http://sila.test/");
  const connected = async (index: number): Promise<(message: Message) => void> => {
    for (let tries = 0; tries < 100 && !sockets[index]; ++tries) await page.waitForTimeout(50);
    return (message) => sockets[index]!.send(JSON.stringify(message));
  };
  await act(page, connected, () => sockets.at(-1)!.close());
  assert.deepEqual(complaints, []);
  await page.close();
}

/** From the pedestrian to the middle of the primitive, in widths of the primitive: the scale of the map follows what it shows. */
const apart = (page: Page): Promise<number> => page.evaluate(() => {
  const [primitive, person] = [".primitive", ".person"].map((name) => document.querySelector(name)!.getBoundingClientRect());
  return Math.hypot(primitive!.x + primitive!.width / 2 - person!.x - person!.width / 2, primitive!.y + primitive!.height / 2 - person!.y - person!.height / 2) / primitive!.width;
});

export const messageTests: BrowserTest[] = [
  ["draws live primitives where the model puts them, without a scene", (browser) => live(browser, async (page, connected) => {
    const send = await connected(0);
    send(hello(false));
    send(walker([105, 53]));  // the middle of the primitive
    const message: ModelMessage = { kind: "model", model: learnt, scene: scene(true, [100, 50]) };
    send(message);
    await page.waitForSelector(".primitive");
    assert.ok(await apart(page) < 0.2, "the primitive is where the pedestrian is");
    assert.ok(await page.locator(".curb").first().evaluate((curb) => curb.getBoundingClientRect().width > 0), "the curbs are drawn");
    // A scene that was given stays. Two primitives show that the last message was taken.
    send(hello(true));
    send(walker([5, 3]));
    send({ ...message, model: model([...learnt.primitives, ...learnt.primitives]) });
    await page.locator(".primitive").nth(1).waitFor();
    assert.ok(await apart(page) < 0.2, "the given scene stays");
  })],
  ["draws a pedestrian named NaN, and says if not all are drawn", (browser) => live(browser, async (page, connected) => {
    const send = await connected(0);
    send(hello(true));
    send({ ...walker([5, 3]), pedestrians: walker([5, 3]).pedestrians.map((one) => ({ ...one, name: "NaN" })) });
    await page.waitForSelector(".person");
    assert.equal(await text(page, "#undrawn"), "");
    send({ ...walker([5, 3]), count: 1234 });
    await page.waitForFunction(() => document.querySelector("#undrawn")!.textContent === "1 of 1,234 pedestrians are drawn.");
  })],
  ["names a live scene without a name", (browser) => live(browser, async (page, connected) => {
    (await connected(0))(hello(true));
    await page.waitForSelector("svg.place");
    assert.equal(await text(page, "h1"), "A scene without a name");
    assert.equal(await page.title(), "sila live: a scene without a name");
  })],
  ["shows an alarm and an error together, each change once", (browser) => live(browser, async (page, connected) => {
    const send = await connected(0);
    const alarming = { ...metrics(5), drift: { known: true, alarm: true, error_m: 1.5, reference_m: 0.8, half_width_m: 0.2 }, last_error: "disk full" };
    send(alarming);
    const alarm = page.locator("#alarm");
    await alarm.waitFor();
    assert.match(await alarm.innerText(), /^Drift: .* 1\.50 m, .* 0\.80 ± 0\.20 m\. An episode failed: disk full$/);
    const spoken = await alarm.evaluateHandle((element) => element.firstChild);
    send({ ...alarming, predictions: 6 });
    await page.waitForFunction(() => /6 predictions/.test(document.querySelector("#counters")!.textContent!));
    assert.ok(await alarm.evaluate((element, text) => element.firstChild === text, spoken), "the text is not set again");
    send(metrics(7));
    await alarm.waitFor({ state: "hidden" });
  })],
  ["connects again when the service is silent", (browser) => live(browser, async (page, connected) => {
    (await connected(0))(hello(true));
    await page.waitForTimeout(10_000);
    (await connected(1))({ ...hello(true), sila: "1" });
    await page.waitForFunction(() => document.querySelector("#state")?.textContent === "connected to sila 1");
  })],
  ["counts anew and keeps its check boxes when the service restarts", (browser) => live(browser, async (page, connected, close) => {
    const send = await connected(0);
    send(hello(true));
    send(metrics(1000));
    await page.getByLabel(/^primitives/).uncheck();
    await page.getByLabel(/^predicted paths/).uncheck();
    await close();
    const again = await connected(1);
    again(hello(true));
    again(metrics(5));
    again(walker([5, 3]));
    await page.waitForSelector(".person");
    assert.equal(await page.locator("g.primitives").getAttribute("visibility"), "hidden");
    assert.equal(await page.locator(".pedestrians .mode").count(), 0);
    await page.waitForTimeout(1100);
    again(metrics(1005));
    await page.waitForFunction(() => document.querySelector("#rate")?.textContent !== "–");
    const rate = Number((await text(page, "#rate")).replaceAll(",", ""));
    assert.ok(rate > 300 && rate <= 1000, `${rate} predictions a second`);
  })],
];
