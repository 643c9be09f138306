//! Bodies and links: shape, symmetry and matter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Joint, SymmetryAxis, SymmetryCenter, SymmetryPlane};
use crate::base::{Estimate, Pose};

/// A link of this name is what things hang on that nobody saw or tracked; it has no place of its own, and as a root it holds its body
/// to the world.
pub const WORLD: &str = "world";

/// What moves as one tree. A rigid body has one link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Body {
    /// Its name; a body of several links carries the name of its root.
    pub name: String,
    /// Its links, the root first.
    pub links: Vec<Link>,
    /// The joints between them.
    #[serde(default)]
    pub joints: Vec<Joint>,
}

/// One rigid part. Quantities are in the link frame: the frame of its track, or, where it was never
/// tracked, at the centre of its mesh with the axes of the world at the first view.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Link {
    /// The name under which it was tracked, if it was.
    pub name: String,
    /// World-from-link at the first view.
    pub pose: Pose,
    /// Visual mesh, path relative to the twin's folder, link frame; absent where nobody saw its shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Convex parts, paths relative to the twin's folder, link frame.
    #[serde(default)]
    pub collision: Vec<String>,
    /// Fraction of the mesh's area that was seen, 0 to 1; the rest was closed or mirrored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<f64>,
    /// The same in full: what shares of the mesh's area were seen, mirrored and closed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceShares>,
    /// A superquadric that stands for the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub superquadric: Option<Superquadric>,
    /// Planes of reflection through the mesh, best first.
    #[serde(default)]
    pub symmetry: Vec<SymmetryPlane>,
    /// Axes of rotation through the mesh, best first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub axes: Vec<SymmetryAxis>,
    /// The centre of the mesh where it is a ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symmetry_center: Option<SymmetryCenter>,
    /// Silhouettes of the principal views, paths relative to the twin's folder.
    #[serde(default)]
    pub principal_views: Vec<String>,
    /// kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Estimate>,
    /// Centre of mass, m, link frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub com: Option<Estimate<[f64; 3]>>,
    /// ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, link axes, kg·m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<Estimate<[f64; 6]>>,
    /// mu·m·g on this support, N.
    #[serde(default, skip_serializing_if = "FrictionForce::is_empty")]
    pub friction_force: FrictionForce,
    /// Coefficients of friction.
    #[serde(default, skip_serializing_if = "Friction::is_empty")]
    pub friction: Friction,
    /// Coefficient of restitution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Estimate>,
    /// N/m at the spot that was pressed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Estimate>,
    /// N·s/m at the spot that was pressed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Estimate>,
    /// What tosses show beside friction and restitution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tossed: Option<Tossed>,
    /// What each interaction did to mass and friction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ledger: Vec<LedgerEntry>,
}

/// What free flights, impacts and rests of a link show. A toss shows no mass: all of this is over it.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Tossed {
    /// Acceleration of free fall as the track has it, m/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Estimate>,
    /// Inertia over that of the shape at uniform density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia_ratio: Option<Estimate>,
    /// Radius of edges and corners where they struck, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_radius: Option<Estimate>,
    /// Height of the body when it lies, over where shape and support have it, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resting_height: Option<Estimate>,
    /// Height of the support where it was struck, over where the capture has it, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support_rise: Option<Estimate>,
    /// Centre of mass from that of the shape at uniform density, m, link axes; of a body of two links with the masses
    /// taken as equal, for a toss shows the moments alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_offset: Option<Estimate<[f64; 3]>>,
    /// Logarithm (xx, yy, zz, xy, xz, yz) of the second moments of mass in units of those at uniform density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<Estimate<[f64; 6]>>,
    /// Drag of the air over mass, 1/m: deceleration over squared speed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air_drag: Option<Estimate>,
    /// Friction of the hinge over the mass of the body, N·m/kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hinge_friction: Option<Estimate>,
    /// Damping of the hinge over the mass of the body, N·m·s/(rad·kg).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hinge_damping: Option<Estimate>,
}

/// What one interaction did to one number: the fit with it against the fit without it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LedgerEntry {
    /// The interaction that was left out.
    pub interaction: String,
    /// `mass`, `friction.kinetic` or `stiffness`.
    pub quantity: String,
    /// By how much it moved the number, as a share of it.
    pub moved: f64,
    /// Standard deviation without it over that with it: 1 where it told nothing.
    pub doubt_without: f64,
}

/// Shares of a mesh's area by where they come from; they sum to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceShares {
    /// A view showed it.
    pub seen: f64,
    /// Image of a seen surface by the thing's symmetry.
    pub mirrored: f64,
    /// Concluded: closed against the support, or filled in.
    pub closed: f64,
}

/// The force of friction on the support, N.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct FrictionForce {
    /// Peak before it slides.
    #[serde(default, rename = "static", skip_serializing_if = "Option::is_none")]
    pub static_: Option<Estimate>,
    /// While it slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinetic: Option<Estimate>,
}

impl FrictionForce {
    /// Nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.static_.is_none() && self.kinetic.is_none()
    }
}

/// Coefficients of friction of a link.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Friction {
    /// Against the support, before it slides.
    #[serde(default, rename = "static", skip_serializing_if = "Option::is_none")]
    pub static_: Option<Estimate>,
    /// Against the support, while it slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinetic: Option<Estimate>,
    /// Rolling resistance, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rolling: Option<Estimate>,
    /// Ratio of the largest friction torque to the largest friction force, m (limit surface).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsional_radius: Option<Estimate>,
    /// Slip speed below which friction grows with speed instead of holding still, m/s; absent where it holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub creep_speed: Option<Estimate>,
    /// The same over the speed of the tool, of links that rock on their corners while one of them slides: what gives way then goes
    /// with how far the tool goes, whatever the time that takes. One of the two at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub creep_ratio: Option<Estimate>,
    /// Against the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<Estimate>,
}

impl Friction {
    /// Nothing was measured.
    pub fn is_empty(&self) -> bool {
        let Self {
            static_,
            kinetic,
            rolling,
            torsional_radius,
            creep_speed,
            creep_ratio,
            tool,
        } = self;
        let creep = [creep_speed, creep_ratio];
        let all = [static_, kinetic, rolling, torsional_radius, tool]
            .into_iter()
            .chain(creep);
        all.into_iter().all(|e| e.is_none())
    }
}

/// Barr's superquadric: `((x/a)^(2/e2) + (y/b)^(2/e2))^(e2/e1) + (z/c)^(2/e1) = 1`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Superquadric {
    /// Half sizes a, b, c, m.
    pub size: [f64; 3],
    /// Exponents e1 (along z), e2 (around z).
    pub exponents: [f64; 2],
    /// Link-from-superquadric.
    pub pose: Pose,
    /// Root mean square distance, along rays from its centre, of the surface that faces the open, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
}

impl Link {
    /// A link of which only the name and the pose are known.
    pub fn new(name: impl Into<String>, pose: Pose) -> Self {
        Self {
            name: name.into(),
            pose,
            mesh: None,
            collision: Vec::new(),
            seen: None,
            surface: None,
            superquadric: None,
            symmetry: Vec::new(),
            axes: Vec::new(),
            symmetry_center: None,
            principal_views: Vec::new(),
            mass: None,
            com: None,
            inertia: None,
            friction_force: FrictionForce::default(),
            friction: Friction::default(),
            restitution: None,
            stiffness: None,
            damping: None,
            tossed: None,
            ledger: Vec::new(),
        }
    }
}

impl Body {
    /// The link of this name with all that hangs on it.
    pub fn hung_on(&self, link: &str) -> Vec<String> {
        let mut names = vec![link.to_owned()];
        let mut at = 0;
        while at < names.len() {
            let hung = self
                .joints
                .iter()
                .filter(|j| j.parent == names[at])
                .map(|j| j.child.clone());
            let new: Vec<String> = hung.filter(|n| !names.contains(n)).collect();
            names.extend(new);
            at += 1;
        }
        names
    }

    /// A rigid body: one link that carries the body's name.
    pub fn rigid(link: Link) -> Self {
        Self {
            name: link.name.clone(),
            links: vec![link],
            joints: Vec::new(),
        }
    }
}
