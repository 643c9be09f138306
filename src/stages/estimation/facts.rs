//! What the interactions say of each link, before anything is concluded from it.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::Config;
use super::accelerate::{Accelerated, Tried, accelerated, borne_out};
use super::basins::Basin;
use super::coast::{Coast, Shape, coast_of};
use super::company::{Company, company, noted};
use super::evidence::{mean_wrench, tare_of};
use super::face::Face;
use super::glide::glide;
use super::lift::{Weighing, weigh};
use super::press::{Press, press_of};
use super::push::{Plane, Push, read_push_on};
use super::rolling::tumbles;
use super::shoved::shoved;
use super::spin::Spun;
use super::tilt::{Slide, slide_of};
use super::twist::{Twist, twisted};
use crate::base::Notices;
use crate::capture::{Capture, Interaction, Kind, Phase, PhaseKind, Segmented};
use crate::twin::{Model, Twin};

/// The findings about one link.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    pub weighings: Vec<Weighing>,
    pub slides: Vec<Slide>,
    /// Ends of pushes in which the link slid on by itself.
    pub coasts: Vec<Coast>,
    /// Pushes and pulls in which its inertia might have shown.
    pub tried: Vec<Tried>,
    /// Those in which it did.
    pub accelerated: Vec<Accelerated>,
    /// Fast pushes that were followed as a whole, coasting and all.
    pub shoved: Vec<Accelerated>,
    /// What those say of how it turns.
    pub spins: Vec<Spun>,
    /// Lifts in which it was twisted about the vertical.
    pub twists: Vec<Twist>,
    /// Where the starts of their fits ended.
    pub basins: Vec<(String, Vec<Basin>)>,
    /// Pushes in which the link moved alone.
    pub pushes: Vec<Push>,
    /// Pushes in which other links moved along as one rigid group.
    pub shared: Vec<(Vec<String>, Push)>,
    pub presses: Vec<Press>,
}

impl Facts {
    /// Driven motions as a source of mass, where nothing else is: a slope or a bias of the force that nobody mentioned
    /// pulls at them, and hardly at a weighing.
    pub fn driven(&self) -> &[Accelerated] {
        let otherwise = !self.weighings.is_empty() || !self.slides.is_empty();
        match (otherwise, self.shoved.is_empty(), self.coasts.is_empty()) {
            (true, ..) | (false, true, false) => &[],
            (false, false, _) => &self.shoved,
            (false, true, true) => &self.accelerated,
        }
    }

    /// Takes in what another interaction says.
    fn append(&mut self, other: Self) {
        self.weighings.extend(other.weighings);
        self.slides.extend(other.slides);
        self.coasts.extend(other.coasts);
        self.tried.extend(other.tried);
        self.accelerated.extend(other.accelerated);
        self.shoved.extend(other.shoved);
        self.spins.extend(other.spins);
        self.twists.extend(other.twists);
        self.basins.extend(other.basins);
        self.pushes.extend(other.pushes);
        self.shared.extend(other.shared);
        self.presses.extend(other.presses);
    }

    /// Nothing was found out.
    pub fn is_empty(&self) -> bool {
        self.weighings.is_empty()
            && self.slides.is_empty()
            && self.pushes.is_empty()
            && self.shared.is_empty()
            && self.presses.is_empty()
    }
}

/// Where the world is: gravity and the support.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    pub gravity: Vector3<f64>,
    pub plane: Plane,
    pub point: Point3<f64>,
}

/// Gravity and support from the twin, else from the capture, else a level table at the origin.
pub(super) fn ground_of(capture: &Capture, twin: &Twin) -> Ground {
    let up = (-capture.gravity).try_normalize(1e-9).unwrap_or(Vector3::z());
    let (point, normal) = match (&capture.support, &twin.support) {
        (Some(s), _) => (s.point, s.normal.into_inner()),
        (None, Some(s)) => (Point3::from(s.point), Vector3::from(s.normal)),
        (None, None) => (Point3::origin(), up),
    };
    Ground {
        gravity: capture.gravity,
        plane: Plane::of(normal.try_normalize(1e-9).unwrap_or(up)),
        point,
    }
}

/// The link that an interaction is about: its target, else what it touched, else what moved most.
pub(super) fn subject<'a>(interaction: &'a Interaction, segmented: &'a Segmented) -> Option<&'a str> {
    let touched = segmented.phases.iter().find_map(|p| p.touched.first());
    let moved = segmented.phases.iter().find_map(|p| p.moving.first());
    let only = (interaction.tracks.len() == 1)
        .then(|| interaction.tracks.keys().next())
        .flatten();
    interaction
        .target
        .as_ref()
        .or(touched)
        .or(moved)
        .or(only)
        .map(String::as_str)
}

/// Reads every interaction that may be used to fit.
pub(super) fn gather(
    capture: &Capture,
    segmented: &[Segmented],
    ground: &Ground,
    model: &Model,
    shapes: &BTreeMap<String, Shape>,
    config: &Config,
    notices: &mut Notices,
) -> BTreeMap<String, Facts> {
    let fitted: Vec<&Interaction> = capture.fitted().collect();
    // Each is read by itself; what they say is put together in their own order.
    let read = fitted.par_iter().filter_map(|interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let link = subject(interaction, cut)?;
        let (mut found, mut notices) = (Facts::default(), Notices::default());
        let shape = shapes.get(link);
        let read = read_one(
            interaction,
            cut,
            link,
            ground,
            model,
            shape,
            config,
            &mut notices,
            &mut found,
        );
        // A motion without a force was never meant to tell of matter.
        if !read && (interaction.force.is_some() || interaction.support_path.is_some()) {
            notices.note(
                "estimation",
                &interaction.name,
                format!(
                    "nothing about the matter of `{link}` could be read from this {:?}",
                    interaction.kind
                )
                .to_lowercase(),
            );
        }
        Some((link, found, notices))
    });
    let mut facts: BTreeMap<String, Facts> = BTreeMap::new();
    for (link, found, doubts) in read.collect::<Vec<_>>() {
        facts.entry(link.to_string()).or_default().append(found);
        notices.0.extend(doubts.0);
    }
    for found in facts.values_mut() {
        found.accelerated = borne_out(&found.tried);
    }
    facts
}

/// Reads one interaction into the facts of its link; false where it said nothing.
#[expect(clippy::too_many_arguments, reason = "one row of the table of kinds")]
fn read_one(
    interaction: &Interaction,
    cut: &Segmented,
    link: &str,
    ground: &Ground,
    model: &Model,
    shape: Option<&Shape>,
    config: &Config,
    notices: &mut Notices,
    facts: &mut Facts,
) -> bool {
    match interaction.kind {
        Kind::Lift => {
            let found = weigh(interaction, cut, link, &ground.gravity, config.force_gain_sd());
            facts.weighings.extend(found.clone());
            let alone = found.as_ref().is_some_and(|w| w.along.is_empty());
            let twist = || twisted(interaction, cut, link, &ground.gravity, config.force_gain_sd());
            facts.twists.extend(alone.then(twist).flatten());
            found.is_some()
        }
        Kind::Tilt => {
            let found = slide_of(interaction, cut, link, &ground.gravity, &ground.point, config);
            facts.slides.extend(found.clone());
            found.is_some()
        }
        Kind::Press => {
            let found = pressed(interaction, cut, link, ground, notices);
            facts.presses.extend(found.clone());
            found.is_some()
        }
        Kind::Pull if !felt(interaction, cut) => false,
        Kind::Push | Kind::Pull => {
            let company = company(interaction, cut, link, &model.twin);
            let track = interaction.tracks.get(link);
            if matches!(company, Company::Alone) && track.is_some_and(|t| tumbles(t, &ground.plane.normal)) {
                let words = format!("`{link}` rolls or tips over: how it slides does not show");
                notices.note("estimation", &interaction.name, words);
                return true;
            }
            let face = face_of(interaction, cut, link, model, ground);
            let face = face.as_ref();
            let alone = matches!(company, Company::Alone) && interaction.kind == Kind::Push;
            let shape = shape.filter(|_| alone);
            let whole = shape.and_then(|s| shoved(interaction, cut, link, ground, s, face, config));
            let whole = whole.map(|(whole, spin, basins)| {
                facts.spins.extend(spin);
                facts.basins.push((whole.interaction.clone(), basins));
                whole
            });
            // What was followed as a whole is not read a second time from its end.
            let shape = shape.filter(|_| whole.is_none());
            let coast = shape.and_then(|s| coast_of(interaction, cut, link, ground, s, config.model_form));
            if matches!(company, Company::Alone) && whole.is_none() {
                facts.tried.extend(accelerated(interaction, cut, link, ground, config));
            }
            let coasted = coast.is_some() || whole.is_some();
            facts.shoved.extend(whole);
            facts.coasts.extend(coast);
            let Some(push) = read_push_on(face, interaction, cut, link, ground, config) else {
                return coasted;
            };
            match company {
                Company::Alone => facts.pushes.push(push),
                Company::Rigid(others) => facts
                    .shared
                    .push((noted(others, link, &interaction.name, notices), push)),
                Company::Jointed => {}
            }
            true
        }
        Kind::Toss => {
            let shape = shape.filter(|_| interaction.tracks.len() == 1);
            facts
                .spins
                .extend(shape.and_then(|s| glide(interaction, cut, link, ground, s)));
            true
        }
        Kind::Hold => true,
    }
}

/// What a press says of the spring, with a word on what is beyond it.
fn pressed(
    interaction: &Interaction,
    cut: &Segmented,
    link: &str,
    ground: &Ground,
    notices: &mut Notices,
) -> Option<Press> {
    let found = press_of(interaction, cut, link, &-ground.plane.normal)?;
    if let Some(words) = &found.beyond {
        let words = format!("`{link}` where it was pressed: {words}");
        notices.note("estimation", &interaction.name, words);
    }
    Some(found)
}

/// Standard deviations of a mean force of at most so many rows from which on a pull was felt at all.
const FELT: (f64, f64) = (5.0, 100.0);

/// Parts of a slide of which one has to show it.
const PARTS: usize = 4;

/// Whether the force of a pull, which holds on all the way, shows while what it pulls moves.
fn felt(interaction: &Interaction, cut: &Segmented) -> bool {
    let (Some(stream), Some(noise)) = (&interaction.force, cut.force_noise) else {
        return true;
    };
    let tare = tare_of(interaction, cut);
    let mut slides = cut.of(PhaseKind::Slide).peekable();
    // A way out and back would leave nothing of the mean over all of it.
    let part = |p: &Phase, k: usize| {
        let at = |k: usize| p.start + k as f64 / PARTS as f64 * (p.end - p.start);
        let mean = mean_wrench(stream, at(k), at(k + 1), &tare);
        mean.is_none_or(|w| w.force.norm() > FELT.0 * noise / (w.rows as f64).min(FELT.1).sqrt())
    };
    let shows = |p: &Phase| (0..PARTS).any(|k| part(p, k));
    slides.peek().is_none() || slides.any(shows)
}

/// The face that the finger of a push meets.
pub(super) fn face_of(
    interaction: &Interaction,
    cut: &Segmented,
    link: &str,
    model: &Model,
    ground: &Ground,
) -> Option<Face> {
    let mesh = model.twin.link(link)?.mesh.as_ref()?;
    Face::of(interaction, cut, link, model.meshes.get(mesh)?, ground)
}
