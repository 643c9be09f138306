//! Touches that are asked for, in words.

use crate::twin::AskedTouch;

/// What to do.
pub fn words_of(touch: &AskedTouch) -> String {
    let mut words = String::new();
    if touch.wait > LONG {
        words += &format!("leave {} alone for {:.0} s and ", touch.target, touch.wait);
    }
    let (travel, speed) = (1e3 * touch.travel, 1e3 * touch.speed);
    words += &match touch.kind.as_str() {
        "press" => format!(
            "press {} {travel:.1} mm deep at {} mm/s and hold it for {:.1} s",
            touch.target,
            short(speed),
            touch.duration
        ),
        "pull" => format!(
            "hold {}{} and move it by {travel:.0} mm at {} mm/s{}{}",
            touch.target,
            place(touch),
            short(speed),
            heading(touch),
            if touch.back { " and back" } else { "" }
        ),
        "lift" if touch.turned != 0.0 => {
            return format!(
                "{words}lift {}{} by {travel:.0} mm at {} mm/s, let it hang for {:.1} s and twist it twice to and fro about the \
                 vertical by {:.0} degrees",
                touch.target,
                place(touch),
                short(speed),
                touch.duration,
                touch.turned.to_degrees()
            );
        }
        _ => format!(
            "push {}{} by {travel:.0} mm at {} mm/s{}",
            touch.target,
            place(touch),
            short(speed),
            heading(touch)
        ),
    };
    if touch.down > 0.0 {
        words += &format!(", pressing it down with {:.1} N", touch.down);
    }
    if touch.turned != 0.0 {
        words += &format!(
            ", the tool turned by {:.0} degrees about the vertical",
            touch.turned.to_degrees()
        );
    }
    words
}

/// A pause that is worth a word, s.
const LONG: f64 = 5.0;

fn short(x: f64) -> String {
    if x < 10.0 { format!("{x:.1}") } else { format!("{x:.0}") }
}

fn place(touch: &AskedTouch) -> String {
    let [x, y, z] = touch.start.map(|v| 1e3 * v);
    format!(" at ({x:.0}, {y:.0}, {z:.0}) mm")
}

fn heading(touch: &AskedTouch) -> String {
    let [x, y, z] = touch.direction;
    if z.abs() > 0.5 {
        return if z > 0.0 { " upwards" } else { " downwards" }.into();
    }
    format!(" towards {:.0} degrees", y.atan2(x).to_degrees().rem_euclid(360.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_is_told_with_all_that_matters() {
        let touch = AskedTouch {
            kind: "push".into(),
            target: "box".into(),
            start: [-0.045, 0.0, 0.02],
            direction: [0.0, -1.0, 0.0],
            travel: 0.05,
            speed: 0.006,
            wait: 60.0,
            turned: std::f64::consts::FRAC_PI_2,
            ..AskedTouch::default()
        };
        assert_eq!(
            words_of(&touch),
            "leave box alone for 60 s and push box at (-45, 0, 20) mm by 50 mm at 6.0 mm/s towards 270 degrees, the tool \
             turned by 90 degrees about the vertical"
        );
        let lift = AskedTouch {
            kind: "lift".into(),
            wait: 0.0,
            duration: 0.5,
            turned: 0.4,
            ..touch
        };
        assert_eq!(
            words_of(&lift),
            "lift box at (-45, 0, 20) mm by 50 mm at 6.0 mm/s, let it hang for 0.5 s and twist it twice to and fro about the \
             vertical by 23 degrees"
        );
    }
}
