//! What these data say nothing of, and what would show it. Each cause of the catalogue stands in one place.

use crate::twin::Experiment;

/// What there was to be tried.
#[derive(Clone, Copy, Debug, Default)]
pub struct Has {
    /// A tool read its force.
    pub force: bool,
    /// The model has a joint.
    pub joint: bool,
    /// Pushes, presses, and motions of a joint were tried on their laws.
    pub pushed: bool,
    pub pressed: bool,
    pub turned: bool,
}

/// The touch of which a cause is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Touch {
    Push,
    Press,
    Joint,
    /// Of a sensor or a thing, whatever is done with it.
    Any,
}

/// Causes that show by the same touch, whether its force has to be read, and whether a whole round of such touches would do as well.
struct Show {
    touch: Touch,
    force: bool,
    round: bool,
    causes: &'static [&'static str],
    words: &'static str,
}

const fn show(touch: Touch, force: bool, causes: &'static [&'static str], words: &'static str) -> Show {
    Show {
        touch,
        force,
        round: false,
        causes,
        words,
    }
}

/// One that a whole round of touches shows too.
const fn part(touch: Touch, causes: &'static [&'static str], words: &'static str) -> Show {
    Show {
        round: true,
        ..show(touch, true, causes, words)
    }
}

/// Of so many that a round of touches would show the round is asked for.
const MANY: usize = 3;

const RECORD: &str = "no force was recorded: push each thing along the table, and press into what may give, with a tool that reads its force";
const JOINTED: &str =
    "nothing here hangs on a joint: to be asked only of a thing that does, moved through all of its range";
const PUSH: &str =
    "push each thing along the table from all sides, over one spot, at four speeds, at once and after a while";
const PRESS: &str =
    "press into what may give, to several depths at two rates, hold each for three seconds, and do the deepest twice";
const TURN: &str = "move the joint through all of its range and back, by a handle, at four speeds";

/// What shows each cause where touches of its kind were made, and not so that it showed.
const SHOWS: [Show; 32] = [
    part(
        Touch::Push,
        &["velocity-weakening-friction", "viscous-friction", "rate-state-friction"],
        "push along one line at four speeds or more, each twice as fast as the one before",
    ),
    part(
        Touch::Push,
        &["static-ageing", "breakaway-bond"],
        "repeat the first push at once and after a wait of a minute",
    ),
    part(
        Touch::Push,
        &["anisotropic-friction"],
        "push through the same place along four headings, then turn the object by 90 degrees and repeat",
    ),
    part(
        Touch::Push,
        &["friction-patch", "bump", "magnet", "hidden-body"],
        "push across the same place in both directions, and stop, retreat and push on along the same way",
    ),
    part(
        Touch::Push,
        &["support-tilt", "gravity-error", "tether"],
        "push far along four headings and back",
    ),
    show(
        Touch::Push,
        true,
        &["wear-or-heating"],
        "repeat one push over and over for some minutes, with a pause in the middle",
    ),
    show(
        Touch::Push,
        true,
        &["load-dependent-friction"],
        "weigh it, hold it, and drag it while pressing it down with three forces, up to twice its weight",
    ),
    show(
        Touch::Any,
        false,
        &["rolling-resistance"],
        "push what is round so that it rolls on by itself, at two speeds and along two headings",
    ),
    show(
        Touch::Any,
        false,
        &["com-offset", "contact-point-offset", "uneven-support-pressure"],
        "push all four sides off the middle, to either side of it, three times or more each",
    ),
    show(
        Touch::Push,
        true,
        &["tool-friction", "force-crosstalk"],
        "push a face squarely, then at 30 degrees from either side, so that the finger slides along it",
    ),
    show(
        Touch::Push,
        true,
        &["contact-law", "presliding"],
        "push slowly three times or more, with force and path read so fast that the rise of the force is seen, and press the finger \
         on a rigid stop",
    ),
    show(
        Touch::Any,
        false,
        &["yaw-inertia", "nonuniform-density"],
        "lift it and twist it to and fro about the vertical, or push it fast off its middle and let it spin until it rests",
    ),
    show(
        Touch::Push,
        true,
        &["loose-mass"],
        "start and stop the body at two accelerations and let it coast; then tilt it and wait",
    ),
    show(
        Touch::Any,
        true,
        &["added-inertia"],
        "weigh the body, then lift it and move it 4 cm to and fro within a third of a second each way, or push it fast and let it go",
    ),
    show(
        Touch::Any,
        false,
        &["length-scale", "tracking-error"],
        "push five times or more, 2 cm and farther, squarely and in two directions, with tool and body tracked",
    ),
    show(
        Touch::Any,
        false,
        &["time-delay", "clock-drift"],
        "push four times or more at two speeds, early and late, with tool and body tracked",
    ),
    show(
        Touch::Any,
        true,
        &["force-gain"],
        "hang known weights on the tool and lift them",
    ),
    show(
        Touch::Any,
        true,
        &["force-bias", "force-bias-world", "force-drift"],
        "hold the tool free for half a second before each touch, early and late, and turned by 90 degrees about the vertical",
    ),
    show(
        Touch::Any,
        true,
        &["sensor-lag"],
        "start and stop three touches or more sharply, with the force read 200 times a second",
    ),
    show(
        Touch::Any,
        true,
        &["force-saturation", "quantisation", "outliers"],
        "read the force at rest and through every touch, as the sensor gives it",
    ),
    part(
        Touch::Press,
        &[
            "hardening-stiffness",
            "second-stage",
            "power-law-stiffness",
            "snap-through",
        ],
        "press in fine steps of depth to the deepest that is safe",
    ),
    part(
        Touch::Press,
        &["elastic-damping", "stress-relaxation"],
        "press at two rates that differ tenfold and hold each for three seconds",
    ),
    part(
        Touch::Press,
        &[
            "plastic-set",
            "elastic-hysteresis",
            "guide-friction",
            "softening-by-use",
        ],
        "press, turn back half way and press again, then repeat a shallow press",
    ),
    show(
        Touch::Press,
        true,
        &["preload", "adhesion"],
        "press slowly and leave slowly, with the tool free before and after",
    ),
    show(
        Touch::Press,
        true,
        &["stiffness-drift"],
        "repeat the same press at once and after some minutes",
    ),
    show(
        Touch::Press,
        true,
        &["support-compliance"],
        "press twice on something much stiffer, in view of the track",
    ),
    part(
        Touch::Joint,
        &["joint-damping", "joint-quadratic-damping", "soft-close"],
        "move the joint through the same range at four speeds, each twice as fast as the one before",
    ),
    part(
        Touch::Joint,
        &["joint-spring", "joint-gravity", "limit-compliance", "detent", "latch"],
        "move the joint slowly through all of its range both ways, past its closed end if it can",
    ),
    part(
        Touch::Joint,
        &["joint-stiction", "backlash", "joint-loose-mass"],
        "reverse the joint in small steps, each a little larger than the one before, then start and stop it sharply",
    ),
    show(
        Touch::Joint,
        true,
        &["lever-arm"],
        "move the joint by a handle at half the radius",
    ),
    show(
        Touch::Joint,
        false,
        &["moving-axis"],
        "move the joint slowly through all of its range, with what hangs on it tracked in position and rotation",
    ),
    show(
        Touch::Joint,
        false,
        &["joint-coupling"],
        "move the joint twice with every other joint near it tracked: what moves along with it is geared to it",
    ),
];

impl Show {
    fn of(&self, unseen: &[&'static str]) -> Vec<&'static str> {
        let own = self.causes.iter().copied();
        own.filter(|c| unseen.contains(c)).collect()
    }

    /// What to do, given what there is.
    fn words(&self, has: &Has, unseen: &[&'static str]) -> &'static str {
        let alike = SHOWS.iter().filter(|s| s.round && s.touch == self.touch);
        let round = self.round && alike.filter(|s| !s.of(unseen).is_empty()).count() >= MANY;
        match self.touch {
            Touch::Joint if !has.joint => JOINTED,
            _ if self.force && !has.force => RECORD,
            Touch::Joint if round || (self.force && !has.turned) => TURN,
            Touch::Push if round || !has.pushed => PUSH,
            Touch::Press if round || !has.pressed => PRESS,
            _ => self.words,
        }
    }
}

/// One experiment for all causes that the same touch would show.
pub fn showing(unseen: &[&'static str], has: &Has) -> Vec<Experiment> {
    let mut out: Vec<Experiment> = Vec::new();
    for show in &SHOWS {
        let own: Vec<String> = show.of(unseen).into_iter().map(str::to_owned).collect();
        let words = show.words(has, unseen);
        if own.is_empty() {
            continue;
        }
        match out.iter_mut().find(|e| e.words == words) {
            Some(known) => known.parts.extend(own),
            None => out.push(Experiment {
                words: words.into(),
                parts: own,
                bits: None,
                touches: Vec::new(),
            }),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::CAUSES;

    #[test]
    fn each_cause_is_shown_by_one_touch_whatever_there_is() {
        for k in 0..32_u8 {
            let bit = |n: u8| k & (1 << n) != 0;
            let has = Has {
                force: bit(0),
                joint: bit(1),
                pushed: bit(2),
                pressed: bit(3),
                turned: bit(4),
            };
            let mut listed: Vec<String> = showing(&CAUSES, &has).into_iter().flat_map(|e| e.parts).collect();
            let mut all = CAUSES.map(str::to_owned).to_vec();
            listed.sort();
            all.sort();
            assert_eq!(listed, all, "{has:?}");
        }
    }

    #[test]
    fn what_is_not_there_is_said_once() {
        let asked = |cause: &'static str, has: Has| showing(&[cause], &has)[0].words.clone();
        let pushed = Has {
            force: true,
            pushed: true,
            ..Has::default()
        };
        let many = showing(&["viscous-friction", "bump", "static-ageing", "loose-mass"], &pushed);
        assert_eq!(many.iter().map(|e| e.parts.len()).collect::<Vec<_>>(), [3, 1]);
        assert_eq!(asked("soft-close", pushed), JOINTED);
        assert!(asked("viscous-friction", pushed).starts_with("push along one line"));
        assert_eq!(asked("viscous-friction", Has::default()), RECORD);
        assert_eq!(asked("guide-friction", pushed), PRESS);
        assert_eq!(asked("quantisation", Has::default()), RECORD);
    }
}
