//! The command line as data.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Looks at a tabletop, touches it, and hands back a simulator model that tells the truth.
#[derive(Debug, Parser)]
#[command(name = "palpate", version, propagate_version = true, disable_help_subcommand = true)]
pub struct Arguments {
    /// What all commands share.
    #[command(flatten)]
    pub common: Common,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command.
#[derive(Clone, Debug, Args)]
pub struct Common {
    /// Say only what goes wrong
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Say every doubt that came up
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Print the result as one JSON object
    #[arg(long, global = true)]
    pub json: bool,
    /// Seed of everything in which chance plays a part
    #[arg(long, global = true, default_value_t = 0)]
    pub seed: u64,
    /// Threads to use (0: as many as there are cores); the result does not depend on it
    #[arg(long, global = true, default_value_t = 0)]
    pub threads: usize,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make a capture of a tabletop in the built-in lab, reconstruct it, and compare with the truth
    #[command(after_help = "Example:\n  palpate demo --out models_out/demo")]
    Demo {
        /// Where the capture and the twin go
        #[arg(long, default_value = "models_out/demo")]
        out: PathBuf,
    },
    /// Make a synthetic capture from a scene of the built-in lab, with the truth beside it
    #[command(
        after_help = "Example:\n  palpate synth scene.toml --out capture\n  palpate synth lab:hinge --out capture\n  palpate synth lab:probe-pushes --hide random --seed 7 --out blind"
    )]
    Synth {
        /// A scene file, or lab:NAME for one that is built in (see --list)
        #[arg(required_unless_present = "list")]
        scene: Option<String>,
        /// Where the capture goes
        #[arg(long, required_unless_present = "list")]
        out: Option<PathBuf>,
        /// Hide an effect that a plain model lacks: CAUSE or CAUSE:STRENGTH (several with commas; a wrong one lists all that
        /// the scene can hide), random, or none; the truth file alone tells it
        #[arg(long)]
        hide: Option<String>,
        /// List the built-in scenes
        #[arg(long)]
        list: bool,
    },
    /// Turn a capture into a twin: estimates with intervals, URDF, MJCF, glTF and a report
    #[command(after_help = "Example:\n  palpate reconstruct capture --out twin")]
    Reconstruct {
        /// The capture's folder
        capture: PathBuf,
        /// Where the twin goes
        #[arg(long)]
        out: PathBuf,
        /// Run only this pass (shape, symmetry, physics, relations, articulation, diagnosis, export, report)
        #[arg(long = "pass")]
        passes: Vec<String>,
        /// Do nothing where the twin in --out was made from the same capture with the same options
        #[arg(long)]
        resume: bool,
        /// Edge of a voxel of the shape pass, m
        #[arg(long, default_value_t = 0.002)]
        voxel: f64,
        /// What was learnt of other things by `palpate calibrate snapshots`: a new thing starts from it
        #[arg(long)]
        snapshot_prior: Option<PathBuf>,
        /// The scale of the force sensor as `palpate calibrate force` found it: forces are divided by it, its doubt counts
        #[arg(long)]
        force_scale: Option<PathBuf>,
        /// Write the seconds of each pass into the twin (it then differs from run to run)
        #[arg(long)]
        timings: bool,
    },
    /// Say what a model gets wrong of a capture, why, by how much, and what would decide; writes nothing
    #[command(
        after_help = "Example:\n  palpate diagnose capture\n  palpate diagnose capture --model twin --causes support-tilt,viscous-friction"
    )]
    Diagnose {
        /// The capture's folder
        capture: PathBuf,
        /// The folder of a twin to diagnose (default: a fresh fit)
        #[arg(long)]
        model: Option<PathBuf>,
        /// The only causes that may be named, with commas (default: all)
        #[arg(long, value_delimiter = ',')]
        causes: Vec<String>,
    },
    /// Choose views and touches by itself, with the lab or a robot, until nothing more is worth its while; then
    /// reconstruct what was gathered
    #[command(
        after_help = "Example:\n  palpate explore --rig lab:scene.toml --out explored\n  palpate explore --rig 'exec:python3 \
                      examples/rig.py' --out explored\n\nThe rig protocol is told in docs/rig-protocol.md."
    )]
    Explore {
        /// lab:SCENE.toml (or lab:NAME for a scene that is built in), or exec:COMMAND for a rig that answers on its
        /// standard output
        #[arg(long)]
        rig: String,
        /// Where the capture, the twin and explore.json go
        #[arg(long)]
        out: PathBuf,
        /// Most views and touches together
        #[arg(long, default_value_t = 40)]
        budget: usize,
    },
    /// Say what is in a capture, and what is missing for which estimate
    #[command(after_help = "Example:\n  palpate inspect capture")]
    Inspect {
        /// The capture's folder
        capture: PathBuf,
    },
    /// Print the JSON Schema of a file format
    #[command(after_help = "Example:\n  palpate schema twin > twin.schema.json")]
    Schema {
        /// capture, twin, diagnosis or truth
        format: String,
    },
    /// Compare a twin with the truth
    #[command(after_help = "Example:\n  palpate score twin --truth capture/truth.json")]
    Score {
        /// The twin's folder
        twin: PathBuf,
        /// The file with the right answers
        #[arg(long)]
        truth: PathBuf,
    },
    /// Load every export of a twin again, and in the embedded engine, and say what differs
    #[command(after_help = "Example:\n  palpate check twin")]
    Check {
        /// The twin's folder
        twin: PathBuf,
    },
    /// Write a twin in other formats, beside its twin.json
    #[command(after_help = "Example:\n  palpate export twin --to sdf,usd")]
    Export {
        /// The twin's folder
        twin: PathBuf,
        /// urdf, mjcf, gltf, sdf, usd: one or more, with commas
        #[arg(long, value_delimiter = ',', required = true)]
        to: Vec<String>,
    },
    /// Take, push or open something of a twin in the embedded engine: what comes along?
    #[command(
        after_help = "Example:\n  palpate simulate twin --do pick:tin\n  palpate simulate twin --do push:tin,-x,0.05\n  palpate simulate twin --do open:door"
    )]
    Simulate {
        /// The twin's folder
        twin: PathBuf,
        /// pick:BODY, push:BODY,DIRECTION,SPEED (x, -x, y, -y or degrees; m/s, may be left out) or open:JOINT,SPEED
        #[arg(long = "do", value_name = "DEED", allow_hyphen_values = true)]
        deed: String,
    },
    /// Serve the report of a twin on loopback and open it
    #[command(after_help = "Example:\n  palpate view twin")]
    View {
        /// The twin's folder
        twin: PathBuf,
        /// Port on 127.0.0.1 (0: any that is free)
        #[arg(long, default_value_t = 0)]
        port: u16,
        /// Do not open a browser
        #[arg(long)]
        no_open: bool,
    },
    /// Make entries of the calibration tables from measurements
    #[command(after_help = "Example:\n  palpate calibrate friction tilt-capture --out calibration/oak-on-felt.toml")]
    Calibrate {
        /// What to calibrate
        #[command(subcommand)]
        what: Calibration,
    },
}

/// What can be calibrated.
#[derive(Debug, Subcommand)]
pub enum Calibration {
    /// Static and kinetic friction from a series of tilts
    Friction {
        /// The folder of a capture with tilts
        capture: PathBuf,
        /// Where the entry goes (default: standard output)
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// The scale of the force sensor from lifts of known weights, for `palpate reconstruct --force-scale`
    Force {
        /// The folder of a capture with lifts of bodies whose `mass` it gives
        capture: PathBuf,
        /// Where the scale goes (default: standard output)
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// A prior by shape and material from captures of snapshot pairs, for `palpate reconstruct --snapshot-prior`
    Snapshots {
        /// The folders of the captures
        #[arg(required = true)]
        captures: Vec<PathBuf>,
        /// Where the prior goes (default: standard output)
        #[arg(long)]
        out: Option<PathBuf>,
    },
}
