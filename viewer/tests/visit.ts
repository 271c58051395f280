// What the tests in Chromium share: the files they open, and how.
import assert from "node:assert/strict";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";

export const folder = resolve(process.argv[2] ?? ".");
export const [modelReport, pictureReport, resultsReport, editor, cameraEditor, pictures] = ["report.html", "picture.html", "results.html", "editor.html", "camera.html", "pictures"].map((name) => join(folder, name)) as [string, string, string, string, string, string];

export interface Visit { width?: number; height?: number; dark?: boolean; touch?: boolean }

/** Opens a page without a network and fails if it complains or asks for anything. */
export async function visiting(browser: Browser, file: string, { width = 1280, height = 900, dark = false, touch = false }: Visit, act: (page: Page) => Promise<void>): Promise<void> {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: dark ? "dark" : "light", offline: true, hasTouch: touch, isMobile: touch, deviceScaleFactor: touch ? 2 : 1, reducedMotion: "reduce" });
  const page = await context.newPage();
  const complaints: string[] = [];
  const url = pathToFileURL(file).href;
  page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => { if (!request.url().startsWith(url) && !request.url().startsWith("data:")) complaints.push(`asks for ${request.url()}`); });
  await page.goto(url);
  await page.waitForSelector("main section");
  await page.waitForTimeout(300);
  await act(page);
  assert.deepEqual(complaints, [], "the page complains or asks for something");
  await context.close();
}

export const value = (page: Page, selector: string): Promise<number> => page.locator(selector).inputValue().then(Number);
export const text = (page: Page, selector: string): Promise<string> => page.locator(selector).innerText();
export const picture = (page: Page, name: string, fullPage = false): Promise<Buffer> => page.screenshot({ path: join(pictures, `${name}.png`), fullPage });

/** Everything that can be used and that a screen reader does not find: without a name, or within an image. */
export const nameless = (page: Page): Promise<string[]> => page.$$eval("button, select, input, textarea, a, [role=button]", (all) => all.filter((e) => e.closest("[role=img]") || !e.closest("[aria-hidden=true]") && !(e.textContent?.trim() || e.getAttribute("aria-label") || (e as HTMLInputElement).labels?.length)).map((e) => e.outerHTML));

export type BrowserTest = [string, (browser: Browser) => Promise<void>];
