// Opens the live page of a running `sila serve` in a real Chromium, looks at it while a recording is replayed, and takes pictures.
//   node build/browser/live_browser.mjs http://127.0.0.1:PORT/ PICTURES [picture]     picture: the service has --picture
import assert from "node:assert/strict";
import { mkdir } from "node:fs/promises";
import { join, resolve } from "node:path";
import { chromium, type Browser, type Page } from "playwright-core";

const [address, folder, mode] = process.argv.slice(2);
assert.ok(address && folder, "the address of the page and a folder for pictures are needed");
const pictures = resolve(folder);

interface Visit { width?: number; height?: number; dark?: boolean; touch?: boolean }

/** Opens the page and fails if it logs an error or loads from another host. */
async function visiting(browser: Browser, { width = 1280, height = 900, dark = false, touch = false }: Visit, act: (page: Page) => Promise<void>): Promise<void> {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: dark ? "dark" : "light", hasTouch: touch, isMobile: touch, deviceScaleFactor: touch ? 2 : 1, reducedMotion: "reduce" });
  const page = await context.newPage();
  const complaints: string[] = [];
  page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => { if (new URL(request.url()).host !== new URL(address!).host && !request.url().startsWith("data:")) complaints.push(`asks for ${request.url()}`); });
  await page.goto(address!);
  await page.waitForSelector("svg.place");
  await act(page);
  assert.deepEqual(complaints, [], "the page logs an error or loads from elsewhere");
  await context.close();
}

const number = async (page: Page, selector: string): Promise<number> => Number((await page.locator(selector).innerText()).replace(/[^0-9.]/g, ""));
const pedestrians = (page: Page): Promise<string> => page.locator(".pedestrians .person").evaluateAll((all) => all.map((p) => `${p.getAttribute("cx")},${p.getAttribute("cy")}`).join(" "));
const picture = (page: Page, name: string, fullPage = false): Promise<Buffer> => page.screenshot({ path: join(pictures, `${name}.png`), fullPage });

const tests: [string, (browser: Browser) => Promise<void>][] = [
  ["shows moving pedestrians, with predicted paths and highlighted primitives", (browser) => visiting(browser, {}, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll(".pedestrians .mode").length > 5, undefined, { timeout: 60_000 });
    await page.waitForFunction(() => document.querySelectorAll(".primitive.lit").length > 0, undefined, { timeout: 60_000 });
    const before = await pedestrians(page);
    await page.waitForTimeout(1500);
    assert.notEqual(await pedestrians(page), before, "pedestrians move");
    assert.match(await page.locator("#state").innerText(), /^connected to sila/);
    await page.getByLabel(/^predicted paths/).uncheck();
    assert.equal(await page.locator(".pedestrians .mode").count(), 0);
    await page.getByLabel(/^predicted paths/).check();
    await page.locator("#now").screenshot({ path: join(pictures, "live-map.png") });
  })],
  ["shows the growth of the model and its errors", (browser) => visiting(browser, {}, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll("#learning .chart svg path").length > 3 && document.querySelectorAll("#horizons tr").length >= 5, undefined, { timeout: 120_000 });
    const size = await number(page, "#size");
    assert.ok(size > 0);
    await page.waitForFunction((before) => Number((document.querySelector("#size")?.textContent ?? "").replace(/[^0-9.]/g, "")) !== before, size, { timeout: 120_000 });
    assert.ok(await number(page, "#error") > 0);
    assert.match(await page.locator("#counters").innerText(), /detections, .* predictions/);
    await page.waitForTimeout(15_000);
    await picture(page, "live-desktop", true);
  })],
  ["is readable in the dark", (browser) => visiting(browser, { dark: true }, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll(".pedestrians .mode").length > 0, undefined, { timeout: 60_000 });
    await page.waitForTimeout(6000);
    await picture(page, "live-dark", true);
  })],
  ["fits on a phone", (browser) => visiting(browser, { width: 390, height: 844, touch: true }, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll(".pedestrians .mode").length > 0, undefined, { timeout: 60_000 });
    await page.waitForTimeout(6000);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), "nothing sticks out");
    await picture(page, "live-phone", true);
  })],
];

const onPicture: typeof tests = [
  ["draws pedestrians and predicted paths on the picture of the camera", (browser) => visiting(browser, {}, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll(".pedestrians .mode").length > 5 && document.querySelectorAll(".primitive").length > 0, undefined, { timeout: 60_000 });
    const box = (await page.locator("svg.place image").boundingBox())!;
    const map = (await page.locator("svg.place").boundingBox())!;
    assert.ok(box.x >= map.x && box.y >= map.y && box.y + box.height <= map.y + map.height + 1, "the picture is shown whole");
    // The camera sees a part of the place.
    await page.waitForFunction(({ x, y, width, height }) => [...document.querySelectorAll(".pedestrians .person")].map((person) => person.getBoundingClientRect())
      .filter((at) => at.x > x && at.right < x + width && at.y > y && at.bottom < y + height).length > 3, box, { timeout: 60_000 });
    const before = await pedestrians(page);
    await page.waitForTimeout(1500);
    assert.notEqual(await pedestrians(page), before, "pedestrians move");
    await page.locator("#now").screenshot({ path: join(pictures, "live-picture.png") });
  })],
];

await mkdir(pictures, { recursive: true });
const browser = await chromium.launch({ executablePath: process.env["SILA_CHROMIUM"] ?? "/usr/bin/chromium", args: process.getuid?.() === 0 ? ["--no-sandbox"] : [] });
let failed = 0;
for (const [name, run] of mode === "picture" ? onPicture : tests) {
  try {
    await run(browser);
    console.log(`ok      ${name}`);
  } catch (error) {
    ++failed;
    console.error(`FAILED  ${name}\n${error instanceof Error ? error.stack : String(error)}`);
  }
}
await browser.close();
process.exit(failed === 0 ? 0 : 1);
