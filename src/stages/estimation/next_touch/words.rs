//! What a choice of touches says of itself.

use super::belief::{Belief, State};
use super::candidates::{Candidate, Way};
use super::expected::information;
use super::verb::{Known, NextTouch, Scene, TouchChoice};
use crate::capture::{Kind, Touch};

impl NextTouch {
    pub(super) fn choice(&self, scene: &Scene, candidate: &Candidate, bits: f64) -> TouchChoice {
        let thing = &scene.known[candidate.thing];
        let back = scene.plane.inverse();
        let label = match candidate.way {
            Way::Coast => "coast",
            _ => candidate.kind.name(),
        };
        let touch = Touch {
            name: format!("{label}-{}-{}", thing.name.replace('/', "-"), self.asked),
            kind: candidate.kind,
            target: Some(thing.name.clone()),
            start: back * candidate.start,
            direction: back * candidate.direction,
            travel: candidate.travel,
            speed: candidate.speed,
            duration: candidate.duration,
            held_out: false,
        };
        let after = thing.belief.information + information(candidate, &thing.belief.mean, &scene.senses);
        let (old, new) = (Belief::doubts(&thing.belief.information), Belief::doubts(&after));
        let told: Vec<String> = self
            .named(&old)
            .into_iter()
            .zip(self.named(&new))
            .zip(old.iter().zip(&new))
            .filter(|(_, (old, new))| **new < 0.8 * **old)
            .map(|(((name, before), (_, after)), _)| format!("{name} from {before} to {after}"))
            .collect();
        let brings = if told.is_empty() {
            "a little of everything".into()
        } else {
            told.join(", ")
        };
        TouchChoice {
            why: format!("{}, worth {bits:.1} bits: {brings}", candidate.words),
            touch,
            bits,
            key: candidate.key.clone(),
        }
    }

    /// The wanted quantities with their doubts in words.
    fn named(&self, doubts: &State) -> [(&'static str, String); 3] {
        let percent = |sd: f64| match sd {
            sd if sd > 0.3 => format!("a factor of {:.1}", (1.96 * sd).exp()),
            sd => format!("{:.1} %", 100.0 * sd),
        };
        [
            ("mass", percent(doubts[0])),
            ("friction", percent(doubts[1])),
            ("centre of mass", format!("{:.1} mm", 1e3 * doubts[2].max(doubts[3]))),
        ]
    }

    pub(super) fn missing(&self, doubts: &State) -> Vec<&'static str> {
        let floors = self.floors();
        let mut out = Vec::new();
        for (k, name) in [(0, "mass"), (1, "friction"), (2, "centre of mass")] {
            let doubt = if k == 2 { doubts[2].max(doubts[3]) } else { doubts[k] };
            if doubt > floors[k] {
                out.push(name);
            }
        }
        out
    }

    pub(super) fn remedy(&self, never: &[&str]) -> String {
        let lacks = |kind: Kind| !self.kinds.contains(&kind);
        let mut ways = Vec::new();
        if lacks(Kind::Lift) {
            ways.push("a lift");
        }
        if never.contains(&"friction") && lacks(Kind::Push) {
            ways.push("a push");
        }
        if lacks(Kind::Tilt) && never.contains(&"mass") {
            ways.push("a tilt of the support");
        }
        if ways.is_empty() {
            "more precise sensors, or more room around it".into()
        } else {
            format!("it would take {}", ways.join(" or "))
        }
    }

    pub(super) fn open(&self, scene: &Scene) -> String {
        let of = |known: &Known| {
            let doubts = Belief::doubts(&known.belief.information);
            let said = self.named(&doubts).map(|(name, doubt)| format!("{name} to {doubt}"));
            format!("{}: {}", known.name, said.join(", "))
        };
        let open: Vec<String> = scene.known.iter().filter(|k| !k.met).map(of).collect();
        open.join("; ")
    }
}
