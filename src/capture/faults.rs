//! What is wrong with the readings of a capture, whatever was done.

/// What is wrong with readings by themselves, whatever was done.
#[derive(Clone, Debug, Default)]
pub struct SensorFaults {
    /// Readings of force that are far off.
    pub strays: Option<Strays>,
    /// The step to which forces are rounded, N, and in how many values they come.
    pub rounding: Option<(f64, usize)>,
    /// Positions of quiet tracks that are far off, and quiet positions in all, where they prove strays.
    pub stray_positions: Option<(usize, usize)>,
    /// Poses of tracks that only repeat the one before for a while, and poses in all.
    pub frozen: Option<(usize, usize)>,
    /// The end of the range of the force sensor, where readings stand at it.
    pub clipped: Option<Clipped>,
    /// A frequency at which readings of force swing whatever is touched.
    pub hum: Option<Hum>,
}

impl SensorFaults {
    /// Whether no reading has to be left out.
    pub fn sound(&self) -> bool {
        self.strays.is_none() && self.clipped.is_none() && self.frozen.is_none() && self.stray_positions.is_none()
    }
}

/// One frequency in nearly all readings of a force sensor.
#[derive(Clone, Debug)]
pub struct Hum {
    /// Hz.
    pub frequency: f64,
    /// Half of how far it swings, N.
    pub amplitude: f64,
    /// Power over that of the neighbourhood, in the middle stream.
    pub ratio: f64,
    /// It stands out in so many streams of so many.
    pub streams: [usize; 2],
}

/// Readings at the end of the range of a force sensor.
#[derive(Clone, Debug)]
pub struct Clipped {
    /// N, along one axis of the sensor or of the whole.
    pub limit: f64,
    /// Readings in all.
    pub readings: usize,
    /// Standard deviation of the limit, N: nought where readings repeat it to the last digit, else they scatter about it.
    pub sd: f64,
    /// Rows of the stream of force that stand at it, for each interaction of the capture in its order.
    pub rows: Vec<Vec<usize>>,
}

/// Readings of force that are none.
#[derive(Clone, Debug)]
pub struct Strays {
    /// How many of the quiet readings are strays.
    pub count: usize,
    /// Quiet readings in all.
    pub of: usize,
    /// Scatter of the quiet readings about their neighbours with the strays and without, N, on held-out interactions
    /// where there are such.
    pub scatter: (f64, f64),
    /// Those interactions.
    pub held_out: Vec<String>,
    /// The interactions that have them.
    pub from: Vec<String>,
}
