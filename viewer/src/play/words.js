// What became of everything when a hand was at work, in words; the bounds are those of src/export/outcome.rs.
import { Vector3 } from 'three';

/** A part stays where its centre of mass moves by less than this, m, and it turns by less than this, rad. */
const STAYS = 2e-3;
const STAYS_TURN = 0.02;
/** A part comes along where it goes at least this share of the hand's way. */
const ALONG = 0.5;

const whole = (x) => x.toFixed(0).replace('-0', '0').replace('-', '\u2212');
const mm = (x) => `${whole(1000 * x)} mm`;
const and = (names) => (names.length < 2 ? names.join('') : `${names.slice(0, -1).join(', ')} and ${names[names.length - 1]}`);

/** Where everything is, to be compared later. */
export function memory(world) {
  return new Map(world.parts.filter((p) => p.body).map((p) => [p, {
    com: world.comOf(p),
    turn: world.rotation(p),
    joint: world.hasState(p) ? world.jointState(p).value : null,
  }]));
}

/** `handled`, `along`, `moved` or `stayed` for each part; `way` is the hand's, world. */
export function verdicts(world, before, way, handled) {
  const out = new Map();
  for (const [part, was] of before) {
    const moved = world.comOf(part).sub(was.com);
    const turned = world.rotation(part).angleTo(was.turn);
    const far = moved.dot(way) >= ALONG * way.lengthSq() && way.length() > STAYS;
    const still = moved.length() < STAYS && turned < STAYS_TURN;
    out.set(part, part === handled ? 'handled' : still ? 'stayed' : far ? 'along' : 'moved');
  }
  return out;
}

function goneBy(world, way) {
  const up = way.dot(world.up);
  const flat = way.clone().addScaledVector(world.up, -up).length();
  const words = [];
  if (Math.abs(up) > STAYS) words.push(`${mm(Math.abs(up))} ${up > 0 ? 'up' : 'down'}`);
  if (flat > STAYS) words.push(`${mm(flat)} over the table`);
  return words.length ? words.join(' and ') : 'hardly';
}

function joints(world, before) {
  const said = [];
  for (const [part, was] of before) {
    if (was.joint === null) continue;
    const { value } = world.jointState(part);
    const { turns } = part.data.joint.motion;
    if (Math.abs(value - was.joint) < (turns ? STAYS_TURN : STAYS)) continue;
    const at = turns ? `${whole((value * 180) / Math.PI)}\u00b0` : mm(value);
    said.push(`${part.data.link} now stands ${at} from where it was first seen`);
  }
  return said;
}

/** A sentence or two on what the hand did. `held`: it still holds. */
export function outcome(world, before, handled, held) {
  const way = world.comOf(handled).sub(before.get(handled).com);
  const found = verdicts(world, before, way, handled);
  const named = (word) => [...found].filter(([, w]) => w === word).map(([p]) => p.data.link);
  const name = handled.data.link;
  const said = [`${held ? 'You hold' : 'You moved'} ${name}: ${goneBy(world, way)}.`];
  const [along, moved] = [named('along'), named('moved')];
  said.push(along.length ? `${and(along)} came along.` : 'Nothing came along.');
  if (moved.length) said.push(`${and(moved)} moved too.`);
  said.push(...joints(world, before).map((s) => `${s}.`));
  said.push(...world.bonds.broken.map((ends) => `The bond of ${and(ends)} gave way.`));
  return said.join(' ');
}

/** The same of a finger, which holds nothing. */
export function pushed(world, before) {
  const found = verdicts(world, before, new Vector3(), null);
  const gone = [...found].filter(([, w]) => w !== 'stayed').map(([p]) => `${p.data.link} by ${mm(world.comOf(p).sub(before.get(p).com).length())}`);
  const said = [gone.length ? `You pushed ${and(gone)}.` : 'The finger pushed nothing.'];
  said.push(...joints(world, before).map((s) => `${s}.`));
  return said.join(' ');
}
