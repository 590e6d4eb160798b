// Opens files in Debian's chromium, from disk and without a network, and looks at what is drawn.
//
// node browser.mjs PACKAGES CHROMIUM KIND FILE [PICTURE]
// KIND: surface or curve for report pages, svg for drawings. Ends with a line of JSON: what was found. PICTURE: where to keep screenshots.
import { createRequire } from "node:module";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [packages, executablePath, kind, file, picture] = process.argv.slice(2);
const { chromium } = createRequire(path.resolve(packages, "node_modules", "x.js"))("playwright-core");
const profile = mkdtempSync(path.join(tmpdir(), "zeroset-chromium-"));
const problems = [];
const expect = (holds, what) => holds || problems.push(what);

const context = await chromium.launchPersistentContext(profile, {
  executablePath,
  headless: true,
  viewport: { width: 1200, height: 900 },
  args: [
    "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
  ],
});
try {
  const page = await context.newPage();
  const address = pathToFileURL(path.resolve(file)).href;
  page.on("console", (message) => {
    // The driver complains of this check, which reads what was drawn, and not of the page.
    if (message.text().includes("GPU stall due to ReadPixels")) return;
    if (["error", "warning"].includes(message.type())) problems.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => problems.push(`error: ${error.message}`));
  page.on("request", (request) => {
    const url = request.url();
    expect(url === address || url.startsWith("data:"), `asks for ${url}`);
  });
  await page.goto(address);
  const found = kind === "svg" ? await drawing(page) : await report(page);
  console.log(JSON.stringify({ problems, ...found }));
} catch (error) {
  console.log(JSON.stringify({ problems: [...problems, error.message] }));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}

/** How many pixels of the page differ from its first one, as it is on the screen. */
async function inked(page) {
  const png = await page.screenshot();
  // Counted by the browser itself, in an empty page.
  const other = await context.newPage();
  const share = await other.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let differing = 0;
    for (let k = 0; k < data.length; k += 4) {
      differing += data[k] !== data[0] || data[k + 1] !== data[1] || data[k + 2] !== data[2];
    }
    return differing / (data.length / 4);
  }, png.toString("base64"));
  await other.close();
  return share;
}

async function drawing(page) {
  const share = await inked(page);
  // An open outline is thin.
  expect(share > 0.001, `${share} of the pixels are drawn`);
  const box = await page.evaluate(() => {
    const all = document.documentElement;
    return { root: all.nodeName, paths: all.querySelectorAll("path").length, dots: all.querySelectorAll("circle").length };
  });
  expect(box.root === "svg" && box.paths > 0, `${JSON.stringify(box)} is no drawing`);
  return { share, ...box };
}

async function report(page) {
  const shot = async (name) => picture && (await page.screenshot({ path: `${picture}-${name}.png`, fullPage: true }));
  const found = { title: await page.title(), sections: await page.locator("h2").count() };
  expect(found.sections >= 6, `${found.sections} sections`);
  // A page wider than its window has to be pushed about.
  const wide = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  if (kind === "surface") {
    await page.waitForSelector("#view[data-state=drawn]", { timeout: 30000 });
    const first = await canvas(page);
    expect(first.share > 0.05 && first.share < 0.9, `${first.share} of the view is drawn`);
    const box = await page.locator("#view").boundingBox();
    const middle = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(...middle);
    await page.mouse.down();
    await page.mouse.move(middle[0] + 120, middle[1] + 40, { steps: 4 });
    await page.mouse.up();
    const turned = await canvas(page);
    expect(turned.sum !== first.sum, "turning changes nothing");
    await page.mouse.wheel(0, -400);
    const near = await canvas(page);
    expect(near.share > 1.2 * turned.share, "zooming in changes nothing");
    await page.locator("#view").press("0");
    expect((await canvas(page)).sum === first.sum, "0 does not bring the first view back");
    await page.locator("#show-points").check();
    await page.locator("#show-surface").uncheck();
    const points = await canvas(page);
    expect(points.share > 0.003 && points.red > 0.9, `points: ${JSON.stringify(points)}`);
    await page.locator("#show-surface").check();
    for (const view of ["Front", "Top", "Oblique"]) await page.getByRole("button", { name: view }).click();
    found.view = { drawn: first.share, points: points.share };
    await canvas(page);
  } else {
    expect((await page.locator(".drawing svg").count()) === 1, "no drawing");
  }
  const broken = await page.evaluate(() => [...document.images].filter((image) => !image.naturalWidth).length);
  expect(broken === 0, `${broken} broken pictures`);
  expect((await wide()) <= 0, `${await wide()} pixels too wide`);
  await shot("light");
  await page.emulateMedia({ colorScheme: "dark" });
  await shot("dark");
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(300);
  expect((await wide()) <= 0, `${await wide()} pixels too wide on a telephone`);
  await shot("narrow");
  await page.setViewportSize({ width: 800, height: 1100 });
  await page.emulateMedia({ media: "print" });
  await shot("print");
  if (picture) await page.pdf({ path: `${picture}.pdf`, format: "A4" });
  return found;
}

/** The share of the view's pixels that are drawn, a sum that tells pictures apart, and how many of the drawn ones are rather red. */
async function canvas(page) {
  return page.evaluate(async () => {
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const view = document.getElementById("view");
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [view.width, view.height];
    const context = copy.getContext("2d");
    context.drawImage(view, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    let [drawn, red, sum] = [0, 0, 0];
    for (let k = 0; k < data.length; k += 4) {
      if (data[k + 3] === 0) continue;
      drawn += 1;
      red += data[k] > 1.5 * data[k + 2];
      sum = (31 * sum + data[k] + 3 * data[k + 1] + 7 * data[k + 2] + k) % 1000000007;
    }
    return { share: drawn / (data.length / 4), red: red / Math.max(drawn, 1), sum };
  });
}
