//! Stacks: what is glued, what rests, what nobody tried.

use palpate::base::{Progress, Stopwatch};
use palpate::pipeline::{Run, build};
use palpate::twin::RelationKind;
use rayon::prelude::*;

use crate::scenes::{Stack, stack};
use crate::tally::{Odds, Tally};
use crate::{options, recorded, verbose};

#[derive(Default)]
struct Count {
    right: usize,
    all: usize,
    freedoms: usize,
    undecided: (usize, usize),
    fixed_without_proof: usize,
    odds: Odds,
    breakaway: Tally,
}

impl Count {
    fn judge(&mut self, made: &Stack, pushed: bool, run: &Run, label: &str) {
        let found = run
            .model
            .twin
            .relations
            .iter()
            .find(|r| r.a != "support" && r.b != "support");
        let kind = found.map(|r| r.kind);
        let tried = made.lifted || pushed;
        let wanted = if made.glued {
            RelationKind::Fixed
        } else {
            RelationKind::Resting
        };
        // A glued pair that was only pushed may stay undecided: strong friction does that too.
        let may_stay_open = !made.lifted && (made.glued || !pushed);
        let open = kind == Some(RelationKind::Unknown);
        let right = kind == Some(wanted) && tried || open && may_stay_open;
        self.all += 1;
        self.right += usize::from(right);
        self.undecided.0 += usize::from(open);
        self.undecided.1 += usize::from(may_stay_open);
        self.fixed_without_proof += usize::from(kind == Some(RelationKind::Fixed) && !tried);
        if let Some(relation) = found {
            let dof = if relation.kind == RelationKind::Fixed { 0 } else { 3 };
            self.freedoms += usize::from(right && (relation.rotation_dof, relation.translation_dof) == (dof, dof));
            if !open {
                self.odds.add(relation.probability, right);
            }
            if let (Some(force), Some(truth)) = (&relation.breakaway, made.breakaway) {
                self.breakaway.number(Some(force), truth);
            }
        }
        if !right || verbose() {
            println!(
                "  {label}: glued {} breakaway {:?} lifted {} pushed {pushed}: {kind:?} {:.3} {:?}",
                made.glued,
                made.breakaway,
                made.lifted,
                found.map_or(0.0, |r| r.probability),
                found.and_then(|r| r.breakaway.as_ref()).map(|b| (b.value, b.ci95))
            );
        }
    }
}

pub fn run_all(count: u64) {
    let started = Stopwatch::start();
    let runs: Vec<(Stack, Run)> = (0..count)
        .into_par_iter()
        .map(|seed| {
            let made = stack(seed);
            let capture = recorded(&made.scene, &format!("stack-{seed}"), seed);
            let run = build(&capture, &options(), &Progress::silent()).expect("a run");
            (made, run)
        })
        .collect();
    let mut results = Count::default();
    for (i, (made, run)) in runs.iter().enumerate() {
        results.judge(made, i % 2 == 0, run, &format!("stack {i}"));
    }
    println!("== stacks: {count} scenes, {:.1} s", started.seconds());
    println!(
        "relations right {} of {}; freedoms right {}; left open {} where {} may be; fixed without a touch that could part {}",
        results.right,
        results.all,
        results.freedoms,
        results.undecided.0,
        results.undecided.1,
        results.fixed_without_proof
    );
    results.odds.print("probability of the relation");
    results.breakaway.print("breakaway");
}
