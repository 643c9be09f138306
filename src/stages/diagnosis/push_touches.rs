//! Pushes that could be made next, as the family of pushes foretells them: straight through the centre of mass, so that nothing turns.

use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};

use super::asking::Imagined;
use super::family::{Channel, Group};
use super::push_states::{RINGING, State, doubts};
use super::push_windows::{EDGES, WIDTH};
use super::pushes::Pushes;
use crate::math::{median, quantile};
use crate::stages::estimation::{PushLine, push_lines};
use crate::twin::{AskedTouch, Model};

/// How a body can be pushed, with the body as it stood at first.
#[derive(Clone, Debug)]
pub struct Ready {
    lines: Vec<PushLine>,
    /// The middle of its top, where a hand can hold it.
    top: Point3<f64>,
    /// Its weight was measured: then a load on it can be told.
    weighed: bool,
}

impl Ready {
    /// Of a body that is one link; nothing where its shape is not known.
    pub fn of(model: &Model, plane: &[Vector3<f64>; 2], name: &str) -> Option<Self> {
        let link = model.twin.link(name)?;
        let (lines, top) = push_lines(model, &plane[0].cross(&plane[1]), link, 0.0)?;
        let weighed = link.mass.as_ref().is_some_and(crate::base::Estimate::is_told);
        (!lines.is_empty()).then_some(Self { lines, top, weighed })
    }
}

/// How far a body may begin from where it usually does to count as put back, m, and in which share of its pushes it has to.
const PUT_BACK: f64 = 0.012;
const MOSTLY: f64 = 0.6;
/// Ways of a push, m: as usual, and a long one.
const TRAVELS: [f64; 2] = [0.045, 0.1];
/// Speeds, m/s, the usual one first, and how long the tool stays at the end, s.
const SPEEDS: [f64; 5] = [0.03, 0.004, 0.012, 0.08, 0.16];
const STAYS: f64 = 0.3;
/// A pause and one that lets a contact age, s.
const WAITS: [f64; 2] = [2.0, 100.0];
/// Loads of a hand over the weight.
const LOADS: [f64; 3] = [0.0, 1.0, 2.5];
/// By how much a tool is turned, rad.
const TURNED: f64 = std::f64::consts::FRAC_PI_2;

/// One push of the pool.
struct Touch<'a> {
    body: usize,
    line: &'a PushLine,
    travel: f64,
    speed: f64,
    wait: f64,
    /// Load of the hand over the weight, where a hand holds it.
    load: Option<f64>,
    turned: f64,
}

impl Pushes {
    /// This family with the pushes that could be made next.
    pub(super) fn with_touches(&self) -> Option<Imagined> {
        let mut family = self.clone();
        let mut touches = Vec::new();
        for (body, ready) in self.ready.iter().enumerate() {
            let (Some(ready), Some(start)) = (ready, self.start_of(body)) else {
                continue;
            };
            for touch in pool(body, ready) {
                let states = self.states_of(&touch, start);
                family.sheet.groups.push(self.group_of(&touch, &states));
                family.along.push(self.flat(&touch.line.direction));
                family.states.push(states);
                family.bodies.push(body);
                touches.push(self.asked(&touch, ready));
            }
        }
        (!touches.is_empty()).then(|| Imagined {
            family: Box::new(family),
            touches,
        })
    }

    fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(v.dot(&self.plane[0]), v.dot(&self.plane[1]))
    }

    /// Where a body begins: where it is put back to before each push, or where it was at first.
    fn start_of(&self, body: usize) -> Option<Vector2<f64>> {
        let own = (0..self.done).filter(|g| self.bodies[*g] == body);
        let begins: Vec<Vector2<f64>> = own
            .filter_map(|g| self.states[g].iter().find(|s| s.contact))
            .map(|s| s.at - s.heading * s.slip)
            .collect();
        let axis = |k: usize| median(&begins.iter().map(|b| b[k]).collect::<Vec<f64>>());
        let usual = Vector2::new(axis(0)?, axis(1)?);
        let near = begins.iter().filter(|b| (*b - usual).norm() < PUT_BACK).count();
        let put_back = near as f64 >= MOSTLY * begins.len() as f64;
        if put_back { Some(usual) } else { begins.first().copied() }
    }

    fn states_of(&self, touch: &Touch, start: Vector2<f64>) -> Vec<State> {
        let own = || (0..self.done).filter(|g| self.bodies[*g] == touch.body);
        let moved: Vec<&State> = own().flat_map(|g| &self.states[g]).filter(|s| s.contact).collect();
        let forces: Vec<f64> = moved.iter().map(|s| s.force.norm()).collect();
        // What turns needs less.
        let force = quantile(&forces, 0.8).unwrap_or(0.0);
        let blows = own().filter_map(|g| self.states[g].iter().find(|s| s.contact));
        let blows: Vec<f64> = blows.map(|s| s.ringing / s.speed.max(1e-4)).collect();
        let blow = median(&blows).unwrap_or(0.0) * touch.speed;
        let last = own().filter_map(|g| self.states[g].last()).map(|s| (s.time, s.worn));
        let (ended, worn) = last.fold((0.0, 0.0), |(t, w): (f64, f64), (u, x)| (t.max(u), w.max(x)));
        let along = self.flat(&touch.line.direction);
        let load = 1.0 + touch.load.unwrap_or(0.0);
        let state = |slip: f64, width: f64, contact: bool| State {
            time: ended + touch.wait + slip / touch.speed,
            wait: touch.wait,
            contact,
            first: false,
            since: slip / touch.speed,
            span: width / touch.speed,
            slip,
            worn: worn + slip,
            speed: touch.speed,
            turned: 0.0,
            heading: along,
            at: start + along * slip,
            turn: 0.0,
            loaded: if contact { load } else { 1.0 },
            force: if contact { along * force } else { Vector2::zeros() },
            inertia: 0.0,
            hurried: 0.0,
            ringing: blow * (-slip / touch.speed / RINGING).exp(),
            phases: [0.0; 2],
            tool: moved.first().map_or_else(UnitQuaternion::identity, |s| s.tool),
            veer: 0.0,
            twist: touch.turned,
            led: false,
        };
        let mut edges: Vec<f64> = EDGES.to_vec();
        while edges.last().is_some_and(|e| e + WIDTH < touch.travel) {
            edges.push(edges[edges.len() - 1] + WIDTH);
        }
        let rest = (0..2).map(|_| state(0.0, 0.0, false));
        let windows = edges.windows(2).map(|e| state(0.5 * (e[0] + e[1]), e[1] - e[0], true));
        rest.chain(windows).collect()
    }

    /// Nothing was read of it.
    fn group_of(&self, touch: &Touch, states: &[State]) -> Group {
        let spread = vec![0.0; states.len()];
        let channel = |kind: usize| Channel {
            kind,
            measured: vec![0.0; states.len()],
            starts: vec![true; states.len()],
            change: vec![0.0; states.len()],
            aside: doubts(states, &spread, kind),
        };
        Group {
            name: format!("touch of {}", self.names[touch.body]),
            held_out: false,
            channels: vec![channel(0), channel(1)],
        }
    }

    fn asked(&self, touch: &Touch, ready: &Ready) -> AskedTouch {
        let held = touch.load.is_some();
        let start = if held { ready.top } else { touch.line.start };
        AskedTouch {
            kind: if held { "pull" } else { "push" }.into(),
            target: self.names[touch.body].clone(),
            start: start.into(),
            direction: touch.line.direction.into(),
            travel: touch.travel,
            speed: touch.speed,
            duration: STAYS,
            wait: touch.wait,
            down: touch.load.unwrap_or(0.0) * self.loads[touch.body],
            turned: touch.turned,
            back: false,
        }
    }
}

fn pool<'a>(body: usize, ready: &'a Ready) -> Vec<Touch<'a>> {
    let plain = |line: &'a PushLine| Touch {
        body,
        line,
        travel: TRAVELS[0],
        speed: SPEEDS[0],
        wait: WAITS[0],
        load: None,
        turned: 0.0,
    };
    let mut out = Vec::new();
    for line in &ready.lines {
        out.push(plain(line));
        out.push(Touch {
            travel: TRAVELS[1],
            ..plain(line)
        });
        out.push(Touch {
            turned: TURNED,
            ..plain(line)
        });
        out.extend(SPEEDS[1..].iter().map(|speed| Touch {
            speed: *speed,
            ..plain(line)
        }));
        if ready.weighed {
            out.extend(LOADS.iter().map(|load| Touch {
                load: Some(*load),
                ..plain(line)
            }));
        }
    }
    out.extend(ready.lines.first().map(|line| Touch {
        wait: WAITS[1],
        ..plain(line)
    }));
    out
}
