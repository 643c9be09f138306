//! The report page of a small run made by hand: sound markup, nothing fetched, text escaped, same bytes each time.

#![allow(clippy::expect_used, reason = "tests may stop")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, Vector3};
use palpate::base::{Confounded, Estimate, Notice, Pose, Severity};
use palpate::capture::{Capture, Interaction, Kind, Noise, Phase, PhaseKind, PoseStream, Segmented, WrenchStream};
use palpate::geometry::Mesh;
use palpate::pipeline::Run;
use palpate::report::render;
use palpate::stages::diagnosis::{Curve, Path, Quantity, Trace};
use palpate::twin::{
    BaseFit, Body, Budget, CauseOdds, DIAGNOSIS_FORMAT, Diagnosis, Evidence, Experiment, FORMAT, Finding, Gain, Joint,
    JointAlternative, JointKind, Link, Miss, Model, Profile, ProfileBin, ProfileSample, Provenance, Relation,
    RelationKind, SupportPlane, SymmetryPlane, Twin, Verdict,
};

/// A name that breaks a page which does not escape it.
const EVIL: &str = "</script><script>alert('x')</script>\"&";

fn tetrahedron() -> Mesh {
    Mesh {
        vertices: vec![
            Point3::origin(),
            Point3::new(0.1, 0.0, 0.0),
            Point3::new(0.0, 0.1, 0.0),
            Point3::new(0.0, 0.0, 0.1),
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        colors: vec![[200, 40, 30]; 4],
        seen: vec![true, true, false, true],
        mirrored: Vec::new(),
    }
}

fn link(name: &str, x: f64) -> Link {
    let mut link = Link::new(name, Pose(Isometry3::translation(x, 0.0, 0.0)));
    link.mesh = Some("meshes/shape.obj".into());
    link.collision = vec!["meshes/shape.obj".into()];
    link.seen = Some(0.75);
    link.symmetry = vec![SymmetryPlane {
        normal: [1.0, 0.0, 0.0],
        offset: 0.02,
        score: 0.97,
        ..SymmetryPlane::default()
    }];
    let lift = || vec!["lift".to_owned()];
    link.mass = Some(
        Estimate::assumed(0.2134, 0.05, "kg", "prior").with_confounded(Confounded {
            with: vec!["friction.kinetic".into()],
            known: "friction_force.kinetic = 0.75 N".into(),
            experiment: "lift it".into(),
        }),
    );
    link.friction_force.kinetic = Some(Estimate::measured(0.753, 0.015, "N", lift(), "push-kinetic"));
    link.com = Some(Estimate::measured([0.01, -0.02, 0.03], [1e-3; 3], "m", lift(), "lift"));
    link.inertia = Some(Estimate::assumed(
        [3e-4, 3e-4, 3e-4, 0.0, 0.0, 0.0],
        [5e-5; 6],
        "kg·m²",
        "uniform",
    ));
    link
}

fn joint() -> Joint {
    let others = [JointKind::Prismatic, JointKind::Screw];
    Joint {
        name: "base_arm".into(),
        kind: JointKind::Revolute,
        parent: "base".into(),
        child: "arm".into(),
        probability: 0.98,
        alternatives: others
            .map(|kind| JointAlternative {
                kind,
                probability: 0.01,
            })
            .to_vec(),
        axis: Estimate::measured(
            [0.0, 0.0, 1.0],
            [1e-3, 1e-3, 1e-6],
            "1",
            vec!["pull".into()],
            "relative-motion",
        ),
        origin: Estimate::measured(
            [0.05, 0.0, 0.02],
            [1e-4; 3],
            "m",
            vec!["pull".into()],
            "relative-motion",
        ),
        pitch: None,
        limits: Some(Estimate::measured(
            [-0.6, 0.7],
            [0.01; 2],
            "rad",
            vec!["pull".into()],
            "end-stop",
        )),
        travelled: Some([-0.6, 0.7]),
        position: Some(Estimate::known(0.0, None, "rad")),
        friction: Some(Estimate::measured(
            0.03,
            0.002,
            "N·m",
            vec!["pull".into()],
            "joint-load",
        )),
        damping: None,
        stiffness: None,
        rest: None,
        effort: None,
        effects: palpate::twin::JointEffects::default(),
        lateral: None,
    }
}

fn relation(a: &str, b: &str, kind: RelationKind) -> Relation {
    Relation {
        a: a.into(),
        b: b.into(),
        kind,
        rotation_dof: 1,
        translation_dof: 0,
        probability: 0.98,
        from: vec!["pull".into()],
        breakaway: None,
    }
}

fn twin() -> Twin {
    let pair = Body {
        name: "base".into(),
        links: vec![link("base", 0.0), link("arm", 0.1)],
        joints: vec![joint()],
    };
    Twin {
        format: FORMAT.into(),
        name: EVIL.into(),
        gravity: [0.0, 0.0, -9.81],
        support: Some(SupportPlane {
            point: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            material: None,
            gravity: None,
        }),
        bodies: vec![pair, Body::rigid(Link::new(EVIL, Pose::identity()))],
        relations: vec![
            relation("support", "base", RelationKind::Resting),
            relation("base", "arm", RelationKind::Revolute),
            relation("support", EVIL, RelationKind::Unknown),
            relation("base", "never-seen", RelationKind::Fixed),
            relation("arm", EVIL, RelationKind::Separate),
        ],
        provenance: Provenance {
            version: "0.1.0".into(),
            capture_digest: "abc".into(),
            options: BTreeMap::from([(EVIL.into(), EVIL.into())]),
            seed: 7,
            seconds: BTreeMap::new(),
            tracks_from_images: Vec::new(),
        },
        effects: Vec::new(),
        notices: vec![Notice {
            severity: Severity::Warning,
            stage: "shape".into(),
            about: EVIL.into(),
            message: EVIL.into(),
        }],
    }
}

fn finding() -> Finding {
    Finding {
        leader: None,
        priors: BTreeMap::new(),
        cause: "com-offset".into(),
        place: EVIL.into(),
        probability: 0.9,
        alternatives: vec![CauseOdds {
            cause: "friction-patch".into(),
            probability: 0.1,
        }],
        parameters: BTreeMap::from([("offset".into(), Estimate::measured(0.01, 1e-3, "m", Vec::new(), "fit"))]),
        evidence: vec![evidence("force of push")],
        gain: Gain {
            quantity: "position".into(),
            rmse_before: 2e-3,
            rmse_after: 4e-4,
            unit: "m".into(),
            held_out: vec!["push".into()],
            reduction: 0.8,
            ..Gain::default()
        },
    }
}

fn evidence(residual: &str) -> Evidence {
    Evidence {
        residual: residual.into(),
        test: "Ljung-Box, 20 lags".into(),
        statistic: 120.0,
        p_value: 1e-9,
        words: EVIL.into(),
    }
}

fn diagnosis() -> Diagnosis {
    Diagnosis {
        format: DIAGNOSIS_FORMAT.into(),
        base: BaseFit {
            rmse: BTreeMap::from([("force".into(), 0.055), ("position".into(), 3.8e-4)]),
            noise_floor: BTreeMap::from([("force".into(), 0.0087), ("position".into(), 2e-4)]),
            unexplained: 0.05,
            held_out: vec!["push".into()],
            tests: vec![evidence("force of push")],
        },
        verdict: Verdict::Adequate,
        findings: vec![finding()],
        experiments: vec![Experiment {
            words: EVIL.into(),
            parts: vec!["com-offset".into()],
            bits: Some(1.25),
            touches: Vec::new(),
        }],
        profiles: vec![profile()],
        budgets: vec![Budget {
            beside_contact: 0.0,
            quantity: "force".into(),
            unit: "N".into(),
            rmse: 0.3,
            of: String::new(),
            interactions: vec!["push".into()],
            causes: vec!["com-offset".into()],
            named: 0.7,
            doubtful: 0.0,
            friction_law: 0.1,
            geometry: 0.05,
            timing: 0.05,
            noise: 0.025,
            unexplained: 0.075,
        }],
        missed: Vec::new(),
        left: Vec::new(),
    }
}

/// What gave the finding away, with a stretch of which nothing is known.
fn profile() -> Profile {
    let bin = |at: f64, before: f64| ProfileBin {
        at,
        before,
        after: 0.01,
        sd: 0.02,
    };
    let sample = |time: f64| ProfileSample {
        time,
        measured: if time < 0.2 { f64::NAN } else { 1.0 + time },
        before: 0.5,
        after: 1.0,
    };
    Profile {
        cause: finding().cause,
        place: finding().place,
        quantity: "force".into(),
        unit: "N".into(),
        covariate: EVIL.into(),
        covariate_unit: "m/s".into(),
        bins: vec![bin(0.0, -0.2), bin(0.1, 0.3)],
        interaction: EVIL.into(),
        held_out: true,
        samples: [0.0, 0.1, 0.2, 0.3].map(sample).to_vec(),
    }
}

/// A curve with every trap: missing readings, a stretch without prediction, more rows than are drawn.
fn curve(quantity: Quantity, predicted: bool) -> Curve {
    let time: Vec<f64> = (0..2000).map(|i| 10.0 + 1e-3 * f64::from(i)).collect();
    let measured = time.iter().map(|t| if *t < 10.2 { f64::NAN } else { (3.0 * t).sin() });
    let model = time
        .iter()
        .map(|t| if *t > 11.5 { f64::NAN } else { (3.0 * t).sin() + 0.01 });
    Curve {
        label: EVIL.into(),
        quantity,
        measured: measured.collect(),
        predicted: if predicted { model.collect() } else { Vec::new() },
        time,
        noise: Some(0.02),
    }
}

fn empty(quantity: Quantity) -> Curve {
    Curve {
        label: "nothing".into(),
        quantity,
        time: Vec::new(),
        measured: Vec::new(),
        predicted: Vec::new(),
        noise: None,
    }
}

fn traces() -> Vec<Trace> {
    let all = [
        Quantity::Force,
        Quantity::Torque,
        Quantity::Position,
        Quantity::Rotation,
    ];
    let curves = all
        .into_iter()
        .map(|q| curve(q, true))
        .chain([curve(Quantity::Force, false), empty(Quantity::Force)]);
    vec![
        Trace {
            interaction: "push".into(),
            held_out: true,
            remark: Some(EVIL.into()),
            curves: curves.collect(),
            ..Trace::default()
        },
        Trace {
            interaction: EVIL.into(),
            ..Trace::default()
        },
    ]
}

fn segmented() -> Segmented {
    let kinds = [
        PhaseKind::Rest,
        PhaseKind::Approach,
        PhaseKind::Stick,
        PhaseKind::Slide,
        PhaseKind::Release,
    ];
    let phase = |(i, kind): (usize, PhaseKind)| Phase {
        kind,
        start: 10.0 + 0.4 * i as f64,
        end: 10.4 + 0.4 * i as f64,
        moving: Vec::new(),
        touched: Vec::new(),
    };
    Segmented {
        interaction: "push".into(),
        phases: kinds.into_iter().enumerate().map(phase).collect(),
        force_noise: None,
        force_tare: None,
        preload: None,
        tare_doubt: 0.0,
        position_noise: None,
        rotation_noise: None,
    }
}

fn run() -> Run {
    Run {
        model: Model {
            twin: twin(),
            meshes: BTreeMap::from([("meshes/shape.obj".to_owned(), tetrahedron())]),
            textures: BTreeMap::new(),
        },
        diagnosis: diagnosis(),
        traces: traces(),
        segmented: vec![segmented()],
        snapshots: None,
        pictures: Vec::new(),
        seconds: vec![("shape", 12.345)],
    }
}

fn capture() -> Capture {
    let push = Interaction {
        name: "push".into(),
        kind: Kind::Push,
        action: None,
        tool_name: None,
        tool: None,
        target: Some(EVIL.into()),
        force: None,
        tool_path: None,
        support_path: None,
        tracks: BTreeMap::new(),
        frames: None,
        held_out: true,
    };
    Capture {
        root: PathBuf::new(),
        name: EVIL.into(),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        support: None,
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: vec![push],
        truth: None,
        digest: "abc".into(),
    }
}

fn page() -> String {
    render(&capture(), &run()).expect("a page")
}

/// The page without what stands inside style and script elements.
fn markup(page: &str) -> String {
    let mut out = String::new();
    let mut rest = page;
    while let Some(at) = rest.find("<script").into_iter().chain(rest.find("<style")).min() {
        let close = if rest[at..].starts_with("<script") {
            "</script>"
        } else {
            "</style>"
        };
        let open = at + rest[at..].find('>').expect("a tag ends") + 1;
        out.push_str(&rest[..open]);
        rest = &rest[open + rest[open..].find(close).expect("the element ends")..];
        out.push_str(close);
        rest = &rest[close.len()..];
    }
    out + rest
}

#[test]
fn every_element_is_closed_where_it_was_opened() {
    const VOID: [&str; 4] = ["meta", "link", "br", "input"];
    let text = markup(&page());
    let mut open: Vec<&str> = Vec::new();
    for piece in text.split('<').skip(1) {
        let (tag, after) = piece.split_once('>').expect("a tag ends");
        assert!(!after.contains('>'), "a bare > after <{tag}>");
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap_or("");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> closes another element");
        } else if !(tag.starts_with('!') || tag.ends_with('/') || VOID.contains(&name)) {
            open.push(name);
        }
        assert_eq!(
            tag.matches('"').count() % 2,
            0,
            "an attribute that does not end: <{tag}>"
        );
    }
    assert!(open.is_empty(), "left open: {open:?}");
}

#[test]
fn the_page_fetches_nothing() {
    let text = markup(&page());
    assert!(!text.contains("http://") && !text.contains("https://"));
    assert!(!text.contains(" src=") && !text.contains("srcset="));
    for target in text.split("href=\"").skip(1) {
        assert!(
            target.starts_with('#') || target.starts_with("data:,"),
            "{}",
            &target[..20]
        );
    }
    let page = page();
    assert!(!page.contains("url(") && !page.contains("@import"));
}

#[test]
fn names_stay_text() {
    let page = page();
    assert!(!page.contains("alert('x')</script>"), "a name closed a script");
    assert!(!markup(&page).contains("alert('x')"), "a quote of a name was left");
    let outside = page.replace(include_str!("../src/report/assets/viewer.js"), "");
    assert_eq!(outside.matches("<script").count(), 2, "a name opened a script");
}

#[test]
fn the_same_run_gives_the_same_bytes_and_no_clock_shows() {
    let first = page();
    assert_eq!(first, page());
    assert!(!first.contains("12.345"), "wall seconds are on the page");
}

#[test]
fn a_small_run_makes_a_small_page() {
    let page = page();
    let viewer = include_str!("../src/report/assets/viewer.js").len();
    assert!(viewer < 2_600_000, "{viewer} bytes of viewer and engine");
    assert!(page.len() - viewer < 300_000, "{} bytes", page.len() - viewer);
    // At most 300 dots per curve, 5 curves with readings.
    let dots = markup(&page).matches("h0").count();
    assert!((500..5 * 300 + 100).contains(&dots), "{dots} dots");
    assert!(
        !markup(&page).contains("NaN") && !markup(&page).contains("inf"),
        "a number that is none was drawn"
    );
}

#[test]
fn the_page_says_what_was_found() {
    let text = markup(&page());
    let said = [
        "Adequate",
        "no more than noise, the usual",
        "what the twin's own numbers leave in doubt",
        "To part them: lift it.",
        "0.753 ± 0.015 N",
        "held out",
        "−34.4",
        "revolute",
        "com-offset",
        "1.25 bits",
        "What the error of the plain model is made of",
        "named causes <b>70.0 %</b>",
        "without the finding",
        "version 0.1.0",
        "never-seen",
        "Nobody saw its shape.",
    ];
    for words in said {
        assert!(text.contains(words), "{words}");
    }
}

#[test]
fn the_diagnosis_comes_first_and_the_cause_stands_at_the_head() {
    let text = markup(&page());
    let at = |words: &str| text.find(words).expect(words);
    assert!(at("id=\"diagnosis\"") < at("id=\"view\""));
    assert!(at("<dt>Cause</dt>") < at("id=\"diagnosis\""));
    assert!(at("class=\"ranked\"") < at("What to do next"));
}

#[test]
fn what_is_left_without_a_name_is_said() {
    let mut run = run();
    run.diagnosis.verdict = Verdict::Unknown;
    run.diagnosis.missed = vec![Miss {
        interaction: EVIL.into(),
        held_out: true,
        quantity: "force".into(),
        unit: "N".into(),
        rmse: 0.41,
        noise: Some(0.0136),
        of: "means over 0.25 s".into(),
    }];
    let text = render(&capture(), &run).expect("a page");
    assert!(text.contains("force 0.41 N rms off, 30.1 times the noise (means over 0.25 s)"));
}

/// The JSON that the page carries.
fn scene_data(page: &str) -> serde_json::Value {
    let head = "id=\"scene-data\">";
    let from = page.find(head).expect("data") + head.len();
    let to = from + page[from..].find("</script>").expect("an end");
    serde_json::from_str(&page[from..to]).expect("JSON")
}

#[test]
fn the_engine_is_given_the_numbers_of_the_exports() {
    let data = scene_data(&page());
    let parts = data["physics"]["parts"].as_array().expect("parts");
    assert_eq!(parts.len(), 3);
    let arm = parts.iter().find(|p| p["link"] == "arm").expect("the arm");
    assert_eq!(arm["mass"], 0.2134);
    // What turns has its frame on the joint: 50 mm along x and 20 mm up, so the link's origin is off by the rest.
    assert_eq!(arm["pose"][0], 0.05);
    assert_eq!(arm["origin"], serde_json::json!([0.05, 0.0, -0.02]));
    assert_eq!(arm["joint"]["motion"]["range"], serde_json::json!([-0.6, 0.7]));
    assert_eq!(arm["joint"]["motion"]["friction"], 0.03);
    assert_eq!(
        parts[arm["joint"]["parent"].as_u64().expect("a parent") as usize]["link"],
        "base"
    );
    assert_eq!(arm["hulls"][0], data["links"][1]["parts"][0]["file"]);
}

#[test]
fn a_touch_is_seen_again_with_what_was_measured_predicted_and_felt() {
    let mut capture = capture();
    let mut run = run();
    let time: Vec<f64> = (0..500).map(|i| 5.0 + 0.01 * f64::from(i)).collect();
    let at = |t: &f64| Point3::new(0.01 * (t - 5.0), 0.0, 0.0);
    let stream = PoseStream {
        time: time.clone(),
        position: time.iter().map(at).collect(),
        rotation: vec![Some(Isometry3::identity().rotation); time.len()],
    };
    let still = PoseStream {
        position: vec![Point3::origin(); time.len()],
        ..stream.clone()
    };
    capture.interactions[0].force = Some(WrenchStream {
        time: time.clone(),
        force: vec![Vector3::new(2.0, 0.0, 0.0); time.len()],
        torque: None,
    });
    capture.interactions[0].tracks = BTreeMap::from([("base".into(), stream), ("arm".into(), still)]);
    let poses = time.iter().map(|t| Pose(Isometry3::translation(at(t).x, 1e-3, 0.0)));
    let path = Path {
        poses: poses.collect(),
        time,
    };
    run.traces[0].paths = BTreeMap::from([("base".into(), path)]);
    let data = scene_data(&render(&capture, &run).expect("a page"));
    let replay = &data["replays"][0];
    assert_eq!(replay["name"], "push");
    let measured = replay["measured"].as_object().expect("paths");
    assert_eq!(measured.len(), 1, "what stays is left out");
    assert_eq!(measured["base"]["lasts"], 4.99);
    assert_eq!(replay["predicted"]["base"]["low"][1], 1e-3);
    assert_eq!(replay["force"]["low"][0], 2.0);
}

#[test]
fn a_run_that_found_nothing_still_makes_a_page() {
    let mut run = run();
    run.model.twin.bodies.clear();
    run.model.twin.relations.clear();
    run.model.twin.support = None;
    run.traces.clear();
    run.segmented.clear();
    run.diagnosis.base = BaseFit::default();
    run.diagnosis.findings.clear();
    run.diagnosis.experiments.clear();
    let text = render(&capture(), &run).expect("a page");
    assert!(text.contains("Not judged") && text.contains("Nothing was compared"));
}

#[test]
fn the_verdict_says_what_it_does_not_rest_on() {
    assert!(!page().contains("could not be predicted"));
    let mut run = run();
    run.traces[1].held_out = true;
    let text = render(&capture(), &run).expect("a page");
    assert!(text.contains("1 of the 2 held-out touches could not be predicted and counts for nothing in this."));
}
