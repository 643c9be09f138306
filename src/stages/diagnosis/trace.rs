//! What an interaction measured beside what the twin predicts, as curves to be drawn.

/// One quantity over time, measured and predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// E.g. `force along the push`, `tin x`.
    pub label: String,
    /// E.g. `N`, `mm`.
    pub unit: String,
    /// Seconds.
    pub time: Vec<f64>,
    /// As measured; NaN where missing.
    pub measured: Vec<f64>,
    /// As the twin predicts; empty where there is no prediction.
    pub predicted: Vec<f64>,
    /// One standard deviation of the sensor.
    pub noise: Option<f64>,
}

/// The curves of one interaction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Its name.
    pub interaction: String,
    /// It was not used to fit.
    pub held_out: bool,
    /// Why there is no prediction, where there is none.
    pub remark: Option<String>,
    /// Its curves.
    pub curves: Vec<Curve>,
}
