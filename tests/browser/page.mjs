// Opens a report.html from its file in a browser without a network, and fails on any console error or request, on a page that
// is too large or too slow, and where the things of the demo's scene do not do what their twin says.
//
//   npm install playwright-core        (anywhere; then NODE_PATH or a node_modules beside this file)
//   node tests/browser/page.mjs REPORT.html [FOLDER for the pictures]
//
// CHROMIUM names the browser (default /usr/bin/chromium).
import { mkdtempSync, mkdirSync, rmSync, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { alteredPages } from './altered.mjs';
import { fingers, Touch } from './touch.mjs';

const roots = [process.cwd(), ...(process.env.NODE_PATH || '').split(path.delimiter)].filter(Boolean);
const { chromium } = createRequire(import.meta.url)(
  createRequire(import.meta.url).resolve('playwright-core', { paths: roots.flatMap((r) => [r, path.dirname(r)]) }),
);

const [report, out = '.'] = process.argv.slice(2);
if (!report) {
  console.error('usage: node page.mjs REPORT.html [FOLDER]');
  process.exit(2);
}
const address = pathToFileURL(path.resolve(report)).href;
const webgl = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const quiet = ['--no-sandbox', '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run'];

const sizes = [
  { name: 'desktop', viewport: { width: 1280, height: 900 }, colorScheme: 'light' },
  { name: 'desktop-dark', viewport: { width: 1280, height: 900 }, colorScheme: 'dark' },
  { name: 'phone', viewport: { width: 390, height: 844 }, colorScheme: 'light', isMobile: true, hasTouch: true, deviceScaleFactor: 2 },
  { name: 'no-webgl', viewport: { width: 1280, height: 900 }, colorScheme: 'light', args: ['--disable-gpu', '--disable-3d-apis', '--disable-software-rasterizer'] },
];

// Bars for the demo's page: the seconds are those of a machine that does `measure` in `MEASURE_SECONDS`.
const MOST_BYTES = 8e6;
const MOST_SECONDS = 3;
const MEASURE_SECONDS = 0.15;

const faults = [];
// The page that may be loaded; any file while altered pages are.
let home = address;
const said = [];

async function look({ name, args = webgl, ...options }) {
  const profile = mkdtempSync(path.join(tmpdir(), 'page-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium', headless: true, args: [...quiet, ...args], ...options,
  });
  try {
    const page = context.pages()[0] || (await context.newPage());
    const fault = (text) => faults.push(`${name}: ${text}`);
    page.on('console', (m) => ['error', 'warning'].includes(m.type()) && !harmless(m.text()) && fault(`console ${m.type()}: ${m.text()}`));
    page.on('pageerror', (e) => fault(`uncaught: ${e.message}`));
    page.on('request', (r) => (home ? r.url() !== home : !r.url().startsWith('file:')) && !/^(data|blob):/.test(r.url()) && fault(`request: ${r.url()}`));
    await open(page, name, fault);
    if (name !== 'no-webgl' && (await page.evaluate(() => window.palpate?.running()))) fault('something runs before it is touched');
    await check(page, name, fault);
    mkdirSync(out, { recursive: true });
    await page.waitForTimeout(500);
    await page.screenshot({ path: path.join(out, `${name}.png`) });
    await page.screenshot({ path: path.join(out, `${name}-full.png`), fullPage: true });
    for (const part of await page.locator('section').all()) {
      if (name === 'no-webgl') break;
      await part.screenshot({ path: path.join(out, `${name}-${await part.getAttribute('id')}.png`) });
    }
    if (name === 'desktop') await exercise(page, fault);
    if (name === 'desktop-dark' && (await isDemo(page))) {
      home = '';
      await alteredPages(page, report, out, (right, words) => new Touch(page, fault, out, said).check(right, words));
      home = address;
    }
    if (name === 'phone' && (await isDemo(page))) await fingers(page, fault, said);
  } finally {
    await context.close();
    rmSync(profile, { recursive: true, force: true });
  }
}

// The page is judged by the best of three loads, each beside a fixed piece of work done right after it in the same browser:
// what else the machine does is not of the page's making.
async function open(page, name, fault) {
  const all = [];
  for (let i = 0; i < (name === 'desktop' ? 3 : 1); i++) {
    const began = performance.now();
    await page.goto(address);
    await page.waitForFunction(() => window.palpateReady === true, null, { timeout: 180000 });
    const seconds = (performance.now() - began) / 1000;
    const slow = Math.max(1, (await page.evaluate(measure)) / MEASURE_SECONDS);
    all.push({ seconds, slow, fair: seconds / slow });
  }
  const told = ({ seconds, slow }) => `${seconds.toFixed(2)} s${slow > 1 ? ` by a machine ${slow.toFixed(2)} times as slow` : ''}`;
  said.push(`${name}: loaded and drawn in ${all.map(told).join(', ')}`);
  const best = Math.min(...all.map((load) => load.fair));
  if (name === 'desktop' && best > MOST_SECONDS) fault(`loads in ${best.toFixed(2)} s of a machine at rest, at most ${MOST_SECONDS}`);
}

// Seconds of a fixed piece of work, the like of what a load does: numbers, text, memory.
function measure() {
  const began = performance.now();
  for (let round = 0; round < 10; round++) {
    const numbers = Array.from({ length: 40000 }, (_, i) => Math.sin(i + round) * 1e3);
    const back = JSON.parse(JSON.stringify(numbers));
    window.palpateMeasured = Float64Array.from(back).sort().reduce((sum, x) => sum + Math.sqrt(Math.abs(x)), 0);
  }
  return (performance.now() - began) / 1000;
}

// What the software renderer says of itself is not of the page's making.
function harmless(text) {
  return /GL Driver Message|ReadPixels|swiftshader/i.test(text);
}

async function check(page, name, fault) {
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  if (wide > 0) fault(`the page is ${wide} px wider than the window`);
  const drawn = await page.locator('#scene.ready canvas').count();
  const excused = await page.locator('#scene.no-webgl .scene-none').isVisible().catch(() => false);
  if (name === 'no-webgl' ? !excused : !drawn) fault('the scene is neither drawn nor excused as it should be');
  const ids = await page.evaluate(() => [...document.querySelectorAll('[id]')].map((e) => e.id));
  if (new Set(ids).size !== ids.length) fault('an id occurs twice');
}

// Every switch, every slider, the keys; then one picture with everything on.
async function exercise(page, fault) {
  const view = page.locator('.scene-view');
  await view.scrollIntoViewIfNeeded();
  for (const box of await page.locator('.scene-switches input').all()) {
    await box.click();
    await page.waitForTimeout(150);
    const text = (await box.locator('xpath=..').textContent()).trim().toLowerCase().replace(/\W+/g, '-');
    await page.locator('#scene').screenshot({ path: path.join(out, `switch-${text}.png`) });
    await box.click();
  }
  for (const slider of await page.locator('.scene-sliders input').all()) {
    await slider.evaluate((e) => { e.value = e.max; e.dispatchEvent(new Event('input')); });
  }
  await page.locator('.scene-view canvas').focus();
  for (const key of ['ArrowLeft', 'ArrowUp', '+', '-', 'ArrowRight']) await page.keyboard.press(key);
  await page.waitForTimeout(400);
  await page.locator('#scene').screenshot({ path: path.join(out, 'moved.png') });
  const empty = await page.evaluate(() => {
    const canvas = document.querySelector('.scene-view canvas');
    return canvas.width < 2 || canvas.height < 2;
  });
  if (empty) fault('the canvas has no size');
  if (await isDemo(page)) await handle(page, fault);
}

async function isDemo(page) {
  const names = await page.evaluate(() => window.palpate?.bodies().map((b) => b.name) || []);
  return ['box', 'flap', 'drawer', 'glued-upper', 'loose-upper'].every((n) => names.includes(n));
}

/** What hands do to the demo's things. */
async function handle(page, fault) {
  const touch = new Touch(page, fault, out, said);
  await touch.pick('glued-upper', 'glued-lower', true);
  await touch.pick('loose-upper', 'loose-lower', false);
  await touch.opens('flap', 'post_flap', 0.5);
  await touch.opens('drawer', 'carcass_drawer', 0.05);
  await touch.pushes('box', [1, 0, 0]);
  await touch.mouse();
  await touch.keyboard('mug');
  await touch.replays();
}

const bytes = statSync(report).size;
said.push(`${(bytes / 1e6).toFixed(2)} MB`);
if (bytes > MOST_BYTES) faults.push(`${bytes} bytes, at most ${MOST_BYTES}`);
for (const size of sizes) await look(size);
console.log(said.join('\n'));
if (faults.length) {
  console.error(faults.join('\n'));
  process.exit(1);
}
console.log(`ok: ${sizes.map((s) => s.name).join(', ')}`);
