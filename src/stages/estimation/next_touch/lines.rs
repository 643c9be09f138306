//! Where a thing can be pushed so that it does not turn, or so that it does.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::candidates::{DIRECTIONS, HEIGHT, LOWEST, heading};
use super::thing::Thing;
use crate::twin::{Link, Model};

/// A line along which a tool can push a thing, as it stood at first. World frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PushLine {
    /// Where the tool meets it, m.
    pub start: Point3<f64>,
    /// Where the tool goes, a unit vector along the support.
    pub direction: Vector3<f64>,
}

/// How squarely a face has to be met: the cosine between the way of the tool and the face's normal.
const SQUARE: f64 = 0.94;

/// The lines of a link among eight headings whose faces are met squarely, `aside` of the centre of mass by a share of half the
/// width (to the left of the heading), and the middle of its top; nothing where its shape is not known.
pub fn push_lines(
    model: &Model,
    normal: &Vector3<f64>,
    link: &Link,
    aside: f64,
) -> Option<(Vec<PushLine>, Point3<f64>)> {
    let mesh = model.meshes.get(link.mesh.as_ref()?)?;
    let turn = UnitQuaternion::rotation_between(normal, &Vector3::z()).unwrap_or_else(UnitQuaternion::identity);
    let plane = Isometry3::from_parts(Translation3::identity(), turn);
    let thing = Thing::new(&link.name, mesh, &(plane * link.pose.0))?;
    let middle = thing.middle();
    let told = link.com.as_ref().map(|c| (plane * link.pose.0) * Point3::from(c.value));
    let centre = told.unwrap_or(middle).xy();
    let z = thing.low.z + (HEIGHT * thing.height()).max(LOWEST);
    let outline = thing.outline(z)?;
    let back = plane.inverse();
    let line = |d: usize| {
        let way = heading(d);
        let met = thing.meet(&outline, &way, thing.aside(&outline, &way, &centre) + aside)?;
        (met.outward.dot(&way) < -SQUARE).then(|| PushLine {
            start: back * Point3::new(met.point.x, met.point.y, z),
            direction: back * Vector3::new(way.x, way.y, 0.0),
        })
    };
    let top = back * Point3::new(centre.x, centre.y, thing.high.z);
    Some(((0..DIRECTIONS).filter_map(line).collect(), top))
}
