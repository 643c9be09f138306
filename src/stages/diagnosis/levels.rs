//! What numbers of the twin become once what was named beside them is told apart from them.

/// Which number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// Kinetic friction of a link.
    Friction,
    /// Stiffness of a link.
    Stiffness,
    /// Dry friction of a joint.
    JointFriction,
}

/// A number of the twin beside the effects that were named.
#[derive(Clone, Debug)]
pub struct Level {
    /// Name of the link, or of the joint.
    pub of: String,
    /// Its number.
    pub number: Number,
    /// Logarithm of what it is over what it was without the effects, with its standard deviation.
    pub log: (f64, f64),
}

impl Level {
    /// That of parameter `k` of a fit.
    pub(super) fn of(fit: &super::fit::Fit, k: usize, of: &str, number: Number) -> Option<Self> {
        let doubt = fit.covariance.get((k, k)).copied().unwrap_or(f64::NAN).sqrt();
        let log = (*fit.theta.get(k)?, doubt);
        (log.0.is_finite() && log.1.is_finite()).then(|| Self {
            of: of.to_owned(),
            number,
            log,
        })
    }

    /// The same over a number that is `by` less, as a logarithm.
    pub(super) fn shifted(mut self, by: f64) -> Self {
        self.log.0 += by;
        self
    }
}
