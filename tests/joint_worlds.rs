//! Joints of small worlds with laws of their own, by closed forms: what is there is named, what is not is not, and what the
//! recordings do not tell is said to be open.
#![allow(clippy::expect_used, clippy::disallowed_macros, reason = "tests may panic")]

use nalgebra::{Point3, UnitQuaternion, Vector3};
use palpate::base::{Progress, Status};
use palpate::capture::{Capture, Interaction, Kind, Noise, PoseStream, Tool, ToolShape, WrenchStream};
use palpate::pipeline::{Options, Run, build};
use palpate::twin::Joint;

/// Way, speed and acceleration of a hand from place to place, at even speeds with soft ends, resting in between.
struct Way {
    rate: f64,
    position: Vec<f64>,
    speed: Vec<f64>,
    gain: Vec<f64>,
}

impl Way {
    fn new(stations: &[(f64, f64)], rate: f64) -> Self {
        let rest = (0.5 * rate) as usize;
        let mut position = vec![stations[0].0; rest];
        for pair in stations.windows(2) {
            let (from, (to, speed)) = (pair[0].0, pair[1]);
            let steps = (1.25 * (to - from).abs() / speed * rate) as usize;
            let pace = |i: usize| {
                let s = i as f64 / steps as f64;
                let v = (s / 0.12).min((1.0 - s) / 0.12).min(1.0);
                v * v * (3.0 - 2.0 * v)
            };
            let whole: f64 = (1..=steps).map(pace).sum();
            let mut gone = 0.0;
            for i in 1..=steps {
                gone += pace(i);
                position.push(from + (to - from) * gone / whole);
            }
            position.extend(std::iter::repeat_n(to, rest));
        }
        let speed = slope(&position, rate);
        let gain = slope(&speed, rate);
        Self {
            rate,
            position,
            speed,
            gain,
        }
    }
}

fn slope(x: &[f64], rate: f64) -> Vec<f64> {
    let at = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(x.len() - 1));
        (x[b] - x[a]) * rate / (b - a) as f64
    };
    (0..x.len()).map(at).collect()
}

/// Noise of unit standard deviation, the same every time.
struct Dice(u64);

impl Dice {
    fn even(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }

    fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next()) * size
    }
}

/// How a joint turns or shifts what it carries, and where a hand holds that.
#[derive(Clone, Copy)]
struct Guide {
    axis: Vector3<f64>,
    /// Of a hinge.
    origin: Option<Point3<f64>>,
    hand: Point3<f64>,
}

impl Guide {
    fn turn(&self, q: f64) -> UnitQuaternion<f64> {
        let turns = self.origin.is_some();
        UnitQuaternion::from_scaled_axis(self.axis * if turns { q } else { 0.0 })
    }

    fn moved(&self, p: Point3<f64>, q: f64) -> Point3<f64> {
        match self.origin {
            Some(o) => o + self.turn(q) * (p - o),
            None => p + self.axis * q,
        }
    }

    /// The force for a load along it.
    fn force(&self, q: f64, load: f64) -> Vector3<f64> {
        let Some(o) = self.origin else { return self.axis * load };
        let way = self.axis.cross(&(self.moved(self.hand, q) - o));
        way * (load / way.norm_squared())
    }
}

/// A link's track: where it is at the joint's 0, how far it goes with the joint, m of noise.
fn track(guide: &Guide, way: &[f64], time: &[f64], home: Point3<f64>, noise: [f64; 2], dice: &mut Dice) -> PoseStream {
    PoseStream {
        time: time.to_vec(),
        position: way
            .iter()
            .map(|q| guide.moved(home, *q) + dice.vector(noise[0]))
            .collect(),
        rotation: way
            .iter()
            .map(|q| Some(UnitQuaternion::from_scaled_axis(dice.vector(noise[1])) * guide.turn(*q)))
            .collect(),
    }
}

/// A world of one joint: its law gives the load of time, position, speed and acceleration.
struct World<'a> {
    guide: Guide,
    law: &'a dyn Fn(&Way, usize) -> f64,
    /// Noise of the tracks, m and rad.
    noise: [f64; 2],
    /// By how much the tracks are late, rows.
    late: usize,
}

impl World<'_> {
    fn capture(&self, ways: &[Way]) -> Capture {
        let mut dice = Dice(7);
        let mut begin = 2.0;
        let mut interactions = Vec::new();
        for (k, way) in ways.iter().enumerate() {
            let n = way.position.len();
            let time: Vec<f64> = (0..n).map(|i| begin + i as f64 / way.rate).collect();
            begin = time[n - 1] + 4.0;
            let force = (0..n).map(|i| self.guide.force(way.position[i], (self.law)(way, i)) + dice.vector(0.05));
            let force: Vec<Vector3<f64>> = force.collect();
            let seen: Vec<f64> = (0..n).map(|i| way.position[i.saturating_sub(self.late)]).collect();
            let still = vec![0.0; n];
            let mut tracks = std::collections::BTreeMap::new();
            let home = |x: f64| self.guide.origin.unwrap_or(Point3::new(0.4, 0.0, 0.3)) + Vector3::new(x, 0.0, 0.0);
            let mut link = |name: &str, way: &[f64], at: f64| {
                let path = track(&self.guide, way, &time, home(at), self.noise, &mut dice);
                tracks.insert(name.to_owned(), path);
            };
            link("case", &still, -0.1);
            link("leaf", &seen, 0.3);
            let force = WrenchStream {
                time: time.clone(),
                force,
                torque: None,
            };
            let mut noiseless = track(&self.guide, &way.position, &time, self.guide.hand, [0.0; 2], &mut dice);
            noiseless.position.iter_mut().for_each(|p| *p += dice.vector(5e-5));
            noiseless
                .rotation
                .iter_mut()
                .for_each(|q| *q = Some(UnitQuaternion::identity()));
            interactions.push(Interaction {
                name: format!("pull-{k:02}"),
                kind: Kind::Pull,
                action: None,
                tool_name: None,
                tool: Some(Tool {
                    shape: ToolShape::Sphere { radius: 0.01 },
                    grip: false,
                    pin: true,
                }),
                target: Some("leaf".into()),
                force: Some(force),
                tool_path: Some(noiseless),
                support_path: None,
                tracks,
                frames: None,
                held_out: k % 4 == 3,
            });
        }
        Capture {
            root: ".".into(),
            name: "world".into(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            support: None,
            cameras: Vec::new(),
            views: Vec::new(),
            bodies: Vec::new(),
            noise: Noise::default(),
            interactions,
            truth: None,
            digest: String::new(),
        }
    }

    fn run(&self, ways: &[Way]) -> Run {
        build(&self.capture(ways), &Options::default(), &Progress::silent()).expect("a run")
    }
}

fn drawer() -> Guide {
    Guide {
        axis: Vector3::x(),
        origin: None,
        hand: Point3::new(0.6, 0.0, 0.3),
    }
}

fn dry(v: f64) -> f64 {
    (v / 2e-3).tanh()
}

/// Out and back at these speeds, every other time by four fifths of the way.
fn out_and_back(far: f64, speeds: &[f64], rate: f64) -> Vec<Way> {
    let each = speeds.iter().enumerate();
    each.map(|(i, v)| {
        let to = if i % 2 == 0 { far } else { 0.8 * far };
        Way::new(&[(0.0, 0.0), (to, *v), (0.0, *v)], rate)
    })
    .collect()
}

fn names(run: &Run) -> Vec<(&str, f64)> {
    let each = run.diagnosis.findings.iter();
    each.map(|f| (f.cause.as_str(), f.probability)).collect()
}

fn joint<'a>(run: &'a Run, child: &str) -> &'a Joint {
    run.model
        .twin
        .joints()
        .find(|j| j.child == child || j.parent == child)
        .expect("a joint")
}

fn parameter(run: &Run, cause: &str, name: &str) -> f64 {
    let found = run.diagnosis.findings.iter().find(|f| f.cause == cause);
    found.expect("the cause").parameters[name].value
}

#[test]
fn tracks_behind_the_hand_are_a_delay_and_no_damping() {
    let law = |w: &Way, i: usize| 3.0 * w.gain[i] + 4.0 * dry(w.speed[i]) + 25.0 * w.position[i];
    let world = World {
        guide: drawer(),
        law: &law,
        noise: [2e-4, 1e-3],
        late: 12,
    };
    let way = |v: &f64| Way::new(&[(0.0, 0.0), (0.3, *v), (0.05, *v), (0.25, *v), (0.0, *v)], 200.0);
    let ways: Vec<Way> = [0.1, 0.2, 0.4, 0.6, 0.1, 0.2, 0.4, 0.6].iter().map(way).collect();
    let run = world.run(&ways);
    assert!(
        (parameter(&run, "time-delay", "tau") - 0.06).abs() < 1.5e-3,
        "{:?}",
        names(&run)
    );
    let joint = joint(&run, "leaf");
    assert!(joint.damping.is_none(), "{:?}", joint.damping);
    let stiffness = joint.stiffness.as_ref().expect("a spring");
    assert!((stiffness.value / 25.0 - 1.0).abs() < 0.02, "{stiffness:?}");
    // The hand holds from the first row on: a bias of the force would move the spring's rest.
    let rest = joint.rest.as_ref().expect("a rest");
    assert!(rest.status == Status::Assumed && rest.confounded.is_some(), "{rest:?}");
}

#[test]
fn a_weight_that_is_held_from_the_first_row_on_is_no_tare() {
    let law = |w: &Way, i: usize| 0.08 * w.gain[i] + 0.05 * dry(w.speed[i]) + 0.88 * w.position[i].cos();
    let guide = Guide {
        axis: -Vector3::y(),
        origin: Some(Point3::new(0.0, 0.0, 0.2)),
        hand: Point3::new(0.3, 0.0, 0.2),
    };
    let world = World {
        guide,
        law: &law,
        noise: [3e-4, 2e-3],
        late: 0,
    };
    let run = world.run(&out_and_back(1.3, &[0.2, 0.4, 0.8, 0.3, 0.5], 100.0));
    assert_eq!(
        names(&run).first().map(|n| n.0),
        Some("joint-gravity"),
        "{:?}",
        names(&run)
    );
    assert!((parameter(&run, "joint-gravity", "gc").abs() - 0.88).abs() < 0.02);
    let friction = joint(&run, "leaf").friction.as_ref().expect("friction");
    let [low, high] = friction.ci95.expect("an interval");
    assert!(low < 0.05 && 0.05 < high, "{friction:?}");
}
