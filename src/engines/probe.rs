//! Looks for the reason of a miss by playing the touch again with what is doubtful at the ends of its doubt.
//!
//! The miss m of an engine is set beside what each doubtful number does to the end at one standard deviation (the columns of
//! J, by replay in the embedded engine, half the difference between both ends). Were the doubts all there is, the miss would
//! have the covariance `J Jᵀ + R`, with R of the tracks; the most likely numbers that meet the measured end are
//! `z = -Jᵀ (J Jᵀ + R)⁻¹ m`. With those the touch is played once more, so that what is left is no linear guess.

use nalgebra::{Isometry3, Matrix4, Point3, Translation3, Vector3, Vector4};
use rayon::prelude::*;

use super::outside::EngineName;
use super::pivot::pivot;
use super::reason::{Cause, Judged, Reason, Source, beside_each_other};
use super::recorded::{Recorded, TIP};
use super::table::{EngineReport, Outcome, SHARE, TURN, TouchRow};
use crate::base::{Pose, Status};
use crate::export::{Hold, Knob, Trial, knobs, nudged, play};
use crate::twin::{Diagnosis, Model, Verdict};

/// Doubt of a friction against the tool that nobody measured: standard deviation of its logarithm.
const UNFELT: f64 = 0.5;
/// No doubt is believed to be further off than this, standard deviations.
const FURTHEST: f64 = 2.5;
/// A turn of more than this, rad, is judged about its own axis, else about the table's normal.
const TURNS: f64 = 0.03;
/// 95 % of chi-squared with 4 and with 3 degrees of freedom.
const CHI2: [f64; 2] = [9.49, 7.81];
/// Share of the fitted touches that an engine must miss as far as this one, and how many there must be.
const AS_FAR: f64 = 0.1;
const FITTED: usize = 10;
/// Touches from which on what their shifts have in common is known.
const COMMON: usize = 5;
/// Share of a miss that palpate's own laws must miss by too.
const ALIKE: f64 = 0.5;

/// What a touch depends on beside the twin.
#[derive(Clone, Debug)]
enum Doubtful {
    Twin(Knob),
    /// The tool's place along a direction, m.
    Place(Vector3<f64>, f64, &'static str),
    /// Its friction: standard deviation, of the logarithm where nobody measured it.
    Grip(f64, bool),
}

/// Finds reasons.
pub(super) struct Probe<'a> {
    model: &'a Model,
    diagnosis: &'a Diagnosis,
    touches: &'a [Recorded],
    /// How far the tools' places are astray in this capture, 1 sd, m.
    astray: f64,
}

/// Place and turn of an end, relative to the start.
type End = Vector4<f64>;

impl<'a> Probe<'a> {
    pub(super) fn new(model: &'a Model, diagnosis: &'a Diagnosis, touches: &'a [Recorded]) -> Self {
        let free = touches.iter().filter(|t| t.trial.hold == Hold::Touch);
        let shifts: Vec<f64> = free.map(|t| t.shifted.unwrap_or(0.0)).collect();
        Self {
            model,
            diagnosis,
            touches,
            astray: astray(&shifts),
        }
    }

    /// Why engines miss a touch; nothing where none does, or it cannot be played.
    pub(super) fn reason(&self, touch: &Recorded, reports: &[EngineReport]) -> Option<Reason> {
        if touch.press {
            return None;
        }
        let row = |r: &EngineReport| {
            let row = r.touches.iter().find(|t| t.interaction == touch.trial.name)?;
            Some((r.engine, row.clone()))
        };
        let rows: Vec<(EngineName, TouchRow)> = reports.iter().filter_map(row).collect();
        let played = |r: &&(EngineName, TouchRow)| matches!(r.1.outcome, Outcome::Played { .. });
        let missed: Vec<_> = rows.iter().filter(played).filter(|r| !r.1.within()).collect();
        if missed.is_empty() {
            return None;
        }
        let axis = axis(touch);
        let plain = self.end(self.model, &touch.trial, &axis)?;
        let doubtful = self.doubtful(touch);
        let columns: Vec<Option<End>> = doubtful
            .par_iter()
            .map(|d| {
                let at = |z: f64| {
                    let (model, trial) = d.turned(self.model, &touch.trial, z);
                    self.end(&model, &trial, &axis)
                };
                Some(0.5 * (at(1.0)? - at(-1.0)?))
            })
            .collect();
        let columns: Vec<End> = columns.into_iter().map(Option::unwrap_or_default).collect();
        let met = Met {
            probe: self,
            touch,
            axis,
            plain,
            doubtful: &doubtful,
            columns: &columns,
        };
        let judge = |(engine, row): &&(EngineName, TouchRow)| {
            let report = reports.iter().find(|r| r.engine == *engine);
            met.judge(*engine, row, &rows, report.map_or([0; 2], |r| r.fitted_as_far(row)))
        };
        let mut judged: Vec<Judged> = missed.par_iter().map(judge).collect();
        beside_each_other(&mut judged);
        Some(met.reason(judged))
    }

    /// What is doubtful about a touch.
    fn doubtful(&self, touch: &Recorded) -> Vec<Doubtful> {
        let trial = &touch.trial;
        let mut all: Vec<Doubtful> = Vec::new();
        if trial.hold == Hold::Touch {
            let heading = heading(trial);
            let across = touch.up.cross(&heading).try_normalize(1e-6).unwrap_or(Vector3::y());
            all.push(Doubtful::Place(
                across * self.astray.max(0.5 * TIP),
                self.astray.max(0.5 * TIP),
                "place of the tool across its way",
            ));
            all.push(Doubtful::Place(
                heading * 0.5 * TIP,
                0.5 * TIP,
                "place of the tool along its way",
            ));
            let link = self.model.twin.link(&trial.target);
            let tool = link.and_then(|l| l.friction.tool.as_ref());
            let measured = tool.filter(|e| e.status != Status::Assumed).and_then(|e| e.ci95);
            let sd = measured.map(|c| (c[1] - c[0]) / 3.92);
            all.push(Doubtful::Grip(sd.unwrap_or(UNFELT), sd.is_some()));
        }
        all.extend(knobs(self.model, &trial.target).into_iter().map(Doubtful::Twin));
        all
    }

    /// Where a trial ends, from where it settled.
    fn end(&self, model: &Model, trial: &Trial, axis: &Vector3<f64>) -> Option<End> {
        let played = play(model, trial).ok()?;
        let com = self.model.twin.link(&trial.target)?.com.as_ref();
        let com = Point3::from(com.map_or([0.0; 3], |c| c.value));
        let (a, b) = (played.settled.get(&trial.target)?, played.ended.get(&trial.target)?);
        let went = b.0 * com - a.0 * com;
        let turned = (b.rotation * a.rotation.inverse()).scaled_axis().dot(axis);
        let end = Vector4::new(went.x, went.y, went.z, turned);
        end.iter().all(|v| v.is_finite()).then_some(end)
    }
}

/// How far tools' places are astray that had to be shifted so far: what all shifts have in common is the tip's own (its radius, its
/// offset), and what differs from touch to touch is not; of few touches nothing in common is known.
fn astray(shifts: &[f64]) -> f64 {
    let n = shifts.len() as f64;
    let mean = if shifts.len() < COMMON {
        0.0
    } else {
        shifts.iter().sum::<f64>() / n
    };
    (shifts.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n.max(1.0)).sqrt()
}

/// The axis about which turns are judged.
fn axis(touch: &Recorded) -> Vector3<f64> {
    let turn = (touch.after.rotation * touch.before.rotation.inverse()).scaled_axis();
    match touch.oriented && turn.norm() > TURNS {
        true => turn.normalize(),
        false => touch.up.into_inner(),
    }
}

/// Where the tool goes in all, along the table or not.
fn heading(trial: &Trial) -> Vector3<f64> {
    let ends = trial.path.first().zip(trial.path.last());
    let way = ends.map_or_else(Vector3::x, |(a, b)| b.translation.vector - a.translation.vector);
    way.try_normalize(1e-9).unwrap_or(Vector3::x())
}

impl Doubtful {
    /// The twin and the trial with this at `z` standard deviations.
    fn turned(&self, model: &Model, trial: &Trial, z: f64) -> (Model, Trial) {
        let mut trial = trial.clone();
        match self {
            Self::Twin(knob) => return (nudged(model, knob, z), trial),
            Self::Place(by, ..) => {
                for pose in &mut trial.path {
                    *pose = Pose(Isometry3::from_parts(
                        Translation3::from(pose.translation.vector + by * z),
                        pose.rotation,
                    ));
                }
            }
            Self::Grip(sd, true) => trial.friction = (trial.friction + sd * z).max(0.0),
            Self::Grip(sd, false) => trial.friction *= (sd * z).exp(),
        }
        (model.clone(), trial)
    }

    fn source(&self, model: &Model, column: &End) -> Source {
        let (what, status, doubt) = match self {
            Self::Twin(knob) => (knob.words(), knob.status(model), "of its interval".to_owned()),
            Self::Place(_, sd, what) => ((*what).to_owned(), Status::Assumed, format!("1 sd {:.1} mm", 1e3 * sd)),
            Self::Grip(sd, told) => {
                let status = if *told { Status::Measured } else { Status::Assumed };
                let doubt = match told {
                    true => format!("1 sd {sd:.2}"),
                    false => format!("1 sd a factor {:.2}", sd.exp()),
                };
                ("friction of the tool".to_owned(), status, doubt)
            }
        };
        Source {
            what,
            status,
            doubt,
            position: column.xyz().norm(),
            turn: column.w.abs(),
        }
    }
}

/// A touch with what its end depends on.
struct Met<'a> {
    probe: &'a Probe<'a>,
    touch: &'a Recorded,
    axis: Vector3<f64>,
    plain: End,
    doubtful: &'a [Doubtful],
    columns: &'a [End],
}

impl Met<'_> {
    fn reason(&self, judged: Vec<Judged>) -> Reason {
        let total = |of: fn(&End) -> f64| self.columns.iter().map(of).sum::<f64>().sqrt();
        let both = self.doubtful.iter().zip(self.columns);
        Reason {
            interaction: self.touch.trial.name.clone(),
            sources: both.map(|(d, c)| d.source(self.probe.model, c)).collect(),
            scatter: [total(|c| c.xyz().norm_squared()), total(|c| c.w * c.w)],
            spread: [(0, 0), (0, 1), (1, 1)].map(|(i, k)| self.columns.iter().map(|c| c[i] * c[k]).sum()),
            judged,
        }
    }

    fn judge(&self, engine: EngineName, row: &TouchRow, rows: &[(EngineName, TouchRow)], alike: [usize; 2]) -> Judged {
        let miss = self.miss(row);
        let (likely, distance2) = likeliest(self.columns, self.touch.noise, &miss);
        let scale = self.bars(row);
        let scaled = |v: &End| v.component_div(&scale);
        let whole = scaled(&miss).norm_squared().max(1e-12);
        let share = |c: &End, z: f64| -scaled(&(c * z)).dot(&scaled(&miss)) / whole;
        let mut listed: Vec<(usize, f64, f64)> = (0..likely.len())
            .map(|k| (k, likely[k], share(&self.columns[k], likely[k])))
            .collect();
        listed.sort_by(|a, b| b.2.total_cmp(&a.2));
        let left = self.again(&likely).map(|moved| miss + moved);
        let bound = CHI2[usize::from(!self.touch.oriented)];
        let mended = left.is_some_and(|l| l.xyz().norm() <= scale.x && l.w.abs() <= scale.w);
        let mut judged = Judged {
            engine,
            missed_by: miss.xyz().into(),
            turn: miss.w,
            distance2,
            bound,
            likely: listed,
            left: left.map(|l| [l.xyz().norm(), l.w.abs()]),
            mended,
            cause: Cause::Unexplained,
            words: String::new(),
        };
        let kept: Vec<EngineName> = rows.iter().filter(|r| r.1.within()).map(|r| r.0).collect();
        self.conclude(&mut judged, &kept, alike, row);
        judged
    }

    /// The cause with its words.
    fn conclude(&self, j: &mut Judged, kept: &[EngineName], [as_far, fitted]: [usize; 2], row: &TouchRow) {
        let [place, turn] = self.own_miss();
        let size = Vector3::from(j.missed_by).norm();
        let alike = place >= ALIKE * size || (turn > 0.0 && j.turn.abs() > TURN && turn >= ALIKE * j.turn.abs());
        let unknown = self.probe.diagnosis.verdict == Verdict::Unknown;
        let again = j.left.map_or(String::new(), |[m, r]| {
            let within = if j.mended { ", within the bars" } else { "" };
            format!(
                "; with the likeliest values of what is doubtful it ends {:.2} mm and {:.2} degrees off{within}",
                1e3 * m,
                r.to_degrees()
            )
        });
        let far = format!("{:.1} sd of all that is doubtful about it", j.distance2.sqrt());
        let own = format!(
            "palpate's own laws miss held-out touches by {:.2} mm and {:.2} degrees rms (diagnosis: {})",
            1e3 * place,
            turn.to_degrees(),
            if unknown { "unknown" } else { "named" }
        );
        let others: Vec<&str> = kept.iter().map(|e| e.name()).collect();
        (j.cause, j.words) = if j.distance2 <= j.bound {
            (Cause::Doubt, format!("the miss is {far}{again}"))
        } else if !kept.is_empty() {
            let others = others.join(", ");
            (
                Cause::Engine,
                format!("{others} with the same numbers is within the bars; the miss is {far}{again}"),
            )
        } else if let Some(pivot) = pivot(self.probe.model, self.probe.touches, self.touch, row) {
            (Cause::Pivot, format!("{pivot}; the miss is {far}"))
        } else if alike {
            (Cause::Law, format!("{own}; the miss is {far}{again}"))
        } else if fitted >= FITTED && as_far as f64 >= AS_FAR * fitted as f64 {
            (
                Cause::Fitted,
                format!(
                    "of {fitted} touches that the numbers were fitted to this engine misses {as_far} as far; the miss is {far}{again}"
                ),
            )
        } else {
            (Cause::Unexplained, format!("the miss is {far}; {own}{again}"))
        };
    }

    /// By how much palpate's own forward model misses held-out touches, m and rad.
    fn own_miss(&self) -> [f64; 2] {
        let base = &self.probe.diagnosis.base.rmse;
        let of = |names: [&str; 2]| names.iter().find_map(|n| base.get(*n)).copied().unwrap_or(0.0);
        [of(["position", "translation"]), of(["rotation", "heading"])]
    }

    /// What an engine's end differs from the measured one by.
    fn miss(&self, row: &TouchRow) -> End {
        let Outcome::Played {
            missed_by: [x, y, z],
            turned_by,
            ..
        } = &row.outcome
        else {
            return End::zeros();
        };
        let turn = turned_by.map_or(0.0, |t| Vector3::from(t).dot(&self.axis));
        End::new(*x, *y, *z, turn)
    }

    /// What the bars allow.
    fn bars(&self, row: &TouchRow) -> End {
        let place = (SHARE * row.travel).max(2e-4);
        End::new(place, place, place, TURN)
    }

    /// How far the end goes when all that is doubtful is at these standard deviations together.
    fn again(&self, at: &[f64]) -> Option<End> {
        let (mut model, mut trial) = (self.probe.model.clone(), self.touch.trial.clone());
        for (d, z) in self.doubtful.iter().zip(at) {
            (model, trial) = d.turned(&model, &trial, *z);
        }
        Some(self.probe.end(&model, &trial, &self.axis)? - self.plain)
    }
}

/// The likeliest standard deviations of what is doubtful that meet a miss, and the squared (Mahalanobis) size of the miss.
fn likeliest(columns: &[End], noise: [f64; 2], miss: &End) -> (Vec<f64>, f64) {
    let [place, turn] = noise.map(|n| n * n);
    let doubts: Matrix4<f64> = columns.iter().map(|c| c * c.transpose()).sum();
    let covariance = doubts + Matrix4::from_diagonal(&Vector4::new(place, place, place, turn));
    let inverse = covariance.try_inverse().unwrap_or_else(Matrix4::zeros);
    let towards = inverse * miss;
    let z = |c: &End| (-c.dot(&towards)).clamp(-FURTHEST, FURTHEST);
    (columns.iter().map(z).collect(), miss.dot(&towards))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_the_end_most_is_the_likeliest_reason() {
        let columns = [End::new(2e-3, 0.0, 0.0, 0.0), End::new(1e-4, 1e-4, 0.0, 0.01)];
        let (z, size) = likeliest(&columns, [1e-4, 1e-3], &End::new(3e-3, 0.0, 0.0, 0.0));
        assert!((z[0] + 1.5).abs() < 0.02 && z[1].abs() < 0.1, "{z:?}");
        assert!((size - 2.25).abs() < 0.05, "{size}");
        // What nothing doubtful moves is far.
        let (_, size) = likeliest(&columns, [1e-4, 1e-3], &End::new(0.0, 3e-3, 0.0, 0.0));
        assert!(size > 100.0, "{size}");
    }
}
