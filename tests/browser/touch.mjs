// Touches the scene of a report in a browser: through `window.palpate`, whose clock the test holds, and with real events of
// mouse, touch and keyboard. `name` of a check that fails stands in its message.
import path from 'node:path';

const place = (bodies, name) => bodies.find((b) => b.name === name).position;
const up = (from, to) => to[2] - from[2];
const far = (from, to) => Math.hypot(...to.map((x, k) => x - from[k]));
const mm = (x) => `${(1000 * x).toFixed(1)} mm`;

export class Touch {
  constructor(page, fault, out, said) {
    Object.assign(this, { page, fault, out, said });
  }

  bodies() {
    return this.page.evaluate(() => window.palpate.bodies());
  }

  async fresh() {
    await this.page.evaluate(() => window.palpate.reset());
    return this.page.evaluate(async () => {
      await window.palpate.begin();
      return window.palpate.bodies();
    });
  }

  async shot(name) {
    await this.page.waitForTimeout(300);
    await this.page.locator('#scene').screenshot({ path: path.join(this.out, `touch-${name}.png`) });
  }

  check(right, words) {
    this.said.push(`${right ? 'right' : 'WRONG'}: ${words}`);
    if (!right) this.fault(words);
  }

  /** The paper's pick-up: the upper part of a glued stack brings the lower, of a resting one does not. */
  async pick(upper, lower, together) {
    const before = await this.fresh();
    await this.page.evaluate((name) => window.palpate.lift(name), upper);
    const after = await this.bodies();
    const [rise, along] = [upper, lower].map((name) => up(place(before, name), place(after, name)));
    const words = await this.page.evaluate(() => window.palpate.said());
    await this.shot(`pick-${upper}`);
    const right = rise > 0.08 && (together ? Math.abs(rise - along) < 0.01 : Math.abs(along) < 2e-3);
    this.check(right, `${upper} picked: rises ${mm(rise)}, ${lower} ${mm(along)}`);
    const told = together ? words.includes(`${lower} came along`) : !words.includes(`${lower} came along`) && words.includes(upper);
    this.check(told, `and it is said: "${words}"`);
  }

  async opens(link, joint, least) {
    await this.fresh();
    await this.page.evaluate((name) => window.palpate.open(name), link);
    const at = await this.page.evaluate((name) => window.palpate.joints()[name], joint);
    await this.shot(`open-${link}`);
    this.check(Math.abs(at) > least, `${joint} opened to ${at.toFixed(3)}`);
  }

  async pushes(link, way) {
    const before = await this.fresh();
    await this.page.evaluate(([name, heading]) => window.palpate.push(name, heading), [link, way]);
    const gone = far(place(before, link), place(await this.bodies(), link));
    this.check(gone > 0.03 && gone < 0.09, `${link} pushed: goes ${mm(gone)}`);
  }

  /** Drags by real events from a link's middle by so many pixels; `held` while the button is down. */
  async drag(link, by, { tool = 'Lift', steps = 24, held } = {}) {
    await this.page.locator('.tools label', { hasText: tool }).click();
    await this.page.locator('.scene-view').scrollIntoViewIfNeeded();
    const at = await this.page.evaluate((name) => window.palpate.spot(name), link);
    await this.page.mouse.move(...at);
    await this.page.mouse.down();
    await this.page.waitForFunction(() => window.palpate.running(), null, { timeout: 60000 });
    for (let i = 1; i <= steps; i++) {
      await this.page.mouse.move(at[0] + (by[0] * i) / steps, at[1] + (by[1] * i) / steps);
      await this.page.waitForTimeout(30);
    }
    await this.still();
    const result = held ? await held() : null;
    await this.page.mouse.up();
    return result;
  }

  async mouse() {
    let before = await this.fresh();
    await this.drag('box', [-110, 30], { tool: 'Slide' });
    await this.rest();
    const slid = far(place(before, 'box'), place(await this.bodies(), 'box'));
    await this.shot('mouse-slide');
    this.check(slid > 0.03, `box dragged over the table by the mouse: goes ${mm(slid)}`);
    for (const [upper, lower, together] of [['glued-upper', 'glued-lower', true], ['loose-upper', 'loose-lower', false]]) {
      before = await this.fresh();
      const after = await this.drag(upper, [0, -90], { held: async () => { await this.shot(`mouse-${upper}`); return this.bodies(); } });
      const [rise, along] = [upper, lower].map((name) => up(place(before, name), place(after, name)));
      const right = rise > 0.03 && (together ? Math.abs(rise - along) < 0.015 : Math.abs(along) < 3e-3);
      this.check(right, `${upper} lifted by the mouse: rises ${mm(rise)}, ${lower} ${mm(along)}`);
    }
    for (const [link, joint, by, least] of [['flap', 'post_flap', [-60, 90], 0.2], ['drawer', 'carcass_drawer', [90, 40], 0.03]]) {
      await this.fresh();
      await this.drag(link, by);
      const at = await this.page.evaluate((name) => window.palpate.joints()[name], joint);
      await this.shot(`mouse-${link}`);
      this.check(Math.abs(at) > least, `${joint} opened by the mouse to ${at.toFixed(3)}`);
    }
  }

  /** Until the hand is where it was sent, and half a second more by the engine's clock, which a busy machine slows. */
  async still() {
    await this.page.waitForFunction(() => window.palpate.handGap() < 1e-4, null, { timeout: 300000 });
    const time = await this.page.evaluate(() => window.palpate.time());
    await this.page.waitForFunction((t) => window.palpate.time() > t + 0.5, time, { timeout: 300000 });
  }

  async rest() {
    await this.page.waitForFunction(() => !window.palpate.running(), null, { timeout: 300000 });
  }

  /** N until the thing is chosen, Enter, Page Up, Enter. */
  async keyboard(link) {
    const before = await this.fresh();
    await this.page.locator('.scene-view canvas').focus();
    for (let i = 0; i < before.length; i++) {
      if ((await this.page.locator('.play-group select').first().inputValue()) === link) break;
      await this.page.keyboard.press('n');
    }
    await this.page.keyboard.press('Enter');
    await this.page.waitForFunction((name) => window.palpate.said().startsWith(`You hold ${name}.`), link, { timeout: 60000 });
    for (let i = 0; i < 6; i++) await this.page.keyboard.press('PageUp');
    for (let i = 0; i < 3; i++) await this.page.keyboard.press('ArrowLeft');
    await this.still();
    const held = await this.bodies();
    const rise = up(place(before, link), place(held, link));
    this.check(rise > 0.03, `${link} lifted by keys: rises ${mm(rise)}`);
    await this.page.keyboard.press('Enter');
    await this.rest();
    const fell = up(place(held, link), place(await this.bodies(), link));
    this.check(fell < -0.02, `and falls by ${mm(-fell)} when it is let go`);
  }

  async replays() {
    await this.page.evaluate(() => window.palpate.reset());
    const names = await this.page.locator('.replay select option').allTextContents();
    this.check(names.length > 10, `${names.length - 1} touches can be seen again`);
    for (const name of names.filter((n) => /box-push-check|drawer-pull \(|flap-pull-check|glued-lift/.test(n))) {
      await this.page.selectOption('.replay select', { label: name });
      await this.page.locator('.replay button').click();
      await this.page.locator('.replay input').evaluate((e) => { e.value = 0.55; e.dispatchEvent(new Event('input')); });
      await this.shot(`replay-${name.split(' ')[0]}`);
    }
    const buttons = await this.page.locator('.see').count();
    this.check(buttons === names.length - 1, `${buttons} touches have a button that shows them`);
  }
}

/** A finger on the glass: a thing follows it, the page does not scroll. */
export async function fingers(page, fault, said) {
  await page.locator('.scene-view').scrollIntoViewIfNeeded();
  await page.evaluate(() => window.palpate.begin());
  const touch = new Touch(page, fault, '.', said);
  const before = await touch.bodies();
  const [x, y] = await page.evaluate(() => window.palpate.spot('box'));
  const scrolled = await page.evaluate(() => window.scrollY);
  const session = await page.context().newCDPSession(page);
  const send = (type, points) => session.send('Input.dispatchTouchEvent', { type, touchPoints: points });
  await send('touchStart', [{ x, y }]);
  for (let i = 1; i <= 20; i++) {
    await send('touchMove', [{ x, y: y - 3 * i }]);
    await page.waitForTimeout(40);
  }
  await touch.still();
  const rise = up(place(before, 'box'), place(await touch.bodies(), 'box'));
  await send('touchEnd', []);
  touch.check(rise > 0.02, `box lifted by a finger on the glass: rises ${mm(rise)}`);
  touch.check((await page.evaluate(() => window.scrollY)) === scrolled, 'and the page stayed where it was');
}
