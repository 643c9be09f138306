//! The files of a BOP scene as data (`docs/bop_datasets_format.md` of the BOP toolkit). Lengths in mm.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::base::{Error, Result, read_text};

/// How far a rotation matrix may be from one.
const ORTHOGONAL: f64 = 1e-3;
const METRES: f64 = 1e-3;

/// An entry of `scene_camera.json`.
#[derive(Clone, Debug, Deserialize)]
#[expect(non_snake_case, reason = "the names of the format")]
pub(super) struct SceneCamera {
    /// Row by row.
    pub(super) cam_K: [f64; 9],
    /// Millimetres per count of the depth image.
    #[serde(default = "one")]
    pub(super) depth_scale: f64,
    pub(super) cam_R_w2c: Option<[f64; 9]>,
    pub(super) cam_t_w2c: Option<[f64; 3]>,
}

fn one() -> f64 {
    1.0
}

/// A thing in an entry of `scene_gt.json`.
#[derive(Clone, Debug, Deserialize)]
#[expect(non_snake_case, reason = "the names of the format")]
pub(super) struct SceneObject {
    pub(super) obj_id: u32,
    pub(super) cam_R_m2c: [f64; 9],
    pub(super) cam_t_m2c: [f64; 3],
}

/// Reads a file that maps the number of an image to something.
pub(super) fn by_image<T: DeserializeOwned>(file: &Path) -> Result<BTreeMap<u32, T>> {
    let text = read_text(file)?;
    serde_json::from_str(&text).map_err(|e| {
        let place = format!("line {}, column {}", e.line(), e.column());
        Error::bad_input(file, place, e.to_string(), "an entry of the BOP format for each image")
    })
}

/// A rigid transform, in m; none where the matrix is no rotation.
pub(super) fn rigid(rotation: &[f64; 9], translation: &[f64; 3]) -> Option<Isometry3<f64>> {
    let matrix = Matrix3::from_row_slice(rotation);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    let sound = off < ORTHOGONAL && matrix.determinant() > 0.0 && translation.iter().all(|t| t.is_finite());
    let turn =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_eps(&matrix, 1e-12, 100, Rotation3::identity()));
    let at = Translation3::from(Vector3::from(*translation) * METRES);
    sound.then(|| Isometry3::from_parts(at, turn))
}
