//! Bodies that the capture names: those whose mesh it brings along, and those of which it says nothing but the name.

use std::collections::BTreeMap;

use super::ShapedObject;
use crate::base::{Notices, Pose, Result};
use crate::capture::Capture;
use crate::geometry::parse_mesh;

/// The bodies whose mesh the capture brings along.
pub fn given_meshes(
    capture: &Capture,
    anchors: &BTreeMap<String, Pose>,
    notices: &mut Notices,
) -> Result<Vec<ShapedObject>> {
    let mut objects = Vec::new();
    for body in &capture.bodies {
        let Some(file) = &body.mesh else { continue };
        let mesh = parse_mesh(&file.path, &file.bytes)?;
        let world_from_link = anchors.get(&body.name).copied().unwrap_or_else(|| {
            notices.warn(
                "shape",
                &body.name,
                "its mesh is given, but not where it is: taken to be at the origin",
            );
            Pose::identity()
        });
        objects.push(ShapedObject {
            name: body.name.clone(),
            world_from_link,
            mesh,
            seen: 1.0,
            collision: Vec::new(),
            superquadric: None,
            texture: None,
        });
    }
    Ok(objects)
}

/// A mesh that was given is the shape, whatever the views made of the body.
pub fn put_given(objects: &mut Vec<ShapedObject>, given: Vec<ShapedObject>) {
    for object in given {
        match objects.iter_mut().find(|o| o.name == object.name) {
            Some(seen) => *seen = object,
            None => objects.push(object),
        }
    }
}

/// A body with no pose, no mesh and no track may be any thing that has no name: where there is but one of either they are
/// one, else a notice tells what would say which is which.
pub fn name_the_only_one(
    objects: &mut [ShapedObject],
    capture: &Capture,
    anchors: &BTreeMap<String, Pose>,
    notices: &mut Notices,
) {
    let placed = |name: &str| anchors.contains_key(name);
    let bodies = capture.bodies.iter().filter(|b| b.mesh.is_none() && !placed(&b.name));
    let lost: Vec<&str> = bodies.map(|b| b.name.as_str()).collect();
    let mut nameless: Vec<&mut ShapedObject> = objects
        .iter_mut()
        .filter(|o| !placed(&o.name) && !capture.bodies.iter().any(|b| b.name == o.name))
        .collect();
    match (&lost[..], &mut nameless[..]) {
        ([], _) | (_, []) => {}
        ([only], [object]) => object.name = (*only).to_owned(),
        _ => {
            let words = format!(
                "named, but neither placed nor tracked: which of the {} things without a name it is nobody says; a pose in `bodies` would",
                nameless.len()
            );
            for name in lost {
                notices.warn("shape", name, words.as_str());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{BodyPrior, Noise};
    use crate::geometry::Mesh;

    fn named(bodies: &[&str], things: usize) -> (Vec<String>, usize) {
        let prior = |name: &&str| BodyPrior {
            name: (*name).into(),
            mesh: None,
            mass: None,
            mass_sd: None,
            material: None,
            world_from_body: None,
        };
        let capture = Capture {
            root: Default::default(),
            name: "named".into(),
            gravity: nalgebra::Vector3::new(0.0, 0.0, -9.8),
            support: None,
            cameras: Vec::new(),
            views: Vec::new(),
            bodies: bodies.iter().map(prior).collect(),
            noise: Noise::default(),
            interactions: Vec::new(),
            truth: None,
            digest: String::new(),
        };
        let thing = |k: usize| ShapedObject {
            name: format!("object-{k}"),
            world_from_link: Pose::identity(),
            mesh: Mesh::default(),
            seen: 1.0,
            collision: Vec::new(),
            superquadric: None,
            texture: None,
        };
        let mut objects: Vec<ShapedObject> = (0..things).map(thing).collect();
        let mut notices = Notices::default();
        name_the_only_one(&mut objects, &capture, &BTreeMap::new(), &mut notices);
        (objects.into_iter().map(|o| o.name).collect(), notices.0.len())
    }

    #[test]
    fn one_name_and_one_thing_belong_together_and_several_are_told() {
        assert_eq!(named(&["cup"], 1), (vec!["cup".to_owned()], 0));
        assert_eq!(named(&["cup"], 2).1, 1);
        assert_eq!(named(&["cup", "can"], 2).1, 2);
        assert_eq!(named(&[], 1), (vec!["object-0".to_owned()], 0));
    }
}
