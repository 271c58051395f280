// Reports and scene editors with other data than those of the folder, for browser.ts.
import assert from "node:assert/strict";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import type { Page } from "playwright-core";
import type { EditorData, ReportData } from "../src/data";
import { cameraEditor, editor, modelReport, pictures, text, visiting, type BrowserTest } from "./visit";

/** A copy of a page whose data are changed. */
async function changed<Data>(file: string, name: string, change: (data: Data) => void): Promise<string> {
  const [before, json, after] = (await readFile(file, "utf8")).split(/(?<=<script id="data" type="application\/json">)(.*?)(?=<\/script>)/s) as [string, string, string];
  const data = JSON.parse(json) as Data;
  change(data);
  const copy = join(pictures, name);
  await writeFile(copy, before + JSON.stringify(data).replaceAll("<", "\\u003c") + after);
  return copy;
}

interface Saved { origin: [number, number]; axis_1: [number, number]; axis_2: [number, number]; y_axis: string; sidewalk_width_1_m: number; origin_uncertainty_m?: number }
const saved = async (page: Page): Promise<Saved> => JSON.parse(await page.locator("#json").inputValue()) as Saved;

/** Whether a handle of the editor is on its map. */
async function onMap(page: Page, name: string): Promise<boolean> {
  const [map, handle] = [(await page.locator("svg.place").boundingBox())!, (await page.getByRole("button", { name }).locator(".touch").boundingBox())!];
  const [x, y] = [handle.x + handle.width / 2, handle.y + handle.height / 2];
  return x > map.x && y > map.y && x < map.x + map.width && y < map.y + map.height;
}

export const changedTests: BrowserTest[] = [
  ["names the model where the scene has no name", async (browser) => {
    const file = await changed<ReportData>(modelReport, "nameless.html", (data) => { data.scene!.name = ""; data.name = "corner.sila"; });
    await visiting(browser, file, {}, async (page) => {
      assert.equal(await text(page, "h1"), "corner.sila");
      assert.equal(await page.title(), "sila: corner.sila");
    });
  }],
  ["fits small phones with long names", async (browser) => {
    const file = await changed<ReportData>(modelReport, "long.html", (data) => {
      data.scene!.name = "intersection_of_the_northern_recordings";
      for (const list of [data.played!, data.worst!]) for (const one of list) one.track = `stopping/466_${one.track}.csv`;
    });
    for (const width of [320, 360, 380]) await visiting(browser, file, { width, height: 700 }, async (page) => {
      const inner = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(inner <= width, `${inner} px on a screen of ${width} px`);
      assert.deepEqual(await page.$$eval("section select", (all) => all.filter((list) => list.getBoundingClientRect().right > list.closest("section")!.getBoundingClientRect().right).map((list) => list.outerHTML)), [], "lists stay in their sections");
    });
  }],
  ["fits a phone with hundreds of episodes", async (browser) => {
    const file = await changed<ReportData>(modelReport, "episodes.html", ({ model, episodes }) => {
      const n = model!.primitives.length;
      const change = { before: n, after: n, gone: [], added: [], fused: [], split: [], incoming_split: 0, transitions: [], transitions_gone: [] };
      for (let i = 0; i < 800; ++i) episodes!.push({ ...episodes!.at(-1)!, number: episodes!.length + 1, statistics: { change } });
    });
    await visiting(browser, file, { width: 390, height: 844 }, async (page) => {
      assert.ok(await page.locator(".strip button").count() > 800);
      const inner = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(inner <= 390, `${inner} px on a screen of 390 px`);
    });
  }],
  ["shows a corner that is far from the tracks", async (browser) => {
    const file = await changed<EditorData>(editor, "far.html", (data) => { Object.assign(data.file, { origin_uncertainty_m: 0.5 }).corners[0]!.origin = [150, -90]; });
    await visiting(browser, file, {}, async (page) => {
      assert.ok(await onMap(page, "Corner;"), "at first");
      await page.locator(".zoom button").first().click();
      await page.getByRole("button", { name: "Whole place" }).click();
      assert.ok(await onMap(page, "Corner;"), "of the whole place");
      assert.equal((await saved(page)).origin_uncertainty_m, 0.5);
      await page.getByLabel("x [m]", { exact: true }).fill("140");
      assert.equal((await saved(page)).origin_uncertainty_m, undefined, "that of the corner before");
    });
  }],
  ["shows what is saved once a field is left", (browser) => visiting(browser, editor, {}, async (page) => {
    const width = page.getByLabel("Width of sidewalk 1 [m]");
    await width.fill("0.1");
    await width.blur();
    assert.equal((await saved(page)).sidewalk_width_1_m, 0.3);
    assert.equal(await width.inputValue(), "0.3");
    await width.fill("");
    await width.blur();
    assert.equal(await width.inputValue(), "0.3");
  })],
  ["moves the first corner with the camera until it is edited", (browser) => visiting(browser, cameraEditor, {}, async (page) => {
    const points = [[60, 690, -10, -10], [1220, 690, 14, -10], [860, 130, 14, 24], [420, 130, -10, 24]] as const;
    for (const [i, [u, v, x, y]] of points.entries()) {
      await page.locator("#add").click();
      await page.locator("svg.place").scrollIntoViewIfNeeded();
      const box = (await page.locator("svg.place image").boundingBox())!;
      await page.mouse.click(box.x + u / 1280 * box.width, box.y + v / 720 * box.height);
      for (const [name, length] of [["x", x], ["y", y]] as const) await page.getByLabel(`Point ${i + 1}: ${name}`).pressSequentially(String(length));
    }
    const whole = await saved(page);
    const last = page.getByLabel("Point 4: y");
    await last.fill("2");  // the first fit while the number is typed
    assert.notDeepEqual((await saved(page)).origin, whole.origin);
    await page.getByLabel("Name of the corner").fill("north");
    await last.fill("24");
    assert.deepEqual((await saved(page)).origin, whole.origin);
    assert.equal(await page.getByLabel("Name of the corner").inputValue(), "north");
    await page.getByLabel("x [m]", { exact: true }).fill("5");
    await last.fill("25");
    assert.equal((await saved(page)).origin[0], 5, "an edited corner stays");
  })],
  ["knows from a camera that looks straight down that y points down", async (browser) => {
    const file = await changed<EditorData>(cameraEditor, "down.html", (data) => { data.camera = [0.05, 0, 0, 0, 0.05, 0, 0, 0, 1]; });
    await visiting(browser, file, {}, async (page) => {
      const { y_axis, axis_1, axis_2 } = await saved(page);
      assert.equal(y_axis, "down");
      assert.ok(axis_1[0] * axis_2[1] - axis_1[1] * axis_2[0] < 0, "axis 2 is counter-clockwise of axis 1, seen from above");
      assert.equal(await text(page, "#state"), "");
    });
  }],
];
