//! Hidden effects along a joint: efforts, and factors on its dry friction.

/// A law along a joint. Positions in rad (for a slide: in tenths of a metre), efforts in N·m (for a slide: in 10 N).
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) enum JointLaw {
    /// `-b q'`.
    Damping { damping: f64 },
    /// `-d q' |q'|`.
    Quadratic { damping: f64 },
    /// `-k (q - q0)`.
    Spring { stiffness: f64, rest: f64 },
    /// More friction before it moves: a share, and the speed over which it falls.
    Stiction { share: f64, speed: f64 },
    /// One period of a sine.
    Detent { effort: f64, at: f64, width: f64 },
    /// `c cos q + s sin q`.
    Gravity { cos: f64, sin: f64 },
    /// Damping near closed, with a smooth edge.
    SoftClose { damping: f64, at: f64 },
    /// A soft stop beyond a position.
    Stop { stiffness: f64, at: f64 },
    /// Outside the catalogue: dry friction that depends on the position.
    Texture { amplitude: f64, waves: f64 },
}

impl JointLaw {
    /// Effort at a position and a rate.
    pub fn effort(&self, q: f64, dq: f64) -> f64 {
        match *self {
            Self::Damping { damping } => -damping * dq,
            Self::Quadratic { damping } => -damping * dq * dq.abs(),
            Self::Spring { stiffness, rest } => -stiffness * (q - rest),
            Self::Detent { effort, at, width } => {
                let x = (q - at) / (1.6 * width);
                if x.abs() < 1.0 {
                    -effort * (std::f64::consts::PI * x).sin()
                } else {
                    0.0
                }
            }
            Self::Gravity { cos, sin } => cos * q.cos() + sin * q.sin(),
            Self::SoftClose { damping, at } => -damping * dq / (1.0 + ((q - 0.6 * at) / 0.05).exp()),
            Self::Stop { stiffness, at } => -stiffness * (q - at).max(0.0),
            Self::Stiction { .. } | Self::Texture { .. } => 0.0,
        }
    }

    /// Factor on the dry friction.
    pub fn factor(&self, q: f64, dq: f64) -> f64 {
        match *self {
            Self::Stiction { share, speed } => 1.0 + share / (1.0 + (dq / speed).powi(2)),
            Self::Texture { amplitude, waves } => (1.0 + amplitude * (waves * q).sin()).max(0.0),
            _ => 1.0,
        }
    }
}
