//! A press: `F = max(0, k u + c u')` with `u` the indentation past the first contact.

/// What is known of the spot that is pressed.
#[derive(Clone, Copy, Debug)]
pub struct Press {
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub damping: f64,
    /// Tool travel at which contact begins, m.
    pub contact: f64,
}

/// Force along the press at each tool travel (m, towards the support).
pub fn predict_press(press: &Press, time: &[f64], travel: &[f64]) -> Vec<f64> {
    (0..travel.len())
        .map(|i| {
            let depth = travel[i] - press.contact;
            let (a, b) = (i.saturating_sub(2), (i + 2).min(travel.len() - 1));
            let rate = if time[b] > time[a] {
                (travel[b] - travel[a]) / (time[b] - time[a])
            } else {
                0.0
            };
            if depth > 0.0 {
                (press.stiffness * depth + press.damping * rate).max(0.0)
            } else {
                0.0
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_follows_the_spring_and_never_pulls() {
        let press = Press {
            stiffness: 2000.0,
            damping: 0.0,
            contact: 0.010,
        };
        let time: Vec<f64> = (0..5).map(f64::from).collect();
        let force = predict_press(&press, &time, &[0.0, 0.010, 0.012, 0.011, 0.005]);
        assert_eq!(force[1], 0.0);
        assert!((force[2] - 4.0).abs() < 1e-12 && (force[3] - 2.0).abs() < 1e-12);
        assert_eq!(force[4], 0.0);
    }
}
