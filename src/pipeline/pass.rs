//! The passes by name, in the order in which they run.

use crate::base::{Error, Result, nearest_name};

/// One pass of a reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pass {
    /// Views to meshes.
    Shape,
    /// Planes of reflection.
    Symmetry,
    /// Mass, friction, centre, stiffness.
    Physics,
    /// The constraint graph.
    Relations,
    /// Joints.
    Articulation,
    /// What the twin gets wrong.
    Diagnosis,
    /// URDF, MJCF, glTF.
    Export,
    /// The page.
    Report,
}

impl Pass {
    /// All of them, in order.
    pub const ALL: [Self; 8] = [
        Self::Shape,
        Self::Symmetry,
        Self::Physics,
        Self::Relations,
        Self::Articulation,
        Self::Diagnosis,
        Self::Export,
        Self::Report,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shape => "shape",
            Self::Symmetry => "symmetry",
            Self::Physics => "physics",
            Self::Relations => "relations",
            Self::Articulation => "articulation",
            Self::Diagnosis => "diagnosis",
            Self::Export => "export",
            Self::Report => "report",
        }
    }

    /// The pass of that name.
    pub fn from_name(name: &str) -> Result<Self> {
        let names = Self::ALL.map(Self::name);
        Self::ALL.into_iter().find(|p| p.name() == name).ok_or_else(|| {
            let nearest = nearest_name(name, names).unwrap_or("shape");
            Error::Usage(format!(
                "--pass {name}: no such pass; did you mean {nearest}? There are {}",
                names.join(", ")
            ))
        })
    }
}
