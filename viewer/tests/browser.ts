// Opens reports and scene editors in a real Chromium, uses them by mouse and by keyboard, and takes pictures.
//   node build/browser/browser.mjs FOLDER
// FOLDER has report.html, picture.html (a report on a picture), results.html, editor.html and camera.html; what is saved there goes to FOLDER, pictures to FOLDER/pictures.
import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium, type Page } from "playwright-core";
import { changedTests } from "./changed_browser";
import { messageTests } from "./messages_browser";
import { tryTests } from "./try_browser";
import { cameraEditor, editor, folder, modelReport, nameless, picture, pictureReport, pictures, resultsReport, text, value, visiting, type BrowserTest } from "./visit";

/** u, v in the picture of made_up_camera.ts, x, y on the ground. */
const knownPoints = [[60, 690, -10, -10], [1220, 690, 14, -10], [860, 130, 14, 24], [420, 130, -10, 24]] as const;
/** Adds a point by a click on the picture. */
async function addAt(page: Page, u: number, v: number): Promise<void> {
  await page.locator("#add").click();
  await page.locator("svg.place").scrollIntoViewIfNeeded();
  const box = (await page.locator("svg.place image").boundingBox())!;
  await page.mouse.click(box.x + u / 1280 * box.width, box.y + v / 720 * box.height);
}

interface Saved { name: string; primary_corner: string; origin: [number, number]; axis_1: [number, number]; sidewalk_width_1_m: number; sidewalk_width_m: number; y_axis: string; camera?: { image_points: [number, number][]; ground_points: [number, number][] } }
const saved = async (page: Page): Promise<Saved> => JSON.parse(await page.locator("#json").inputValue()) as Saved;

/** Drags what is called so by pixels. */
async function drag(page: Page, name: string, dx: number, dy: number): Promise<void> {
  const handle = page.getByRole("button", { name });
  await handle.scrollIntoViewIfNeeded();
  const box = (await handle.locator(".touch").boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx / 2, y + dy / 2);
  await page.mouse.move(x + dx, y + dy);
  await page.mouse.up();
}

/** Downloads the scene. */
async function save(page: Page, name: string): Promise<void> {
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save").click()]);
  assert.ok(download.suggestedFilename().endsWith(".json"));
  await download.saveAs(join(folder, name));
  assert.equal(await readFile(join(folder, name), "utf8"), await page.locator("#json").inputValue());
}

const tests: BrowserTest[] = [
  ["has every section and says what it shows", (browser) => visiting(browser, modelReport, {}, async (page) => {
    for (const id of ["learnt", "predictions", "try", "accuracy", "learning", "worst", "made"]) assert.equal(await page.locator(`section#${id}`).count(), 1, id);
    assert.ok(await page.locator(".primitive").count() > 10);
    assert.ok(await page.locator(".tracks").first().getAttribute("d"));
    for (const layer of [".grid", ".axis", ".walk", ".curb"]) assert.ok(await page.locator(`#learnt ${layer}`).count() > 0, layer);
    assert.ok(await page.locator("#accuracy .chart svg").count() >= 2);
    assert.deepEqual(await page.locator("#accuracy .mark").allTextContents(), ["●", "■", "▲"], "not colours alone");
    assert.match(await text(page, "#accuracy .lead"), /50 % region covered \d+ %/);
    assert.match(await text(page, "#learning"), /with \d+ more expect 0\.\d+/);
    assert.ok(await page.locator("#reliability tbody tr").count() >= 10);  // start, stop, and where, each at several horizons
    await picture(page, "desktop", true);
  })],
  ["makes the picture of the README", (browser) => visiting(browser, modelReport, { width: 1000, height: 620 }, async (page) => {
    await page.locator("#learnt .two").screenshot({ path: join(pictures, "readme.png") });
    const bytes = (await readFile(join(pictures, "readme.png"))).length;
    assert.ok(bytes <= 300_000, `${bytes} bytes are too many for a file of this project`);
  })],
  ["follows the episodes by slider, by keyboard and by mouse", (browser) => visiting(browser, modelReport, {}, async (page) => {
    const last = await value(page, "#episode");
    assert.ok(last >= 3);
    const all = await page.locator("#learnt .primitive").count();
    await page.locator("#episode").focus();
    await page.keyboard.press("Home");
    assert.match(await text(page, "#episode-words"), /^Episode 1 of/);
    const early = await page.locator("#learnt .primitive").count();
    assert.ok(early > 0 && early < all, `${early} primitives at first, ${all} at last`);
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    assert.match(await text(page, "#episode-words"), /^Episode 3 of.*added.*fused.*split/s);
    assert.ok(await page.locator("#learnt .primitive.strong").count() > 0, "what the episode changed stands out");
    await page.locator("#learnt").scrollIntoViewIfNeeded();
    await picture(page, "episode");
    await page.locator(".strip button").nth(1).click();
    assert.equal(await value(page, "#episode"), 1);
    await page.getByRole("button", { name: "Whole model" }).click();
    assert.equal(await value(page, "#episode"), last);
    assert.equal(await page.locator("#learnt .primitive.strong").count(), 0);
    await page.locator("#grow").click();
    await page.waitForTimeout(1200);
    const moved = await value(page, "#episode");
    assert.ok(moved >= 0 && moved < last, "it grows from the first episode on");
  })],
  ["joins map, graph and list", (browser) => visiting(browser, modelReport, {}, async (page) => {
    await page.locator(".node").nth(3).click();
    assert.match(await text(page, "#primitive-card"), /^Primitive 3/);
    assert.equal(await page.locator("#learnt .primitive.strong").count(), 1);
    assert.equal(await page.locator("#primitive").inputValue(), "3");
    assert.ok(await page.locator(".edge-count").count() > 0, "counts at the transitions of the chosen primitive");
    await picture(page, "primitive");
    await page.locator("#primitive").focus();
    await page.keyboard.press("ArrowDown");
    assert.match(await text(page, "#primitive-card"), /^Primitive 4/);
    await page.locator("#primitive").selectOption("");
    assert.equal(await page.locator("#learnt .primitive.strong").count(), 0);
  })],
  ["zooms by button and by keyboard", (browser) => visiting(browser, modelReport, {}, async (page) => {
    const map = page.locator("#learnt svg.place");
    const scale = (): Promise<string | null> => page.locator("#learnt .scale path").getAttribute("d");
    const before = await scale();
    await page.locator("#learnt .zoom button").first().click();
    const closer = await scale();
    assert.notEqual(closer, before);
    await map.focus();
    await page.keyboard.press("0");
    assert.equal(await scale(), before);
    await page.keyboard.press("+");
    assert.equal(await scale(), closer);
  })],
  ["plays predictions in time", (browser) => visiting(browser, modelReport, {}, async (page) => {
    assert.ok(await page.locator("#predictions .mode").count() > 0);
    assert.ok(await page.locator("#predictions .ellipse").count() > 0);
    assert.deepEqual((await page.locator("#predictions .share").allTextContents()).sort(), ["50 % inside", "90 % inside"]);
    assert.equal(await page.locator("#predictions .constant").count(), 1);
    assert.match(await text(page, "#readout"), /s ahead.*constant velocity by/);
    const before = await value(page, "#time");
    await page.locator("#play").click();
    await page.waitForTimeout(700);
    await page.locator("#play").click();
    const after = await value(page, "#time");
    assert.ok(after > before + 0.2 && after < before + 3, `${before} s to ${after} s`);
    await page.waitForTimeout(200);
    assert.equal(await value(page, "#time"), after, "it stands still when paused");
    await page.getByLabel("50 % and 90 % ellipses").uncheck();
    assert.equal(await page.locator("#predictions .ellipse").count(), 0);
  })],
  ["plays by keyboard alone", (browser) => visiting(browser, modelReport, {}, async (page) => {
    const person = (): Promise<string> => page.locator("#pedestrian").inputValue();
    await page.locator("#predictions svg.place").focus();
    const first = await person();
    await page.keyboard.press("ArrowDown");
    assert.notEqual(await person(), first);
    await page.keyboard.press("ArrowUp");
    assert.equal(await person(), first);
    const before = await value(page, "#time");
    await page.keyboard.press("ArrowRight");
    assert.ok(Math.abs(await value(page, "#time") - before - 0.2) < 0.06);
    await page.keyboard.press("Space");
    await page.waitForTimeout(500);
    await page.keyboard.press("Space");
    assert.ok(await value(page, "#time") > before + 0.3);
    assert.deepEqual(await nameless(page), []);
  })],
  ["leads from the worst to their predictions", (browser) => visiting(browser, modelReport, {}, async (page) => {
    const item = page.locator("#worst li").nth(1);
    const id = /Pedestrian (\S+) at/.exec(await item.innerText())?.[1];
    assert.ok(id);
    await item.getByRole("button").click();
    assert.equal(await page.locator("#pedestrian").inputValue(), id);
    const stated = /weighted MHD ([\d.]+) m/;
    const [listed, shown] = [stated.exec(await item.innerText())?.[1], stated.exec(await text(page, "#readout"))?.[1]];
    assert.ok(listed && listed === shown, `the shown prediction has ${shown} m, the worst one ${listed} m`);
    await page.waitForTimeout(200);
    await picture(page, "worst");
  })],
  ["finds configuration values", (browser) => visiting(browser, modelReport, {}, async (page) => {
    await page.locator("#made summary").click();
    await page.locator("#filter").fill("similarity_threshold");
    assert.equal(await page.locator(".settings tr").count(), 1);
    assert.match(await text(page, ".settings"), /fuse\.similarity_threshold/);
  })],
  ["is readable in the dark", (browser) => visiting(browser, modelReport, { dark: true }, async (page) => {
    assert.ok(await contrast(page, ".lead") >= 4.5, "quiet text");
    assert.ok(await contrast(page, "h2") >= 7, "titles");
    await picture(page, "dark", true);
    await page.locator("#theme").click();
    assert.ok(await contrast(page, ".lead") >= 4.5, "quiet text in light colours");
    assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), "rgb(246, 246, 243)");
  })],
  ["fits a phone", (browser) => visiting(browser, modelReport, { width: 390, height: 844, touch: true }, async (page) => {
    const [inner, outer] = await page.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth] as const);
    assert.ok(inner <= outer, `${inner} px on a screen of ${outer} px`);
    await picture(page, "phone", true);
    await page.locator("#predictions").scrollIntoViewIfNeeded();
    await page.locator("#play").tap();
    await page.waitForTimeout(500);
    await page.locator("#play").tap();
    await picture(page, "phone-predictions");
  })],
  ...tryTests,
  ["draws predictions on a picture", (browser) => visiting(browser, pictureReport, {}, async (page) => {
    const image = (await page.locator("#predictions svg.place image").boundingBox())!;
    const person = (await page.locator("#predictions .person").boundingBox())!;
    assert.ok(person.x > image.x && person.y > image.y && person.x + person.width < image.x + image.width && person.y + person.height < image.y + image.height, "the pedestrian is in the picture");
    for (const shape of [".mode", ".ellipse", ".constant", ".past"]) assert.ok(await page.locator(`#predictions ${shape}`).count() > 0, shape);
    assert.equal(await page.locator("#predictions .walk").count(), 0);
    assert.ok(await page.locator("#learnt .walk").count() > 0, "the other map is as without a picture");
    await page.locator("#predictions").scrollIntoViewIfNeeded();
    await page.locator("#predictions").screenshot({ path: join(pictures, "on-picture.png") });
    await page.locator("#predictions .zoom button").nth(1).click();
    assert.ok((await page.locator("#predictions svg.place image").boundingBox())!.width < image.width);
  })],
  ["shows the results of an experiment", (browser) => visiting(browser, resultsReport, {}, async (page) => {
    assert.equal(await page.locator("section#learning").count(), 1);
    assert.ok(await page.locator("#learning .chart svg").count() >= 3);
    await picture(page, "results", true);
  })],
  ["moves a corner, turns its axes and pulls its widths", (browser) => visiting(browser, editor, {}, async (page) => {
    const before = await saved(page);
    const bar = await page.locator(".scale path").getAttribute("d");
    const perPixel = Number((await page.locator(".scale text").textContent())!.split(" ")[0]) / (Number(/H([\d.]+)/.exec(bar!)![1]) - 14);
    await drag(page, "Corner;", 30, -12);
    const after = await saved(page);
    for (const [axis, metres] of [[0, 30 * perPixel], [1, 12 * perPixel]] as const) assert.ok(Math.abs(after.origin[axis] - before.origin[axis] - metres) < 0.002, `axis ${axis} moved by ${after.origin[axis] - before.origin[axis]} m instead of ${metres} m`);
    assert.deepEqual(after.axis_1, before.axis_1);
    await drag(page, "Axis 1", 0, -40);
    const turn = Math.atan2(...(await saved(page)).axis_1.reverse() as [number, number]) - Math.atan2(before.axis_1[1], before.axis_1[0]);
    assert.ok(turn > 0.1 && turn < 0.6, `turned by ${turn} rad`);
    await drag(page, "Width of sidewalk 1", -10, -40);
    const wide = await saved(page);
    assert.ok(wide.sidewalk_width_1_m > before.sidewalk_width_1_m + 20 * perPixel, `${wide.sidewalk_width_1_m} m`);
    assert.ok(await page.locator(".tracks").last().getAttribute("d"));
    await picture(page, "editor", true);
    await save(page, "edited.scene.json");
  })],
  ["edits by keyboard alone", (browser) => visiting(browser, editor, {}, async (page) => {
    const before = await saved(page);
    await page.getByRole("button", { name: "Corner;" }).focus();
    await page.keyboard.press("ArrowRight");
    assert.ok((await saved(page)).origin[0] > before.origin[0]);
    await page.getByLabel("x [m]", { exact: true }).fill("7.25");
    await page.getByLabel("Heading of axis 1 [degrees]").fill("30");
    await page.getByLabel("Width of sidewalk 1 [m]").fill("4");
    await page.getByLabel("Name of the corner").fill("north");
    await page.getByLabel("Name of the place").fill("gate 4");
    const after = await saved(page);
    assert.deepEqual([after.origin[0], after.axis_1, after.sidewalk_width_1_m, after.primary_corner, after.name], [7.25, [0.866025, 0.5], 4, "north", "gate 4"]);
    await page.getByLabel("Heading of axis 2 [degrees]").fill("35");
    assert.match(await text(page, "#state"), /20\.5 to 159\.5 degrees/);
    assert.deepEqual(await nameless(page), []);
  })],
  ["sets a camera by clicks on a picture and the places of the points", (browser) => visiting(browser, cameraEditor, {}, async (page) => {
    assert.ok(await page.locator("#save").isDisabled(), "without a camera there is no corner to save");
    assert.equal(await page.locator("#json").inputValue(), "");
    const add = async (u: number, v: number, x: number, y: number): Promise<void> => {
      await addAt(page, u, v);
      const row = page.locator("#points tr").last();
      await row.getByLabel(": x").fill(String(x));
      await row.getByLabel(": y").fill(String(y));
    };
    for (const [u, v, x, y] of knownPoints) await add(u, v, x, y);
    assert.match(await text(page, "#camera-state"), /fits 4 points exactly/);
    const { camera, y_axis } = await saved(page);
    assert.equal(y_axis, "up");
    knownPoints.forEach(([u, v, x, y], i) => {
      const [a, b] = camera!.image_points[i]!;
      assert.ok(Math.hypot(a - u, b - v) < 3, `point ${i + 1} at ${a}, ${b}`);
      assert.deepEqual(camera!.ground_points[i], [x, y]);
    });
    await page.getByLabel("x [m]", { exact: true }).fill("5");
    await page.getByLabel("y [m]", { exact: true }).fill("4");
    assert.deepEqual((await saved(page)).origin, [5, 4]);
    await picture(page, "editor-camera", true);
    await drag(page, "Corner;", 40, 0);
    assert.ok((await saved(page)).origin[0] > 5.3);
    await page.getByRole("button", { name: "Corner;" }).focus();
    for (let i = 0; i < 20; ++i) await page.keyboard.press("ArrowLeft");
    assert.ok(Math.hypot((await saved(page)).origin[0] - 5, (await saved(page)).origin[1] - 4) < 0.05, "back where it was");
    await save(page, "camera.scene.json");
    await add(640, 400, 2, 9);
    assert.match(await text(page, "#camera-state"), /fits 5 points within [\d.]+ m/);
    assert.match(await page.locator(".residual").last().innerText(), /^[\d.]+ m$/);
    await page.getByRole("button", { name: "Remove point 5" }).click();
    await page.getByLabel("Point 1: x").fill("");
    assert.match(await text(page, "#camera-state"), /no camera yet: 3 of 4 points/);
    assert.deepEqual(await nameless(page), []);
  })],
  ["sets a camera by the distances between clicked points", (browser) => visiting(browser, cameraEditor, {}, async (page) => {
    for (const [u, v] of knownPoints) await addAt(page, u, v);
    const type = (pair: string, length: number | ""): Promise<void> => page.getByLabel(`${pair} [m]`, { exact: true }).fill(String(length));
    const diagonal = Math.hypot(24, 34);
    for (const [pair, length] of [["1 to 2", 24], ["2 to 3", 34], ["3 to 4", 24], ["1 to 4", 34]] as const) await type(pair, length);
    assert.equal(await text(page, "#distance-state"), "Point 3 needs its distances to two other points.");
    await type("1 to 3", diagonal);
    assert.match(await text(page, "#distance-state"), /^The distances place the points/);
    assert.match(await text(page, "#camera-state"), /fits 4 points exactly/);
    const { camera, y_axis } = await saved(page);
    assert.deepEqual([y_axis, camera!.ground_points], ["up", [[0, 0], [24, 0], [24, 34], [0, 34]]]);
    await type("2 to 4", diagonal + 0.3);
    assert.match(await text(page, "#distance-state"), /^The distances agree within 0\.0\d m\.$/);
    await picture(page, "editor-distances", true);
    await type("1 to 3", 70);
    assert.equal(await text(page, "#distance-state"), "The distances contradict one another: points 1 and 3 are 70 m apart, but only 58 m by way of point 2.");
    await type("1 to 3", "");
    assert.match(await text(page, "#distance-state"), /^The distances place the points/);
    await page.getByRole("button", { name: "Remove point 2" }).click();
    assert.equal(await page.locator("#distances input").count(), 3);
    assert.equal(await page.getByLabel("2 to 3 [m]", { exact: true }).inputValue(), "24", "the distances of the others stay");
    assert.deepEqual(await nameless(page), []);
  })],
  ...changedTests,
  ...messageTests,
  ["says so when there are no data, or strange ones", async (browser) => {
    const template = await readFile(new URL("../../dist/report.html", import.meta.url), "utf8");
    const file = join(pictures, "empty.html");
    await writeFile(file, template);
    const page = await browser.newPage();
    await page.goto(pathToFileURL(file).href);
    assert.match(await text(page, ".failure"), /no data inside/);
    await page.close();
  }],
];

/** Contrast of the text of an element with what is behind it, as WCAG defines it. */
function contrast(page: Page, selector: string): Promise<number> {
  return page.locator(selector).first().evaluate((element) => {
    const parse = (colour: string): number[] => (colour.match(/[\d.]+/g) ?? []).map(Number);
    const light = (colour: number[]): number => {
      const [r, g, b] = colour.slice(0, 3).map((c) => (c / 255 <= 0.03928 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;
    };
    let behind: Element | null = element;
    let back = [255, 255, 255];
    for (; behind; behind = behind.parentElement) {
      const colour = parse(getComputedStyle(behind).backgroundColor);
      if (colour.length === 3) { back = colour; break; }
    }
    const [a, b] = [light(parse(getComputedStyle(element).color)), light(back)];
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  });
}

await mkdir(pictures, { recursive: true });
const size = (await readFile(modelReport)).length;
assert.ok(size < 4_000_000, `the report has ${size} bytes`);
const browser = await chromium.launch({ executablePath: process.env["SILA_CHROMIUM"] ?? "/usr/bin/chromium", args: process.getuid?.() === 0 ? ["--no-sandbox"] : [] });
let failed = 0;
for (const [name, run] of tests) {
  const started = performance.now();
  try {
    await run(browser);
    console.log(`pass  it ${name} (${((performance.now() - started) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    console.log(`FAIL  it ${name}\n${error instanceof Error ? error.stack : String(error)}`);
  }
}
await browser.close();
process.exitCode = failed > 0 ? 1 : 0;
