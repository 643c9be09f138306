//! An interaction cut in time: rest, approach, stick, slide, release, with what was in contact.

/// What was going on in a stretch of an interaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PhaseKind {
    /// Nothing touches, nothing moves: the noise floor is read here.
    Rest,
    /// The tool moves, no contact yet.
    Approach,
    /// Contact, the force rises, the body does not slide (for a press: loading, holding or unloading).
    Stick,
    /// The body slides, or is carried.
    Slide,
    /// Contact is over; the body may still coast.
    Release,
}

/// One stretch of time of an interaction.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// What was going on.
    pub kind: PhaseKind,
    /// From, seconds on the capture's clock.
    pub start: f64,
    /// To, seconds on the capture's clock.
    pub end: f64,
    /// The tracked bodies that moved in it beyond their noise.
    pub moving: Vec<String>,
    /// The bodies that the tool touched in it.
    pub touched: Vec<String>,
}

/// The phases of one interaction, in time order, without gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmented {
    /// The name of the interaction.
    pub interaction: String,
    /// Its phases.
    pub phases: Vec<Phase>,
    /// Noise of the force per axis at rest, N (1 sd), where there was rest.
    pub force_noise: Option<f64>,
    /// Force reading without contact (tare), N, where there was rest.
    pub force_tare: Option<nalgebra::Vector3<f64>>,
    /// Load of a hand that held already when the recording began, N, where others of the capture tell it from the tare.
    pub preload: Option<nalgebra::Vector3<f64>>,
    /// How far the tare may be off, N, since nothing tells it from such a load.
    pub tare_doubt: f64,
    /// Noise of tracked positions per axis at rest, m (1 sd).
    pub position_noise: Option<f64>,
    /// Noise of tracked rotations per axis at rest, rad (1 sd).
    pub rotation_noise: Option<f64>,
}

impl Segmented {
    /// The phases of one kind.
    pub fn of(&self, kind: PhaseKind) -> impl Iterator<Item = &Phase> {
        self.phases.iter().filter(move |p| p.kind == kind)
    }
}
