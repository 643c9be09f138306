//! A joint whose child is held by a tool with a path of its own: that tells how it moves at the moment of its force.

use nalgebra::{Isometry3, Point3, Vector3};

use super::evidence::motion_at;
use super::facts::subject;
use super::joint_law::Number;
use super::joint_load::JointAtWork;
use crate::base::{Confounded, Estimate, Status};
use crate::capture::{Capture, Interaction, Kind, PhaseKind, PoseStream, Segmented, position_noise};
use crate::twin::{Joint, JointKind, Model};

/// How far a tool that holds something from the first row on goes alone before its force is felt, m.
const TAKEN_ALONG: f64 = 2e-3;
/// How far it goes, m, beside three standard deviations of its noise, before it has set out, and how long, s, what it stands with counts.
const STANDS: f64 = 1e-4;
const LONGEST: f64 = 0.25;

/// True where a tool pulls at what it held from the first row on: what it reads at rest is a load, a spring's or a weight's,
/// and no tare.
pub(super) fn held_at_first(interaction: &Interaction, cut: &Segmented) -> bool {
    let holds = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    let felt = cut
        .phases
        .iter()
        .find(|p| !matches!(p.kind, PhaseKind::Rest | PhaseKind::Approach))
        .map_or(f64::INFINITY, |p| p.start);
    let gone = |path: &PoseStream| {
        let before = path
            .position
            .iter()
            .zip(&path.time)
            .filter(|(p, t)| p.x.is_finite() && **t <= felt);
        let first = path.position.iter().find(|p| p.x.is_finite());
        first.map_or(0.0, |first| before.map(|(p, _)| (p - first).norm()).fold(0.0, f64::max))
    };
    let alone = |path: &PoseStream| {
        let held = subject(interaction, cut).and_then(|name| interaction.tracks.get(name));
        let taken = held.map_or(0.0, gone);
        gone(path) > TAKEN_ALONG + 2.0 * taken
    };
    let came = interaction.tool_path.as_ref().is_some_and(alone);
    interaction.kind == Kind::Pull && holds && !came
}

/// True where all that pulled at the child of a joint held it from the first row on.
pub(super) fn untared(capture: &Capture, segmented: &[Segmented], joint: &Joint) -> bool {
    let held = |i: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == i.name)?;
        (subject(i, cut)? == joint.child).then(|| held_at_first(i, cut))
    };
    capture.fitted().filter_map(held).all(|held| held)
}

/// Where a spring is slack; as forces tell it that were never read without a load (`untared`) a bias of the sensor would move it.
pub(super) fn beside_bias(mut rest: Estimate, spring: Option<Number>, unit: &str, untared: bool) -> Estimate {
    let Some(spring) = spring.filter(|_| untared) else {
        return rest;
    };
    rest.status = Status::Assumed;
    rest.confounded = Some(Confounded {
        with: vec!["force-bias".into()],
        known: format!(
            "stiffness * rest - the load of the force's bias = {:.4} {unit}",
            spring.value * rest.value
        ),
        experiment: "read the force before the tool takes hold, or after it has let go".into(),
    });
    rest
}

/// Noise, m, of the path of a tool that holds the child and is known more finely than the child's track; `None` where there is none.
pub fn leading_noise(interaction: &Interaction, cut: &Segmented, joint: &Joint, model: &Model) -> Option<f64> {
    let at_work = JointAtWork::new(interaction, cut, joint, model)?;
    at_work.leads.map(|path| position_noise(&[path]))
}

impl JointAtWork<'_> {
    /// Speed and acceleration along the freedom, and the speed's gain of noise, by the tool that holds the child;
    /// `way` is how its point moves as the joint does, `parent` how it would move with the parent.
    pub(super) fn by_tool(
        &self,
        t: f64,
        half: Option<f64>,
        way: &Vector3<f64>,
        parent: &Vector3<f64>,
    ) -> Option<[f64; 3]> {
        let m = motion_at(self.leads?, t, half?)?;
        let square = way.norm_squared().max(1e-12);
        Some([
            way.dot(&(m.velocity - parent)) / square,
            way.dot(&m.acceleration) / square,
            m.velocity_gain / square.sqrt(),
        ])
    }

    /// Where the tool that leads was at first, and the joint's position there by the child's track.
    pub(super) fn led_at_first(&self) -> Option<(Point3<f64>, f64)> {
        let home = self.parent.map_or(Isometry3::identity(), |l| l.pose.0);
        // Seen from a parent that moves the tool alone does not tell the position.
        let parent = match (self.stands, self.interaction.tracks.contains_key(&self.joint.parent)) {
            (Some(pose), _) => pose,
            (None, false) => home,
            (None, true) => return None,
        };
        let path = self.leads?;
        let first = (0..path.len()).find(|i| path.position[*i].x.is_finite())?;
        let track = self.interaction.tracks.get(&self.joint.child)?;
        let row = track
            .time
            .partition_point(|t| *t < path.time[first])
            .min(track.len() - 1);
        let axis = Vector3::from(self.joint.axis.value);
        let at = |row: usize| {
            let pose = track.pose(row)?.0;
            let moved = home * parent.inverse() * pose * self.child.pose.0.inverse();
            Some(if self.joint.kind == JointKind::Prismatic {
                let centre = Point3::from(self.child.pose.0.translation.vector);
                (moved * centre - centre).dot(&axis)
            } else {
                moved.rotation.scaled_axis().dot(&axis)
            })
        };
        // One row is as noisy as the track: all of them count until the tool sets out.
        let near = STANDS.max(3.0 * position_noise(&[path]));
        let goes = |i: &usize| (path.position[*i] - path.position[first]).norm() > near;
        let until = (first..path.len()).find(goes).map_or(f64::INFINITY, |i| path.time[i]);
        let until = until.min(path.time[first] + LONGEST);
        let (sum, rows) = (row..track.len())
            .take_while(|r| *r == row || track.time[*r] < until)
            .filter_map(at)
            .fold((0.0, 0), |(sum, n), q| (sum + q, n + 1));
        let position = (rows > 0).then(|| sum / f64::from(rows))?;
        Some((path.position[first], position))
    }

    /// Position along the freedom by the tool that holds the child: of the same moment as its force, whatever the clock of the
    /// tracking; `axis` and `origin` are where the parent has them.
    pub(super) fn position_by_tool(
        &self,
        t: f64,
        half: Option<f64>,
        axis: &Vector3<f64>,
        origin: &Point3<f64>,
    ) -> Option<f64> {
        let (first, position) = self.led_from?;
        let now = motion_at(self.leads?, t, half?)?.pose.translation.vector;
        if self.joint.kind == JointKind::Prismatic {
            return Some(position + axis.dot(&(now - first.coords)));
        }
        let level = |v: Vector3<f64>| v - axis * axis.dot(&v);
        let (home, out) = (level(first - origin), level(now - origin.coords));
        Some(position + axis.dot(&home.cross(&out)).atan2(home.dot(&out)))
    }
}
