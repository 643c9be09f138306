//! A random box of the lab with a hidden weight, as a scene without actions.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// How well friction and springs repeat from one touch to the next: 1 sd of the logarithm.
pub const SCATTER: f64 = 0.015;

/// Its edges, m, and the scene's text so far.
#[allow(dead_code, reason = "not every bench needs both")]
pub struct RandomBox {
    pub size: [f64; 3],
    pub text: String,
}

#[allow(dead_code, reason = "not every bench needs both")]
impl RandomBox {
    /// Sizes, density, friction and the place of the weight from `dice`.
    pub fn draw(dice: &mut ChaCha8Rng) -> Self {
        Self::draw_with(dice, SCATTER)
    }

    /// The same, with another scatter from touch to touch.
    pub fn draw_with(dice: &mut ChaCha8Rng, scatter: f64) -> Self {
        let seed = u64::from(dice.random::<u32>());
        let mut between = |low: f64, high: f64| dice.random_range(low..high);
        let size = [between(0.07, 0.14), between(0.06, 0.10), between(0.04, 0.06)];
        let (density, kinetic) = (between(300.0, 1500.0), between(0.15, 0.5));
        let still = kinetic * between(1.03, 1.2);
        let (weight, at) = (between(0.02, 0.15), [between(-0.25, 0.25), between(-0.25, 0.25)]);
        let text = format!(
            r#"
name = "random"
[camera]
views = 0
[repeat]
friction = {scatter}
stiffness = {scatter}
seed = {seed}
[[body]]
name = "box"
shape = {{ kind = "box", size = [{}, {}, {}] }}
density = {density}
position = [0.0, 0.0, {}]
friction = {{ static = {still}, kinetic = {kinetic} }}
known_mesh = true
[[body.weight]]
mass = {weight}
position = [{}, {}, {}]
radius = 0.01
"#,
            size[0],
            size[1],
            size[2],
            0.5 * size[2],
            at[0] * size[0],
            at[1] * size[1],
            -0.15 * size[2]
        );
        Self { size, text }
    }
}
