//! What `inspect` says of a capture: as data, and as text for a terminal.

use std::fmt;

use serde::Serialize;

/// What a capture holds, how good it is, and what it cannot tell.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The capture's name.
    pub name: String,
    /// SHA-256 over everything that was read.
    pub digest: String,
    /// The still views, where there are any.
    pub views: Option<ViewSummary>,
    /// Every body or link that is listed, tracked or aimed at.
    pub bodies: Vec<String>,
    /// One entry per interaction, in the order of the file.
    pub interactions: Vec<InteractionSummary>,
    /// What cannot be known from this capture, and what would tell.
    pub missing: Vec<Missing>,
    /// What looks like a mistake in the recording.
    pub doubts: Vec<String>,
}

/// The still views and how much of the scene they see.
#[derive(Clone, Debug, Serialize)]
pub struct ViewSummary {
    /// How many there are.
    pub count: usize,
    /// Name, size and number of views of each camera.
    pub cameras: Vec<CameraSummary>,
    /// Share of pixels with a depth within the camera's range, mean over the views.
    pub valid_fraction: f64,
    /// The same of the worst view.
    pub worst_valid_fraction: f64,
    /// Degrees of azimuth about the middle of the scene that have a view within 30 degrees.
    pub azimuth_coverage_deg: f64,
    /// Lowest and highest elevation of a camera above the horizontal, seen from the middle of the scene, degrees.
    pub elevation_deg: [f64; 2],
    /// Largest angle between two directions of view, degrees.
    pub direction_spread_deg: f64,
    /// Views with colour.
    pub with_color: usize,
    /// Views with instance ids.
    pub with_labels: usize,
}

/// One camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraSummary {
    /// Its name.
    pub name: String,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Views taken with it.
    pub views: usize,
}

/// One interaction.
#[derive(Clone, Debug, Serialize)]
pub struct InteractionSummary {
    /// Its name.
    pub name: String,
    /// push, pull, press, lift, tilt, toss or hold.
    pub kind: &'static str,
    /// The body or link that the tool means to touch.
    pub target: Option<String>,
    /// The label by which trials are grouped.
    pub action: Option<String>,
    /// The tool in words.
    pub tool: Option<String>,
    /// Kept to check predictions.
    pub held_out: bool,
    /// From the first to the last time of any stream, s.
    pub duration: f64,
    /// Its streams.
    pub streams: Vec<StreamSummary>,
    /// Largest force, N.
    pub peak_force: Option<f64>,
    /// Largest torque about the tool's origin, N·m.
    pub peak_torque: Option<f64>,
    /// Largest angle of the support against its first direction, degrees.
    pub largest_tilt_deg: Option<f64>,
    /// How far each tracked body went.
    pub moved: Vec<Motion>,
    /// Images taken meanwhile.
    pub frames: usize,
}

/// One stream.
#[derive(Clone, Debug, Serialize)]
pub struct StreamSummary {
    /// `force`, `tool_path`, `support_path` or `tracks.NAME`.
    pub name: String,
    /// Rows.
    pub rows: usize,
    /// First and last time, s.
    pub span: [f64; 2],
    /// One over the median step, Hz, where time goes on.
    pub rate: Option<f64>,
    /// Rows without a reading.
    pub missing_rows: usize,
    /// Steps of more than five times the median: when they begin and how long they last, s.
    pub gaps: Vec<[f64; 2]>,
    /// Noise at rest per quantity, one standard deviation per axis.
    pub noise: Vec<NoiseAtRest>,
}

/// Noise of one quantity in the quietest stretch of a stream.
#[derive(Clone, Debug, Serialize)]
pub struct NoiseAtRest {
    /// `force`, `torque`, `position` or `rotation`.
    pub quantity: &'static str,
    /// One standard deviation per axis.
    pub sd: f64,
    /// Its unit.
    pub unit: &'static str,
}

/// How far a tracked body went.
#[derive(Clone, Debug, Serialize)]
pub struct Motion {
    /// The body or link.
    pub body: String,
    /// Farthest from where it was first seen, m.
    pub farthest: f64,
    /// From the first to the last row, m.
    pub net: f64,
    /// Largest turn against the first orientation, degrees, where orientation was tracked.
    pub turned_deg: Option<f64>,
}

/// Something that these data cannot tell.
#[derive(Clone, Debug, Serialize)]
pub struct Missing {
    /// The estimate, e.g. `mass`.
    pub estimate: String,
    /// The bodies that it is about; empty where it is about the scene.
    pub bodies: Vec<String>,
    /// Why, and what would tell.
    pub reason: String,
}

impl Inspection {
    /// The inspection as lines of text.
    pub fn to_text(&self) -> String {
        self.to_string()
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.name)?;
        match &self.views {
            Some(views) => write!(f, "{views}")?,
            None => writeln!(f, "  no views")?,
        }
        writeln!(f, "  bodies: {}", list_or(&self.bodies, "none named"))?;
        let fitted = self.interactions.iter().filter(|x| !x.held_out).count();
        let all = self.interactions.len();
        writeln!(f, "  interactions: {all} ({fitted} to fit, {} held out)", all - fitted)?;
        self.interactions.iter().try_for_each(|x| write!(f, "{x}"))?;
        if !self.missing.is_empty() {
            writeln!(f, "  what these data cannot tell:")?;
        }
        for missing in &self.missing {
            let of = if missing.bodies.is_empty() {
                String::new()
            } else {
                format!(" of {}", missing.bodies.join(", "))
            };
            writeln!(f, "    {}{of}: {}", missing.estimate, missing.reason)?;
        }
        if !self.doubts.is_empty() {
            writeln!(f, "  what looks like a mistake:")?;
        }
        self.doubts.iter().try_for_each(|doubt| writeln!(f, "    {doubt}"))
    }
}

impl fmt::Display for ViewSummary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let camera = |c: &CameraSummary| format!("{} {}x{} ({})", c.name, c.width, c.height, c.views);
        let cameras: Vec<String> = self.cameras.iter().map(camera).collect();
        writeln!(f, "  views: {}, cameras {}", self.count, cameras.join(", "))?;
        let [low, high] = self.elevation_deg;
        writeln!(
            f,
            "    valid depth {:.0} % (worst {:.0} %), azimuth {:.0} of 360 deg, elevation {low:.0} to {high:.0} deg, directions within {:.0} deg",
            100.0 * self.valid_fraction,
            100.0 * self.worst_valid_fraction,
            self.azimuth_coverage_deg,
            self.direction_spread_deg
        )?;
        writeln!(
            f,
            "    with colour {}, with labels {}",
            self.with_color, self.with_labels
        )
    }
}

impl fmt::Display for InteractionSummary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let on = self.target.as_ref().map(|t| format!(" of {t}")).unwrap_or_default();
        let tool = self.tool.as_ref().map(|t| format!(", {t}")).unwrap_or_default();
        let kept = if self.held_out { ", held out" } else { "" };
        writeln!(
            f,
            "    {}: {}{on}, {:.3} s{tool}{kept}",
            self.name, self.kind, self.duration
        )?;
        self.streams.iter().try_for_each(|stream| write!(f, "{stream}"))?;
        if let Some(peak) = self.peak_force {
            let torque = self
                .peak_torque
                .map(|t| format!(", peak torque {t:.4} N·m"))
                .unwrap_or_default();
            writeln!(f, "      peak force {peak:.3} N{torque}")?;
        }
        if let Some(tilt) = self.largest_tilt_deg {
            writeln!(f, "      the support turned by {tilt:.1} deg")?;
        }
        for m in &self.moved {
            let turned = m.turned_deg.map(|t| format!(", turned {t:.1} deg")).unwrap_or_default();
            writeln!(
                f,
                "      {} moved {:.1} mm (net {:.1} mm){turned}",
                m.body,
                1e3 * m.farthest,
                1e3 * m.net
            )?;
        }
        if self.frames > 0 {
            writeln!(f, "      {} frames", self.frames)?;
        }
        Ok(())
    }
}

impl fmt::Display for StreamSummary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "      {}: {} rows", self.name, self.rows)?;
        if let Some(rate) = self.rate {
            write!(f, ", {rate:.1} Hz")?;
        }
        if self.missing_rows > 0 {
            write!(f, ", {} missing", self.missing_rows)?;
        }
        for [start, length] in self.gaps.iter().take(3) {
            write!(f, ", gap of {length:.3} s at {start:.3} s")?;
        }
        if self.gaps.len() > 3 {
            write!(f, " and {} more", self.gaps.len() - 3)?;
        }
        for noise in &self.noise {
            write!(f, ", {} noise {:.2e} {}", noise.quantity, noise.sd, noise.unit)?;
        }
        writeln!(f)
    }
}

fn list_or(names: &[String], otherwise: &str) -> String {
    if names.is_empty() {
        otherwise.to_owned()
    } else {
        names.join(", ")
    }
}
