//! How effects are asked for on the command line, and how strong they may be.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::catalogue::hidden_causes;
use crate::base::{Error, Result, Seed, nearest_name, rng_for};
use crate::lab::{HideSpec, Scene};

/// The option.
const OPTION: &str = "--hide";
/// Strengths beyond this are no effect of their kind any more: all else in the scene is small beside it.
const MOST: f64 = 16.0;
/// A table, or gravity, that leans by more lets what stands on it slide off (0.035 rad each).
const LEANS: f64 = 8.0;
/// A centre of mass farther off lies outside of what a body stands on (8 to 10 mm each).
const STANDS: f64 = 4.0;
/// Of all draws so many hide nothing, and so many two causes.
const CLEAN: f64 = 0.25;
const PAIRS: f64 = 1.0 / 6.0;

/// The largest strength of a cause.
pub(in crate::lab) fn most_of(cause: &str) -> f64 {
    match cause {
        "support-tilt" | "gravity-error" => LEANS,
        "com-offset" | "nonuniform-density" => STANDS,
        _ => MOST,
    }
}

/// Reads `CAUSE[:STRENGTH]`, several with commas; `random[:STRENGTH]` draws, and `none` hides nothing. Strength 1 is a plain amplitude
/// of its kind.
///
/// # Errors
/// A cause that there is not, that the scene cannot show or that was asked for before, a strength that is none of its kind, and
/// `none` or `random` beside others.
pub fn hide_by_word(scene: &Scene, word: &str, seed: Seed) -> Result<Vec<HideSpec>> {
    let able = hidden_causes(scene);
    let parts: Vec<(&str, Option<&str>)> = word.split(',').map(named).collect();
    if let [(cause, strength)] = parts[..] {
        match (cause, strength) {
            ("none", None) => return Ok(Vec::new()),
            ("random", None) => return Ok(hide_at_random(scene, seed)),
            ("random", Some(_)) => return one_at_random(&able, strength, seed),
            _ => {}
        }
    }
    let mut all: Vec<HideSpec> = Vec::new();
    for (cause, strength) in parts {
        if matches!(cause, "none" | "random") {
            let alone = format!("{cause} by itself, or names of causes");
            return Err(Error::bad_input(OPTION, cause, format!("{word:?}"), alone));
        }
        if !able.contains(&cause) {
            return Err(unable(scene, cause, &able));
        }
        if all.iter().any(|h| h.cause == cause) {
            return Err(Error::bad_input(OPTION, cause, "it twice", "each cause once"));
        }
        all.push(HideSpec {
            cause: cause.to_owned(),
            strength: strength_of(cause, strength)?,
            seed: seed.0,
        });
    }
    Ok(all)
}

fn named(part: &str) -> (&str, Option<&str>) {
    part.split_once(':').map_or((part, None), |(c, s)| (c, Some(s)))
}

fn strength_of(cause: &str, word: Option<&str>) -> Result<f64> {
    let Some(word) = word else { return Ok(1.0) };
    let most = most_of(cause);
    let read = word.parse().ok().filter(|s: &f64| *s > 0.0 && *s <= most);
    read.ok_or_else(|| {
        let expected = format!("a strength above 0 and up to {most}; 1 is plain, and {OPTION} none hides nothing");
        Error::bad_input(OPTION, cause, format!("{word:?}"), expected)
    })
}

fn unable(scene: &Scene, cause: &str, able: &[&str]) -> Error {
    let near = nearest_name(cause, able.iter().copied().chain(["none", "random"]));
    let hint = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
    let list = able.join(", ");
    Error::Usage(format!(
        "{OPTION}: {} cannot hide {cause:?}{hint}; it can hide: none, random, {list}",
        scene.name
    ))
}

/// One cause at this strength; the draw is among those that may be that strong.
fn one_at_random(able: &[&str], strength: Option<&str>, seed: Seed) -> Result<Vec<HideSpec>> {
    let strength = strength_of("random", strength)?;
    let open: Vec<&str> = able.iter().copied().filter(|c| strength <= most_of(c)).collect();
    let mut rng = rng_for(seed, "what is hidden");
    let drawn = drawn(&open, &mut rng).map(|cause| HideSpec {
        cause: cause.to_owned(),
        strength,
        seed: seed.0,
    });
    Ok(drawn.into_iter().collect())
}

fn drawn<'a>(from: &[&'a str], rng: &mut ChaCha8Rng) -> Option<&'a str> {
    (!from.is_empty()).then(|| from[rng.random_range(0..from.len())])
}

/// A drawn effect: in a quarter of all draws none, in a sixth two causes of the catalogue, else one, which may be of none;
/// strength log-uniform from 1/4 to 4.
pub fn hide_at_random(scene: &Scene, seed: Seed) -> Vec<HideSpec> {
    let mut rng = rng_for(seed, "what is hidden");
    let able = hidden_causes(scene);
    let sort = rng.random::<f64>();
    if sort < CLEAN {
        return Vec::new();
    }
    let strength = 4.0_f64.powf(rng.random_range(-1.0..1.0));
    let hide = |cause: &str| HideSpec {
        cause: cause.to_owned(),
        strength,
        seed: seed.0,
    };
    let mut within: Vec<&str> = able.iter().copied().filter(|c| !c.starts_with("outside")).collect();
    if sort < 1.0 - PAIRS || within.len() < 2 {
        return drawn(&able, &mut rng).map(hide).into_iter().collect();
    }
    let first = drawn(&within, &mut rng);
    within.retain(|c| Some(*c) != first);
    let second = drawn(&within, &mut rng);
    [first, second].into_iter().flatten().map(hide).collect()
}
