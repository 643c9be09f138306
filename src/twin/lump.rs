//! Links that fixed joints hold to each other, taken for the one rigid thing that they are: masses add up, centres are
//! weighed, inertias shifted by parallel axes (Huygens and Steiner), shapes put together.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{Body, JointKind, Link, Model};
use crate::base::{Estimate, Pose, Status};
use crate::geometry::Mesh;

/// What moves as one.
#[derive(Clone, Debug)]
pub struct Lump {
    /// The member whose name and frame it has.
    pub name: String,
    /// Names of all its members, each with its frame in that of the lump.
    pub members: Vec<(String, Pose)>,
}

/// A model without fixed joints.
#[derive(Clone, Debug)]
pub struct Lumped {
    /// One link for each lump.
    pub model: Model,
    /// Every link of the original is a member of one of them.
    pub lumps: Vec<Lump>,
}

impl Lumped {
    /// The lump that a link of the original belongs to.
    pub fn of(&self, member: &str) -> Option<&Lump> {
        let holds = |l: &&Lump| l.members.iter().any(|(name, _)| name == member);
        self.lumps.iter().find(holds)
    }
}

/// The model with all that fixed joints hold to each other as one link each. The lump takes name and frame of the member
/// that `weight` puts first, of several of these that which is nearest to the root.
pub fn lumped(model: &Model, weight: impl Fn(&str) -> usize) -> Lumped {
    let mut out = Lumped {
        model: model.clone(),
        lumps: Vec::new(),
    };
    out.model.twin.bodies.clear();
    for body in &model.twin.bodies {
        let groups = groups_of(body);
        let mut links = Vec::with_capacity(groups.len());
        let first = out.lumps.len();
        for group in &groups {
            let heaviest = group.iter().rev().max_by_key(|l| weight(&l.name));
            let Some(chosen) = heaviest else { continue };
            let frame = chosen.pose.0.inverse();
            let members = group.iter().map(|l| (l.name.clone(), Pose(frame * l.pose.0)));
            out.lumps.push(Lump {
                name: chosen.name.clone(),
                members: members.collect(),
            });
            links.push(match group.as_slice() {
                [alone] => (*alone).clone(),
                _ => merged(&mut out.model, model, chosen, group),
            });
        }
        let own = out.lumps[first..].to_vec();
        let renamed = |name: &str| rename(&own, name);
        let free = body.joints.iter().filter(|j| j.kind != JointKind::Fixed).cloned();
        let joints = free.map(|mut j| {
            (j.parent, j.child) = (renamed(&j.parent), renamed(&j.child));
            j
        });
        out.model.twin.bodies.push(Body {
            name: links.first().map_or_else(|| body.name.clone(), |l| l.name.clone()),
            joints: joints.collect(),
            links,
        });
    }
    for relation in &mut out.model.twin.relations {
        (relation.a, relation.b) = (rename(&out.lumps, &relation.a), rename(&out.lumps, &relation.b));
    }
    out.model.twin.relations.retain(|r| r.a != r.b);
    out
}

fn rename(lumps: &[Lump], name: &str) -> String {
    let own = lumps.iter().find(|l| l.members.iter().any(|(m, _)| m == name));
    own.map_or_else(|| name.to_owned(), |l| l.name.clone())
}

/// The links of a body, parted where a joint lets them move; the root's first.
fn groups_of(body: &Body) -> Vec<Vec<&Link>> {
    let mut groups: Vec<Vec<&Link>> = body.links.iter().map(|l| vec![l]).collect();
    for joint in body.joints.iter().filter(|j| j.kind == JointKind::Fixed) {
        let at = |name: &str| groups.iter().position(|g| g.iter().any(|l| l.name == name));
        if let (Some(a), Some(b)) = (at(&joint.parent), at(&joint.child)) {
            let (to, from) = (a.min(b), a.max(b));
            if to != from {
                let more = groups.remove(from);
                groups[to].extend(more);
            }
        }
    }
    groups
}

fn merged(out: &mut Model, model: &Model, chosen: &Link, group: &[&Link]) -> Link {
    let place = |l: &Link| chosen.pose.0.inverse() * l.pose.0;
    let mut link = Link::new(chosen.name.clone(), chosen.pose);
    let mesh = group
        .iter()
        .filter_map(|l| Some((*l, model.meshes.get(l.mesh.as_ref()?)?)));
    let whole = mesh.fold(Mesh::default(), |whole, (l, m)| joined(whole, m, &place(l)));
    if !whole.triangles.is_empty() {
        let path = format!("meshes/{}.whole.obj", chosen.name);
        out.meshes.insert(path.clone(), whole);
        link.mesh = Some(path);
    }
    let parts = group.iter().flat_map(|l| l.collision.iter().map(move |p| (*l, p)));
    for (k, (l, path)) in parts.enumerate() {
        let Some(part) = model.meshes.get(path) else { continue };
        let path = format!("meshes/{}.whole-{k}.obj", chosen.name);
        out.meshes
            .insert(path.clone(), joined(Mesh::default(), part, &place(l)));
        link.collision.push(path);
    }
    matter(&mut link, group, place);
    let low = |l: &Link| {
        let vertices = l
            .mesh
            .iter()
            .filter_map(|p| model.meshes.get(p))
            .flat_map(|m| &m.vertices);
        vertices.map(|v| (l.pose.0 * v).z).fold(f64::INFINITY, f64::min)
    };
    // What it stands on rubs: the lowest member has the say, then the others.
    let mut ordered = group.to_vec();
    ordered.sort_by(|a, b| low(a).total_cmp(&low(b)));
    surface(&mut link, &ordered);
    link
}

/// Two meshes as one, the second moved.
fn joined(mut whole: Mesh, part: &Mesh, place: &Isometry3<f64>) -> Mesh {
    let base = whole.vertices.len() as u32;
    whole.colors.clear();
    whole.vertices.extend(part.vertices.iter().map(|v| place * v));
    whole
        .triangles
        .extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
    whole
}

/// The sum of some estimates, doubts added up as if they went together; nothing where there are none.
fn sum<'a>(all: impl Iterator<Item = &'a Estimate>) -> Option<Estimate> {
    all.cloned().reduce(|a, b| {
        let sd = match (a.sd, b.sd) {
            (None, None) => None,
            (a, b) => Some(a.unwrap_or(0.0) + b.unwrap_or(0.0)),
        };
        let status = if a.status == b.status {
            a.status
        } else {
            Status::Assumed
        };
        let value = a.value + b.value;
        Estimate {
            sd,
            ci95: sd.map(|sd| [value - 1.96 * sd, value + 1.96 * sd]),
            value,
            status,
            confounded: None,
            ..a
        }
    })
}

/// Mass, centre and inertia of the whole, where those of all members that have a mass are there.
fn matter(link: &mut Link, group: &[&Link], place: impl Fn(&Link) -> Isometry3<f64>) {
    // A shape whose mass was never measured beside one that was: their sum is not known.
    let measured = group.iter().any(|l| l.mass.as_ref().is_some_and(Estimate::is_measured));
    if measured && group.iter().any(|l| l.mesh.is_some() && l.mass.is_none()) {
        return;
    }
    let heavy: Vec<&Link> = group.iter().filter(|l| l.mass.is_some()).copied().collect();
    let Some(mass) = sum(heavy.iter().filter_map(|l| l.mass.as_ref())) else {
        return;
    };
    let at = |l: &Link| Some(place(l) * Point3::from(l.com.as_ref()?.value));
    let own = |l: &Link| l.mass.as_ref().map_or(0.0, |m| m.value);
    let centres: Option<Vec<Point3<f64>>> = heavy.iter().map(|l| at(l)).collect();
    if let Some(centres) = centres {
        let weighed = heavy.iter().zip(&centres).map(|(l, c)| c.coords * own(l));
        let centre: Vector3<f64> = weighed.sum::<Vector3<f64>>() / mass.value;
        let doubt = heavy
            .iter()
            .filter_map(|l| l.com.as_ref()?.sd)
            .reduce(|a, b| [0, 1, 2].map(|k| a[k].max(b[k])));
        link.com = heavy[0].com.as_ref().map(|c| with(c, centre.into(), doubt));
        let about = |(l, c): (&&Link, &Point3<f64>)| {
            let own_inertia = matrix(l.inertia.as_ref()?.value);
            let turn = place(l).rotation.to_rotation_matrix().into_inner();
            let arm = c.coords - centre;
            let shifted = Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
            Some(turn * own_inertia * turn.transpose() + shifted * own(l))
        };
        let inertia: Option<Vec<Matrix3<f64>>> = heavy.iter().zip(&centres).map(about).collect();
        link.inertia = inertia.and_then(|all| {
            let whole: Matrix3<f64> = all.iter().sum();
            let [xx, yy, zz] = [whole[(0, 0)], whole[(1, 1)], whole[(2, 2)]];
            let six = [xx, yy, zz, whole[(0, 1)], whole[(0, 2)], whole[(1, 2)]];
            heavy[0].inertia.as_ref().map(|i| with(i, six, None))
        });
    }
    link.mass = Some(mass);
}

fn matrix([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// An estimate of the same kind with another value.
fn with<const N: usize>(like: &Estimate<[f64; N]>, value: [f64; N], sd: Option<[f64; N]>) -> Estimate<[f64; N]>
where
    [[f64; 2]; N]: serde::Serialize,
{
    Estimate {
        value,
        sd,
        ci95: sd.map(|sd| std::array::from_fn(|k| [value[k] - 1.96 * sd[k], value[k] + 1.96 * sd[k]])),
        confounded: None,
        ..like.clone()
    }
}

/// What the whole rubs with: of the first of these that says so.
fn surface(link: &mut Link, ordered: &[&Link]) {
    link.friction_force.kinetic = sum(ordered.iter().filter_map(|l| l.friction_force.kinetic.as_ref()));
    link.friction_force.static_ = sum(ordered.iter().filter_map(|l| l.friction_force.static_.as_ref()));
    let first = |of: &dyn Fn(&Link) -> Option<Estimate>| ordered.iter().find_map(|l| of(l));
    link.friction.static_ = first(&|l| l.friction.static_.clone());
    link.friction.kinetic = first(&|l| l.friction.kinetic.clone());
    link.friction.torsional_radius = first(&|l| l.friction.torsional_radius.clone());
    link.friction.creep_speed = first(&|l| l.friction.creep_speed.clone());
    link.friction.creep_ratio = first(&|l| l.friction.creep_ratio.clone());
    link.friction.rolling = first(&|l| l.friction.rolling.clone());
    link.friction.tool = first(&|l| l.friction.tool.clone());
    link.restitution = first(&|l| l.restitution.clone());
    link.stiffness = first(&|l| l.stiffness.clone());
    link.damping = first(&|l| l.damping.clone());
}
