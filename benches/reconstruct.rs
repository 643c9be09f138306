//! Times of the whole way on the tiny golden capture: `cargo bench --bench reconstruct`.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "criterion's macros make undocumented items"
)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use palpate::base::Progress;
use palpate::capture::read_capture;
use palpate::pipeline::{Options, build};

fn reconstruct(c: &mut Criterion) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/tiny/capture");
    let capture = read_capture(&folder).expect("the golden capture");
    let mut group = c.benchmark_group("tiny");
    group.sample_size(10);
    group.bench_function("read", |b| {
        b.iter(|| read_capture(black_box(&folder)).expect("the golden capture"))
    });
    group.bench_function("build", |b| {
        b.iter(|| build(black_box(&capture), &Options::default(), &Progress::silent()).expect("a run"));
    });
    group.finish();
}

criterion_group!(benches, reconstruct);
criterion_main!(benches);
