//! Random scenes of the lab: trees of joints about a fixed base, arms that are led by the tip, stacks.

use nalgebra::Vector3;
use palpate::base::{Seed, rng_for};
use palpate::lab::Scene;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Noise of tracks (m, rad) and of the wrist (N, N·m): a motion capture rig, a good camera, a poor one.
pub const LEVELS: [[f64; 4]; 3] = [
    [1e-4, 1e-3, 0.02, 0.002],
    [4e-4, 4e-3, 0.04, 0.004],
    [1e-3, 8e-3, 0.08, 0.008],
];

const G: f64 = 9.80665;
/// Edge of the base, m, and how high its middle is.
const BASE: f64 = 0.12;
const HIGH: f64 = 0.4;

/// What a joint of a scene is, beyond the truth file.
pub struct Hung {
    pub parent: String,
    pub child: String,
    pub kind: &'static str,
    pub axis: Vector3<f64>,
    pub origin: Vector3<f64>,
    pub pitch: f64,
    pub friction: f64,
    pub damping: f64,
    pub stiffness: f64,
}

pub struct Made {
    pub scene: Scene,
    pub joints: Vec<Hung>,
    pub level: usize,
}

fn head(name: &str, level: usize, seed: u64) -> String {
    let [position, rotation, force, torque] = LEVELS[level];
    format!(
        "name = \"{name}\"\n[camera]\nviews = 0\n[noise]\nposition = {position}\nrotation = {rotation}\nforce = {force}\ntorque = {torque}\ntrack_rate = 100.0\n[repeat]\nfriction = 0.01\nseed = {seed}\n"
    )
}

fn parsed(text: &str) -> Scene {
    toml::from_str(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn direction(dice: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| dice.random_range(-1.0..1.0f64));
        if v.norm() > 0.1 && v.norm() < 1.0 {
            return v.normalize();
        }
    }
}

struct Part {
    name: String,
    centre: Vector3<f64>,
    size: Vector3<f64>,
    density: f64,
    parent: Option<usize>,
    /// Where the next one may hang: the point of its end, and the way on.
    end: (Vector3<f64>, Vector3<f64>),
    /// The foot of the part, where it hangs.
    foot: Vector3<f64>,
}

impl Part {
    fn text(&self) -> String {
        let (at, size) = (self.centre, self.size);
        format!(
            "[[body]]\nname = \"{}\"\nshape = {{ kind = \"box\", size = [{}, {}, {}] }}\nposition = [{}, {}, {}]\ndensity = {}\nfixed = {}\nknown_mesh = true\n",
            self.name,
            size.x,
            size.y,
            size.z,
            at.x,
            at.y,
            at.z,
            self.density,
            self.parent.is_none()
        )
    }

    fn mass(&self) -> f64 {
        self.size.x * self.size.y * self.size.z * self.density
    }
}

fn base() -> Part {
    Part {
        name: "base".into(),
        centre: Vector3::new(0.0, 0.0, HIGH),
        size: Vector3::repeat(BASE),
        density: 2000.0,
        parent: None,
        end: (Vector3::zeros(), Vector3::zeros()),
        foot: Vector3::zeros(),
    }
}

/// A bar that starts at `foot` and goes on along `way`, an axis of the world.
fn bar(dice: &mut ChaCha8Rng, name: String, parent: usize, foot: Vector3<f64>, way: Vector3<f64>) -> Part {
    let long = dice.random_range(0.09..0.17);
    let thick = dice.random_range(0.02..0.04);
    let size = way.map(|w| if w.abs() > 0.5 { long } else { thick });
    Part {
        name,
        centre: foot + way * (0.5 * long + 0.002),
        size,
        density: dice.random_range(200.0..800.0),
        parent: Some(parent),
        end: (foot + way * (long + 0.002), way),
        foot,
    }
}

/// One to four joints on the faces of a fixed base and on each other, of every kind, axes anywhere.
pub fn tree(seed: u64) -> Made {
    let dice = &mut rng_for(Seed(seed), "joints");
    let level = (seed % 3) as usize;
    let count = 1 + (seed / 3 % 4) as usize;
    let mut parts = vec![base()];
    let faces = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z()];
    let mut free: Vec<Vector3<f64>> = faces.to_vec();
    for k in 0..count {
        let outer: Vec<usize> = (1..parts.len())
            .filter(|i| parts.iter().filter(|p| p.parent == Some(*i)).count() < 2)
            .collect();
        let name = format!("link-{}", ["a", "b", "c", "d"][k]);
        let part = if !outer.is_empty() && dice.random_bool(0.4) {
            let parent = outer[dice.random_range(0..outer.len())];
            let taken = parts.iter().any(|p| p.parent == Some(parent));
            let (end, way) = parts[parent].end;
            // The second of a branch leaves the side of its parent.
            let (foot, way) = if taken {
                let side = if way.z.abs() > 0.5 { Vector3::x() } else { Vector3::z() };
                let half = parts[parent].size.dot(&side.abs()) * 0.5;
                (parts[parent].centre + side * half, side)
            } else {
                (end, way)
            };
            bar(dice, name, parent, foot, way)
        } else {
            let way = free.remove(dice.random_range(0..free.len()));
            bar(dice, name, 0, parts[0].centre + way * (0.5 * BASE), way)
        };
        parts.push(part);
    }
    let joints: Vec<Hung> = (1..parts.len()).map(|i| hang(dice, &parts, i)).collect();
    let mut text = head("tree", level, seed);
    parts.iter().for_each(|p| text += &p.text());
    joints.iter().for_each(|j| text += &joint_text(j));
    for (i, joint) in joints.iter().enumerate() {
        text += &pulls(dice, &parts[i + 1], joint, i);
    }
    Made {
        scene: parsed(&text),
        joints,
        level,
    }
}

/// A joint at the foot of a part, stiff enough to hold up what hangs on it.
fn hang(dice: &mut ChaCha8Rng, parts: &[Part], i: usize) -> Hung {
    let part = &parts[i];
    let way = part.end.1;
    let kind = ["revolute", "revolute", "prismatic", "screw"][dice.random_range(0..4)];
    let upright = dice.random_bool(0.3);
    let axis = loop {
        let axis = if upright && way.z == 0.0 {
            Vector3::z()
        } else {
            direction(dice)
        };
        // A hinge that turns a bar about its own length moves nothing that could be seen.
        if kind == "prismatic" || axis.dot(&way).abs() < 0.6 {
            break axis;
        }
    };
    let mut carried = Vec::new();
    let mut of_family = vec![i];
    while let Some(k) = of_family.pop() {
        carried.push(k);
        of_family.extend((0..parts.len()).filter(|c| parts[*c].parent == Some(k)));
    }
    let origin = part.foot + Vector3::from_fn(|_, _| dice.random_range(-0.008..0.008));
    let weight: f64 = carried.iter().map(|k| parts[*k].mass() * G).sum();
    let torque: f64 = carried
        .iter()
        .map(|k| {
            let arm = parts[*k].centre - origin;
            parts[*k].mass()
                * G
                * arm
                    .cross(&Vector3::z())
                    .dot(&axis)
                    .abs()
                    .max(0.7 * arm.norm() * (1.0 - axis.z.abs()))
        })
        .sum();
    let mut between = |low: f64, high: f64| dice.random_range(low..high);
    let pitch = if kind == "screw" { between(0.003, 0.012) } else { 0.0 };
    let (friction, stiffness) = if kind == "prismatic" {
        (between(0.3, 1.2) + 1.6 * weight * axis.z.abs(), between(6.0, 30.0))
    } else {
        (
            between(0.02, 0.07) + 1.6 * torque + 1.6 * pitch * weight,
            between(0.04, 0.2),
        )
    };
    // At the fastest pull damping is a good part of the load.
    let damping = friction * between(0.2, 0.8) * if kind == "prismatic" { 15.0 } else { 1.0 };
    let stiffness = if dice.random_bool(0.5) { stiffness } else { 0.0 };
    Hung {
        parent: parts[part.parent.unwrap_or(0)].name.clone(),
        child: part.name.clone(),
        kind,
        axis,
        origin,
        pitch,
        friction,
        damping,
        stiffness,
    }
}

fn joint_text(j: &Hung) -> String {
    let pitch = if j.kind == "screw" {
        format!("pitch = {}\n", j.pitch)
    } else {
        String::new()
    };
    format!(
        "[[joint]]\na = \"{}\"\nb = \"{}\"\nkind = \"{}\"\naxis = [{}, {}, {}]\norigin = [{}, {}, {}]\n{pitch}friction = {}\ndamping = {}\nstiffness = {}\n",
        j.parent,
        j.child,
        j.kind,
        j.axis.x,
        j.axis.y,
        j.axis.z,
        j.origin.x,
        j.origin.y,
        j.origin.z,
        j.friction,
        j.damping,
        j.stiffness
    )
}

/// Five pulls of a part along its own joint, at five speeds, to and fro.
fn pulls(dice: &mut ChaCha8Rng, part: &Part, joint: &Hung, index: usize) -> String {
    let hand = part.centre + part.end.1 * (0.35 * part.size.dot(&part.end.1.abs()));
    let arm = hand - joint.origin;
    let arm = arm - joint.axis * joint.axis.dot(&arm);
    let slide = joint.kind == "prismatic";
    let (ahead, lever) = if slide {
        (joint.axis, 1.0)
    } else {
        (joint.axis.cross(&arm), arm.norm())
    };
    let mut text = String::new();
    for (k, fast) in [0.35, 0.9, 1.8, 0.5, 1.3].into_iter().enumerate() {
        let sign = if dice.random_bool(0.5) { 1.0 } else { -1.0 };
        let travel = if slide {
            dice.random_range(0.03..0.06)
        } else {
            dice.random_range(0.4..0.8)
        };
        let speed = fast * dice.random_range(0.8..1.2) * if slide { 0.06 } else { 1.0 };
        text += &format!(
            "[[action]]\nkind = \"pull\"\nname = \"pull-{index}-{k}\"\ntarget = \"{}\"\nat = [{}, {}, {}]\ndirection = [{}, {}, {}]\ntravel = {}\nspeed = {}\npin = {}\narc = true\nback = true\n",
            part.name,
            hand.x,
            hand.y,
            hand.z,
            sign * ahead.x,
            sign * ahead.y,
            sign * ahead.z,
            travel * lever,
            speed * lever,
            // One of them by a pivot: what a rigid grip leads along the level could as well lie there loose.
            k == 0 || dice.random_bool(0.5)
        );
    }
    text
}

/// Two links in the plane, led by the tip along lines: both joints move at once.
pub fn arm(seed: u64) -> Made {
    let dice = &mut rng_for(Seed(seed), "arms");
    let level = (seed % 3) as usize;
    let mut parts = vec![base()];
    let mut foot = Vector3::new(0.5 * BASE, 0.0, HIGH);
    for k in 0..2 {
        let part = bar(dice, format!("link-{}", ["a", "b"][k]), k, foot, Vector3::x());
        foot = part.end.0;
        parts.push(part);
    }
    let joints: Vec<Hung> = (1..3)
        .map(|i| Hung {
            parent: parts[i - 1].name.clone(),
            child: parts[i].name.clone(),
            kind: "revolute",
            axis: Vector3::z(),
            origin: parts[i].foot,
            pitch: 0.0,
            friction: dice.random_range(0.02..0.05),
            damping: dice.random_range(0.003..0.01),
            stiffness: 0.0,
        })
        .collect();
    let mut text = head("arm", level, seed);
    parts.iter().for_each(|p| text += &p.text());
    joints.iter().for_each(|j| text += &joint_text(j));
    let hand = parts[2].centre + Vector3::x() * (0.4 * parts[2].size.x);
    for k in 0..4 {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let way = Vector3::new(dice.random_range(-0.9..-0.3), side, 0.0).normalize();
        text += &format!(
            "[[action]]\nkind = \"pull\"\nname = \"pull-{k}\"\ntarget = \"link-b\"\nat = [{}, {}, {}]\ndirection = [{}, {}, 0.0]\ntravel = {}\nspeed = {}\npin = true\nback = true\n",
            hand.x,
            hand.y,
            hand.z,
            way.x,
            way.y,
            dice.random_range(0.07..0.12),
            [0.03, 0.06, 0.1, 0.15][k]
        );
    }
    Made {
        scene: parsed(&text),
        joints,
        level,
    }
}

/// What holds the upper of a stack, and whether something was done that could part the two.
pub struct Stack {
    pub scene: Scene,
    pub glued: bool,
    pub breakaway: Option<f64>,
    /// The upper one was lifted.
    pub lifted: bool,
}

pub fn stack(seed: u64) -> Stack {
    let dice = &mut rng_for(Seed(seed), "stacks");
    let level = (seed % 3) as usize;
    let bond = seed / 3 % 3;
    let breakaway: Option<f64> = (bond == 2).then(|| dice.random_range(4.0..9.0));
    let (low, top) = (
        [
            dice.random_range(0.07..0.11),
            dice.random_range(0.07..0.11),
            dice.random_range(0.03..0.05),
        ],
        [
            dice.random_range(0.04..0.06),
            dice.random_range(0.04..0.06),
            dice.random_range(0.025..0.04),
        ],
    );
    let mut text = head("stack", level, seed);
    for (name, size, z) in [("low", low, 0.5 * low[2]), ("top", top, low[2] + 0.5 * top[2])] {
        let kinetic = dice.random_range(0.25..0.45);
        text += &format!(
            "[[body]]\nname = \"{name}\"\nshape = {{ kind = \"box\", size = {size:?} }}\nposition = [0.0, 0.0, {z}]\ndensity = {}\nknown_mesh = true\nfriction = {{ static = {}, kinetic = {kinetic} }}\n",
            // What breaks away is too heavy to be taken along.
            if breakaway.is_some() && name == "low" {
                dice.random_range(12.0..20.0) / (9.81 * size.iter().product::<f64>())
            } else {
                dice.random_range(400.0..1200.0)
            },
            1.1 * kinetic
        );
    }
    if bond > 0 {
        text += "[[bond]]\na = \"low\"\nb = \"top\"\n";
        if let Some(force) = breakaway {
            text += &format!("breakaway = {force}\n");
        }
    }
    let lifted = dice.random_bool(0.6);
    let mut push = |name: &str, target: &str, face: f64, z: f64| {
        format!(
            "[[action]]\nkind = \"push\"\nname = \"{name}\"\ntarget = \"{target}\"\nat = [{face}, {}, {z}]\ndirection = [1.0, 0.0, 0.0]\ntravel = 0.03\nspeed = {}\n",
            dice.random_range(-0.01..0.01),
            dice.random_range(0.02..0.05)
        )
    };
    text += &push("push-low", "low", -0.5 * low[0], 0.5 * low[2]);
    if seed.is_multiple_of(2) {
        text += &push("push-top", "top", -0.5 * top[0], low[2] + 0.3 * top[2]);
    }
    if lifted {
        text += &format!(
            "[[action]]\nkind = \"lift\"\nname = \"lift-top\"\ntarget = \"top\"\nat = [0.0, 0.0, {}]\nheight = 0.03\nhold = 0.5\n",
            low[2] + top[2]
        );
    }
    Stack {
        scene: parsed(&text),
        glued: bond > 0,
        breakaway,
        lifted,
    }
}

/// One pull of a door (or a drawer) by so many degrees of a hinge of this radius; returns the radius.
pub fn ajar(seed: u64, degrees: f64, hinge: bool) -> (Scene, f64) {
    let dice = &mut rng_for(Seed(seed), "ajar");
    let level = (seed % 3) as usize;
    let radius = dice.random_range(0.2..0.5);
    let travel = radius * degrees.to_radians();
    let mut text = head("ajar", level, seed);
    text += &base().text();
    let axis: Vector3<f64> = if hinge { Vector3::z() } else { Vector3::y() };
    let kind = if hinge { "revolute" } else { "prismatic" };
    text += &format!(
        "[[body]]\nname = \"leaf\"\nshape = {{ kind = \"box\", size = [{radius}, 0.02, 0.3] }}\nposition = [{}, 0.0, {HIGH}]\ndensity = 300.0\nknown_mesh = true\n",
        0.5 * (BASE + radius) + 0.002
    );
    text += &format!(
        "[[joint]]\na = \"base\"\nb = \"leaf\"\nkind = \"{kind}\"\naxis = [{}, {}, {}]\norigin = [{}, 0.0, {HIGH}]\nfriction = {}\n",
        axis.x,
        axis.y,
        axis.z,
        0.5 * BASE,
        if hinge { 0.1 } else { 0.5 }
    );
    text += &format!(
        "[[action]]\nkind = \"pull\"\nname = \"pull\"\ntarget = \"leaf\"\nat = [{}, 0.0, {HIGH}]\ndirection = [0.0, 1.0, 0.0]\ntravel = {travel}\nspeed = {}\npin = true\narc = true\n",
        0.5 * BASE + radius,
        (0.5 * travel).max(0.01)
    );
    (parsed(&text), radius)
}
