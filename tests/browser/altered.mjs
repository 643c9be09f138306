// The demo's page with other numbers in it, for what the demo's own twin does not have: a bond that gives way, a spring, a joint
// that follows another, a screw.
import { readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

/** Writes a page whose twin is changed by `change`; gives its address. */
function altered(report, out, name, change) {
  const page = readFileSync(report, 'utf8');
  const head = 'id="scene-data">';
  const from = page.indexOf(head) + head.length;
  const to = page.indexOf('</script>', from);
  const scene = JSON.parse(page.slice(from, to));
  change(scene.physics);
  const file = path.resolve(out, `altered-${name}.html`);
  writeFileSync(file, page.slice(0, from) + JSON.stringify(scene).replaceAll('<', '\\u003c') + page.slice(to));
  return pathToFileURL(file).href;
}

const part = (physics, link) => physics.parts.find((p) => p.link === link);

/** The glued pair as two bodies with a bond between them. */
function bonded(breakaway) {
  return (physics) => {
    const [lower, upper] = ['glued-lower', 'glued-upper'].map((l) => part(physics, l));
    upper.tree = physics.parts.length;
    upper.joint = null;
    physics.bonds.push({ ends: [physics.parts.indexOf(lower), physics.parts.indexOf(upper)], breakaway });
  };
}

async function rises(page, address) {
  await page.goto(address);
  await page.waitForFunction(() => window.palpateReady === true);
  return page.evaluate(async () => {
    await window.palpate.begin();
    const height = (name) => window.palpate.bodies().find((b) => b.name === name).position[2];
    const before = ['glued-upper', 'glued-lower'].map(height);
    window.palpate.lift('glued-upper');
    window.palpate.advance(0.2);
    return { gone: ['glued-upper', 'glued-lower'].map((n, i) => height(n) - before[i]), said: window.palpate.said() };
  });
}

/** Opens the flap of a changed page; how far the joints went then, and how far the flap's link rose. */
async function opens(page, address) {
  await page.goto(address);
  await page.waitForFunction(() => window.palpateReady === true);
  return page.evaluate(async () => {
    await window.palpate.begin();
    const height = () => window.palpate.bodies().find((b) => b.name === 'flap').position[2];
    const before = height();
    window.palpate.open('flap');
    return { joints: window.palpate.joints(), rise: height() - before };
  });
}

/** Bonds, springs, followers and screws; `check` takes whether it is right and words. */
export async function alteredPages(page, report, out, check) {
  // The lower block weighs 1.1 N.
  for (const [breakaway, holds] of [[0.4, false], [4, true], [null, true]]) {
    const { gone, said } = await rises(page, altered(report, out, 'bond', bonded(breakaway)));
    const right = gone[0] > 0.08 && (holds ? gone[1] > 0.08 : gone[1] < 5e-3 && said.includes('gave way'));
    check(right, `a bond of ${breakaway ?? 'unknown'} N under 1.1 N: upper rises ${(1000 * gone[0]).toFixed(0)} mm, lower ${(1000 * gone[1]).toFixed(0)} mm; "${said}"`);
  }
  const spring = (physics) => Object.assign(part(physics, 'drawer').joint.motion, { stiffness: 40, damping: 1 });
  await page.goto(altered(report, out, 'spring', spring));
  await page.waitForFunction(() => window.palpateReady === true);
  const [opened, left] = await page.evaluate(async () => {
    const at = () => window.palpate.joints().carcass_drawer;
    await window.palpate.begin();
    window.palpate.grab('drawer');
    window.palpate.move([0.05, 0, 0], 1);
    const furthest = at();
    window.palpate.release();
    window.palpate.advance(1);
    return [furthest, at()];
  });
  // Dry friction of 0.51 N holds it against 40 N/m within 13 mm of where the spring is slack.
  check(opened > 0.02 && left < 0.014, `a drawer on a spring: pulled to ${(1000 * opened).toFixed(1)} mm, back to ${(1000 * left).toFixed(1)} mm`);

  const follower = (physics) => {
    const leader = part(physics, 'flap');
    Object.assign(part(physics, 'drawer').joint, { follows: { part: physics.parts.indexOf(leader), ratio: 0.05 } });
  };
  const led = await opens(page, altered(report, out, 'follower', follower));
  const [turn, slide] = [led.joints.post_flap, led.joints.carcass_drawer];
  check(turn > 0.5 && Math.abs(slide - 0.05 * turn) < 2e-3, `a drawer that follows a flap by 50 mm/rad: ${turn.toFixed(2)} rad, ${(1000 * slide).toFixed(1)} mm`);
  const screw = (physics) => Object.assign(part(physics, 'flap').joint, { kind: 'screw', pitch: 0.02 });
  const risen = await opens(page, altered(report, out, 'screw', screw));
  const up = 0.02 * risen.joints.post_flap;
  check(risen.joints.post_flap > 0.5 && Math.abs(risen.rise - up) < 2e-3, `a flap on a thread of 20 mm/rad: ${risen.joints.post_flap.toFixed(2)} rad, rises ${(1000 * risen.rise).toFixed(1)} mm`);
}
