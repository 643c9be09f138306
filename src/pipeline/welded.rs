//! A capture and a model as one that has no fixed joints: what they hold to each other is one thing with one track, and is
//! pushed, lifted and pressed as one.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::lumps::{as_lumps, lumps_of};
use super::{Options, assemble};
use crate::base::{Estimate, Notices, Pose, Result, Status};
use crate::capture::{Capture, Segmented};
use crate::stages::diagnosis::{Diagnosed, Level, Number, Path};
use crate::stages::estimation::{self, always_as_one};
use crate::twin::{Link, Lump, Lumped, Model, RelationKind};

/// What a diagnosis is made of, with one thing for all that moves as one.
pub(super) struct Welded {
    pub(super) capture: Capture,
    pub(super) segmented: Vec<Segmented>,
    pub(super) model: Model,
    /// Those of several members.
    lumps: Vec<Lump>,
    /// Their centres of mass as their members have them.
    centres: BTreeMap<String, Estimate<[f64; 3]>>,
}

impl Welded {
    /// Nothing where no fixed joint holds anything, and nothing went with another whenever it went.
    pub(super) fn of(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<Self> {
        let mut whole = lumps_of(capture, &as_held(capture, segmented, model));
        if whole.lumps.iter().all(|l| l.members.len() < 2) {
            return None;
        }
        let mut segmented = segmented.to_vec();
        let phases = segmented.iter_mut().flat_map(|s| &mut s.phases);
        for names in phases.flat_map(|p| [&mut p.moving, &mut p.touched]) {
            let renamed = |name: &String| whole.of(name).map_or_else(|| name.clone(), |l| l.name.clone());
            let each: BTreeSet<String> = names.iter().map(renamed).collect();
            *names = each.into_iter().collect();
        }
        let capture = as_lumps(capture, &whole.lumps);
        whole.lumps.retain(|l| l.members.len() > 1);
        Some(Self {
            capture,
            segmented,
            centres: centres(&whole),
            model: whole.model,
            lumps: whole.lumps,
        })
    }

    /// With the numbers that touches tell of the wholes; sums over members are what is left where they tell none.
    pub(super) fn identified(mut self, options: &Options) -> Result<Self> {
        let mut fresh = bare(&self.model);
        let quiet = &mut Notices::default();
        estimation::identify(&self.capture, &self.segmented, &mut fresh, &options.estimation, quiet)?;
        for lump in &self.lumps {
            let found = fresh.twin.link(&lump.name).filter(|l| tells(l));
            if let (Some(found), Some(own)) = (found, self.model.twin.link_mut(&lump.name)) {
                *own = found.clone();
            }
        }
        Ok(self)
    }

    /// Gives the members what is known of the wholes alone: how the lowest rubs, and by how much the centre of mass is off.
    pub(super) fn hand_down(&self, model: &mut Model) {
        for lump in &self.lumps {
            let Some(whole) = self.model.twin.link(&lump.name) else {
                continue;
            };
            let lowest = lowest(model, lump);
            if let Some(own) = model.twin.link_mut(&lowest) {
                rub_as(own, whole);
            }
            let sum = self.centres.get(&lump.name);
            let Some((found, sum)) = whole.com.as_ref().filter(|c| c.is_measured()).zip(sum) else {
                continue;
            };
            let off = Vector3::from(found.value) - Vector3::from(sum.value);
            for (name, place) in &lump.members {
                let centre = model.twin.link_mut(name).and_then(|l| l.com.as_mut());
                centre
                    .into_iter()
                    .for_each(|c| shift(c, &(place.0.inverse() * off), found));
            }
        }
    }

    /// Says of the members what was found of the wholes: where they go, and by how much their friction is another.
    pub(super) fn unfold(&self, found: &mut Diagnosed) {
        for lump in &self.lumps {
            let others = || lump.members.iter().filter(|(name, _)| *name != lump.name);
            for trace in &mut found.traces {
                let Some(path) = trace.paths.get(&lump.name).cloned() else {
                    continue;
                };
                for (name, place) in others() {
                    let poses = path.poses.iter().map(|p| Pose(p.0 * place.0)).collect();
                    let time = path.time.clone();
                    trace.paths.insert(name.clone(), Path { time, poses });
                }
            }
            let shared = |l: &&Level| l.of == lump.name && l.number == Number::Friction;
            let own: Vec<Level> = found.levels.iter().filter(shared).cloned().collect();
            let of = |name: &String| {
                own.iter()
                    .map(|l| Level {
                        of: name.clone(),
                        ..l.clone()
                    })
                    .collect::<Vec<_>>()
            };
            found.levels.extend(others().flat_map(|(name, _)| of(name)));
        }
    }
}

/// The model with what only ever went as one held together: whether a bond or mere rest does that shows nowhere, and nothing
/// depends on it.
fn as_held(capture: &Capture, segmented: &[Segmented], model: &Model) -> Model {
    let mut out = model.clone();
    for relation in &mut out.twin.relations {
        let undecided = matches!(relation.kind, RelationKind::Unknown | RelationKind::Resting);
        if undecided && always_as_one(capture, segmented, &model.twin, [&relation.a, &relation.b]) {
            (relation.kind, relation.breakaway) = (RelationKind::Fixed, None);
        }
    }
    assemble::weld(&mut out);
    out
}

fn centres(whole: &Lumped) -> BTreeMap<String, Estimate<[f64; 3]>> {
    let of = |l: &Lump| Some((l.name.clone(), whole.model.twin.link(&l.name)?.com.clone()?));
    whole.lumps.iter().filter_map(of).collect()
}

/// The member that reaches lowest at the first view; that which gives the lump its name where no shape is known.
fn lowest(model: &Model, lump: &Lump) -> String {
    let low = |name: &str| -> Option<f64> {
        let link = model.twin.link(name)?;
        let mesh = model.meshes.get(link.mesh.as_ref()?)?;
        mesh.vertices.iter().map(|v| (link.pose.0 * v).z).reduce(f64::min)
    };
    let reach = lump.members.iter().filter_map(|(name, _)| Some((name, low(name)?)));
    let found = reach.min_by(|a, b| a.1.total_cmp(&b.1));
    found.map_or_else(|| lump.name.clone(), |(name, _)| name.clone())
}

/// Whether touches told anything of it.
fn tells(link: &Link) -> bool {
    link.friction_force.kinetic.is_some() || link.mass.as_ref().is_some_and(Estimate::is_told)
}

/// How the whole slides and turns, where the member does not say.
fn rub_as(own: &mut Link, whole: &Link) {
    let (own, whole) = (&mut own.friction, &whole.friction);
    let pairs = [
        (&mut own.static_, &whole.static_),
        (&mut own.kinetic, &whole.kinetic),
        (&mut own.torsional_radius, &whole.torsional_radius),
        (&mut own.tool, &whole.tool),
        (&mut own.creep_speed, &whole.creep_speed),
        (&mut own.creep_ratio, &whole.creep_ratio),
    ];
    for (own, whole) in pairs {
        if own.as_ref().is_none_or(|o| !o.is_measured()) && whole.is_some() {
            own.clone_from(whole);
        }
    }
}

/// A centre of mass moved with all others of a whole, of which alone it is known.
fn shift(centre: &mut Estimate<[f64; 3]>, off: &Vector3<f64>, found: &Estimate<[f64; 3]>) {
    let moved = Point3::from(centre.value) + off;
    centre.ci95 = centre
        .ci95
        .map(|ends| [0, 1, 2].map(|k| ends[k].map(|end| end + off[k])));
    centre.value = moved.into();
    centre.status = Status::Assumed;
    centre.from.clone_from(&found.from);
    centre.method = format!("{}, moved with the whole", centre.method);
}

/// The model with its shapes and joints alone.
pub(super) fn bare(given: &Model) -> Model {
    let mut out = given.clone();
    for body in &mut out.twin.bodies {
        for link in &mut body.links {
            *link = Link {
                mesh: link.mesh.clone(),
                collision: link.collision.clone(),
                ..Link::new(link.name.clone(), link.pose)
            };
        }
        for joint in &mut body.joints {
            (joint.friction, joint.damping, joint.stiffness, joint.rest) = (None, None, None, None);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};

    use super::super::lumps::weigh;
    use super::*;
    use crate::capture::BodyPrior;
    use crate::stages::diagnosis::Trace;
    use crate::twin::{Body, FORMAT, Provenance, Twin, lumped};

    const DOWN: f64 = 0.03;

    fn at(z: f64) -> Pose {
        Pose(nalgebra::Isometry3::from_parts(
            Translation3::new(0.0, 0.0, z),
            UnitQuaternion::identity(),
        ))
    }

    fn glued() -> Model {
        let link = |name: &str, z: f64, mass: f64| Link {
            mass: Some(Estimate::measured(mass, 0.01, "kg", vec!["lift".into()], "lift")),
            com: Some(Estimate::measured(
                [0.0; 3],
                [0.002; 3],
                "m",
                Vec::new(),
                "even density",
            )),
            ..Link::new(name, at(z))
        };
        let joint = serde_json::json!({
            "name": "glue", "type": "fixed", "parent": "low", "child": "top", "probability": 1.0, "alternatives": [],
            "axis": Estimate::measured([0.0, 0.0, 1.0], [0.0; 3], "1", Vec::new(), "test"),
            "origin": Estimate::measured([0.0; 3], [0.0; 3], "m", Vec::new(), "test"),
        });
        let body = Body {
            name: "low".into(),
            links: vec![link("low", 0.0, 0.3), link("top", DOWN, 0.1)],
            joints: vec![serde_json::from_value(joint).expect("a joint")],
        };
        Model {
            twin: Twin {
                format: FORMAT.into(),
                name: "glued".into(),
                gravity: [0.0, 0.0, -9.81],
                support: None,
                bodies: vec![body],
                relations: Vec::new(),
                provenance: Provenance::default(),
                effects: Vec::new(),
                notices: Vec::new(),
            },
            meshes: BTreeMap::new(),
            textures: BTreeMap::new(),
        }
    }

    fn welded() -> Welded {
        let whole = lumped(&glued(), |name| usize::from(name == "low"));
        let centres = centres(&whole);
        let Lumped { model, lumps } = whole;
        Welded {
            capture: Capture {
                root: std::path::PathBuf::new(),
                name: "glued".into(),
                gravity: Vector3::new(0.0, 0.0, -9.81),
                support: None,
                cameras: Vec::new(),
                views: Vec::new(),
                bodies: Vec::new(),
                noise: crate::capture::Noise::default(),
                interactions: Vec::new(),
                truth: None,
                digest: String::new(),
            },
            segmented: Vec::new(),
            model,
            lumps,
            centres,
        }
    }

    #[test]
    fn stated_weights_of_members_add_up_and_a_weight_that_is_missing_is_not_nought() {
        let prior = |name: &str, mass: Option<f64>| BodyPrior {
            name: name.into(),
            mesh: None,
            mass,
            mass_sd: mass.map(|_| 0.003),
            material: None,
            world_from_body: None,
        };
        let lump = &welded().lumps[0];
        let mut both = vec![
            prior("low", Some(0.3)),
            prior("top", Some(0.1)),
            prior("cup", Some(0.2)),
        ];
        weigh(&mut both, lump);
        assert_eq!(both.len(), 2);
        assert!((both[0].mass.expect("a mass") - 0.4).abs() < 1e-12);
        assert!((both[0].mass_sd.expect("a doubt") - 0.003 * 2f64.sqrt()).abs() < 1e-12);
        let mut one = vec![prior("low", Some(0.3)), prior("top", None)];
        weigh(&mut one, lump);
        assert!(one.len() == 1 && one[0].mass.is_none());
    }

    #[test]
    fn the_centre_of_the_whole_is_handed_down_to_its_members() {
        let mut whole = welded();
        let link = whole.model.twin.link_mut("low").expect("the whole");
        let sum = link.com.as_ref().expect("a centre").value;
        assert!((sum[2] - 0.25 * DOWN).abs() < 1e-12, "{sum:?}");
        let found = [sum[0] + 0.007, sum[1], sum[2]];
        link.com = Some(Estimate::measured(
            found,
            [0.001; 3],
            "m",
            vec!["push".into()],
            "pushes",
        ));
        link.friction.kinetic = Some(Estimate::measured(0.3, 0.01, "1", vec!["push".into()], "push"));
        let mut model = glued();
        whole.hand_down(&mut model);
        let again = lumped(&model, |name| usize::from(name == "low"));
        let now = again
            .model
            .twin
            .link("low")
            .and_then(|l| l.com.clone())
            .expect("a centre");
        assert!(
            (0..3).all(|k| (now.value[k] - found[k]).abs() < 1e-12),
            "{:?}",
            now.value
        );
        // Two that no joint holds in the twin, but only ever went as one, move as much.
        let mut loose = glued();
        loose.twin.bodies[0].joints.clear();
        whole.hand_down(&mut loose);
        let of = |model: &Model, name: &str| {
            model
                .twin
                .link(name)
                .and_then(|l| l.com.clone())
                .expect("a centre")
                .value
        };
        assert!(["low", "top"].iter().all(|n| of(&loose, n) == of(&model, n)));
        let [low, top] = ["low", "top"].map(|n| model.twin.link(n).expect("a member").clone());
        assert!(low.friction.kinetic.is_some() && top.friction.kinetic.is_none());
        assert!(top.com.is_some_and(|c| c.status == Status::Assumed));
    }

    #[test]
    fn members_go_where_the_whole_goes_and_rub_as_it_does() {
        let path = Path {
            time: vec![0.0],
            poses: vec![at(0.1)],
        };
        let mut found = Diagnosed::skipped();
        found.traces.push(Trace {
            paths: BTreeMap::from([("low".to_owned(), path)]),
            ..Trace::default()
        });
        found.levels.push(Level {
            of: "low".into(),
            number: Number::Friction,
            log: (-0.2, 0.01),
        });
        welded().unfold(&mut found);
        let traces = &found.traces;
        let top = &traces[0].paths["top"].poses[0];
        assert!((top.0.translation.z - 0.1 - DOWN).abs() < 1e-12);
        let of: Vec<&str> = found.levels.iter().map(|l| l.of.as_str()).collect();
        assert_eq!(of, ["low", "top"]);
    }
}
