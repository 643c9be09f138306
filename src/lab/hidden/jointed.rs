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
    /// The dry friction sits behind a play of so much to either side.
    Backlash { half: f64 },
    /// A part of the inertia on a spring and a damper of its own; its place and rate.
    LooseMass {
        inertia: f64,
        rate: f64,
        damping: f64,
        state: Option<[f64; 2]>,
    },
    /// The axis wanders as the joint turns: m for each rad, in two directions across it.
    MovingAxis { drift: [f64; 2] },
    /// The second joint of the scene is geared to the first, softly: how far it goes for each rad, and the stiffness.
    Coupling { ratio: f64, stiffness: f64 },
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
            _ => 0.0,
        }
    }

    /// Effort of what has a motion of its own, over a step.
    pub fn advance(&mut self, q: f64, dq: f64, dt: f64) -> f64 {
        let Self::LooseMass {
            inertia,
            rate,
            damping,
            state,
        } = self
        else {
            return 0.0;
        };
        let [place, speed] = state.get_or_insert([q, dq]);
        let pull = *rate * *rate * (q - *place) + 2.0 * *damping * *rate * (dq - *speed);
        *speed += pull * dt;
        *place += *speed * dt;
        -*inertia * pull
    }

    /// Half the play before dry friction is felt.
    pub fn play(&self) -> f64 {
        match *self {
            Self::Backlash { half } => half,
            _ => 0.0,
        }
    }

    /// Where the axis is at a position, and its change with it, m and m/rad, in two directions across it: a point of the child
    /// that would stay on a fixed axis goes by a cosine.
    pub fn wandering(&self, q: f64) -> [[f64; 2]; 2] {
        match *self {
            Self::MovingAxis { drift } => [drift.map(|d| d * (1.0 - q.cos())), drift.map(|d| d * q.sin())],
            _ => [[0.0; 2]; 2],
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
