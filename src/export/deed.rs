//! What a hand does to the twin in the embedded engine, in words: `pick:BODY`, `push:BODY,DIRECTION[,SPEED]`,
//! `open:JOINT[,SPEED]`.

use std::str::FromStr;

use crate::base::Error;

/// Speed of a finger, m/s, where none is given.
const PUSH_SPEED: f64 = 0.05;
/// Speed of an opening, m/s or rad/s, where none is given.
const OPEN_SPEED: f64 = 0.2;

/// One thing that a hand does.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// Take hold of a body, a link, or `body/link`, and lift it.
    Pick {
        /// What is taken.
        target: String,
    },
    /// Push with a round fingertip, level, at the height of the centre of mass.
    Push {
        /// What is pushed.
        target: String,
        /// Where to, rad about the table's normal from the world's x axis.
        heading: f64,
        /// Of the finger, m/s.
        speed: f64,
    },
    /// Pull a joint open by what hangs on it while another hand holds what it hangs on, and let both go.
    Open {
        /// The joint, or the link that hangs on it.
        joint: String,
        /// m/s or rad/s.
        speed: f64,
    },
}

impl FromStr for Deed {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let bad = |found: &str| {
            let expected =
                "pick:BODY, push:BODY,DIRECTION[,SPEED] (x, -x, y, -y or degrees; m/s) or open:JOINT[,SPEED]";
            Error::bad_input("--do", text, found, expected)
        };
        let (verb, rest) = text.split_once(':').ok_or_else(|| bad("no verb"))?;
        let mut words = rest.split(',').map(str::trim);
        let target = words.next().filter(|w| !w.is_empty());
        let target = target.ok_or_else(|| bad("no name"))?.to_string();
        let (second, third) = (words.next(), words.next());
        let speed = |word: Option<&str>, default: f64| match word.map(str::parse::<f64>) {
            None => Ok(default),
            Some(Ok(v)) if (1e-4..=5.0).contains(&v) => Ok(v),
            Some(_) => Err(bad("no speed between 0.0001 and 5")),
        };
        let extra = words.next().is_some();
        match (verb, second, third) {
            ("pick", None, None) => Ok(Self::Pick { target }),
            ("push", Some(direction), given) if !extra => Ok(Self::Push {
                target,
                heading: heading(direction).ok_or_else(|| bad("no direction"))?,
                speed: speed(given, PUSH_SPEED)?,
            }),
            ("open", given, None) => Ok(Self::Open {
                joint: target,
                speed: speed(given, OPEN_SPEED)?,
            }),
            _ => Err(bad("something else")),
        }
    }
}

/// rad.
fn heading(word: &str) -> Option<f64> {
    let degrees = match word {
        "x" | "+x" => 0.0,
        "y" | "+y" => 90.0,
        "-x" => 180.0,
        "-y" => 270.0,
        other => other.parse::<f64>().ok().filter(|d| d.is_finite())?,
    };
    Some(degrees.to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deeds_are_read_or_refused() {
        let deed = |text: &str| text.parse::<Deed>();
        let speed = PUSH_SPEED;
        let push = |heading: f64, speed: f64| Deed::Push {
            target: "tin".into(),
            heading: heading.to_radians(),
            speed,
        };
        assert_eq!(deed("push:tin,-x").unwrap(), push(180.0, speed));
        assert_eq!(deed("push:tin, 30, 0.1").unwrap(), push(30.0, 0.1));
        assert_eq!(deed("pick:tin").unwrap(), Deed::Pick { target: "tin".into() });
        assert!(matches!(deed("open:door,0.5").unwrap(), Deed::Open { speed: 0.5, .. }));
        for wrong in [
            "",
            "pick",
            "pick:",
            "push:tin",
            "push:tin,up",
            "push:tin,x,-1",
            "throw:tin",
            "pick:a,b",
        ] {
            assert_eq!(deed(wrong).unwrap_err().exit_code(), 2, "{wrong}");
        }
    }
}
