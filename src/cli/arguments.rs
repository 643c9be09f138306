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
        after_help = "Example:\n  palpate synth scene.toml --out capture\n  palpate synth lab:hinge --out capture\n  palpate synth lab:probe-pushes --hide random --seed 5 --out blind"
    )]
    Synth {
        /// A scene file, or lab:NAME for one that is built in (see --list)
        #[arg(required_unless_present = "list")]
        scene: Option<String>,
        /// Where the capture goes
        #[arg(long, required_unless_present = "list")]
        out: Option<PathBuf>,
        /// Hide an effect that a plain model lacks: CAUSE or CAUSE:STRENGTH (several with commas, each once; a wrong one lists all
        /// that the scene can hide; strength 1 is plain, 16 the most), random (nothing, one or two causes), random:STRENGTH (one
        /// cause), or none; the truth file alone tells it
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
        /// File that keeps the search of snapshot pairs: taken up where it was put down, written after every evaluation
        #[arg(long)]
        snapshot_search: Option<PathBuf>,
        /// Evaluations of the search of snapshot pairs
        #[arg(long)]
        snapshot_evaluations: Option<usize>,
        /// The scale of the force sensor as `palpate calibrate force` found it: forces are divided by it, its doubt counts
        #[arg(long)]
        force_scale: Option<PathBuf>,
        /// Friction by pair of materials as `palpate calibrate friction` wrote it (may be given more than once): comes
        /// before the built-in table
        #[arg(long)]
        materials: Vec<PathBuf>,
        /// Also write recording.rrd, the run as a recording for the Rerun viewer (needs a palpate built with the
        /// feature `rerun`)
        #[arg(long)]
        rerun: bool,
        /// Write the seconds of each pass into the twin (it then differs from run to run)
        #[arg(long)]
        timings: bool,
    },
    /// Reconstruct many captures on all cores, each into a folder of its own; twins that are there already are kept
    #[command(after_help = "Example:\n  palpate batch captures/* --out twins")]
    Batch {
        /// The captures' folders
        #[arg(required = true)]
        captures: Vec<PathBuf>,
        /// Where the twins go, each in a folder called as the capture's
        #[arg(long)]
        out: PathBuf,
        /// Edge of a voxel of the shape pass, m
        #[arg(long, default_value_t = 0.002)]
        voxel: f64,
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
    /// Load every export of a twin again, and in the embedded engine, and say what differs; with --engines also play the
    /// capture's pushes and pulls in engines and say how far each is from what was measured
    #[command(
        after_help = "Example:\n  palpate check twin\n  palpate check twin --engines rapier,mujoco,pybullet,drake --capture \
                      capture\n\nAll engines but rapier run in Python: python3, or the one that PALPATE_PYTHON names."
    )]
    Check {
        /// The twin's folder
        twin: PathBuf,
        /// rapier, mujoco, pybullet, drake: one or more, with commas
        #[arg(long, value_delimiter = ',')]
        engines: Vec<String>,
        /// The capture that the twin was made of (default: looked for beside the twin, by its digest)
        #[arg(long, requires = "engines")]
        capture: Option<PathBuf>,
    },
    /// Write a twin in other formats, beside its twin.json
    #[command(
        after_help = "Example:\n  palpate export twin --to sdf,usd\n  palpate export twin --to mjcf --variants 100 --seed 7"
    )]
    Export {
        /// The twin's folder
        twin: PathBuf,
        /// urdf, mjcf, gltf, sdf, usd: one or more, with commas
        #[arg(long, value_delimiter = ',', required = true)]
        to: Vec<String>,
        /// Instead of the twin itself, this many models drawn from what it knows, in TWIN/variants/000, …
        #[arg(long, value_parser = clap::value_parser!(u32).range(1..=999))]
        variants: Option<u32>,
    },
    /// Turn somebody else's model into a twin, or their recording into a capture
    #[command(
        after_help = "Example:\n  palpate import twin cupboard.urdf --out cupboard\n  palpate diagnose capture --model cupboard"
    )]
    Import {
        /// What to import
        #[command(subcommand)]
        what: Import,
    },
    /// Take, push or open something of a twin in the embedded engine: what comes along?
    #[command(
        after_help = "Example:\n  palpate simulate twin --do pick:tin\n  palpate simulate twin --do push:tin,-x,0.05\n  palpate simulate twin --do open:door --film door.glb\n  palpate simulate twin --do pick:tin --film pictures"
    )]
    Simulate {
        /// The twin's folder
        twin: PathBuf,
        /// pick:BODY, push:BODY,DIRECTION,SPEED (x, -x, y, -y or degrees; m/s, may be left out) or open:JOINT,SPEED
        #[arg(long = "do", value_name = "DEED", allow_hyphen_values = true)]
        deed: String,
        /// Also show what happens: FILE.glb is an animation, a name without an ending a folder of PNG pictures
        #[arg(long, value_name = "FILE.glb|FOLDER")]
        film: Option<PathBuf>,
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
    /// The noise of a range camera from views of a bare, still table: floor, growth with the range, stray of the rays
    Camera {
        /// The folder of a capture with three views or more of a plane, from several distances and angles
        capture: PathBuf,
        /// Where the noise goes (default: standard output); its `depth_sd` belongs into the camera of a capture
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

/// What can be imported.
#[derive(Debug, Subcommand)]
pub enum Import {
    /// A URDF, or a mesh as one rigid body, as a twin: known geometry, or a model to be diagnosed
    #[command(after_help = "Example:\n  palpate import twin cupboard.urdf --out cupboard")]
    Twin {
        /// .urdf, .obj, .stl, .ply, .glb or .gltf; m, kg, z up
        file: PathBuf,
        /// Where the twin goes
        #[arg(long)]
        out: PathBuf,
        /// The numbers were weighed or are from a drawing; without this they are taken for assumed
        #[arg(long)]
        known: bool,
    },
    /// Trajectories of the TUM RGB-D benchmark as tracks, each of the thing that the file is named after
    #[command(after_help = "Example:\n  palpate import tum door.txt frame.txt --out capture")]
    Tum {
        /// time x y z qx qy qz qw a line
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Where the capture goes
        #[arg(long)]
        out: PathBuf,
    },
    /// An MCAP file of a robot (ROS 2 messages in CDR; poses, transforms, wrenches and cameras also in JSON)
    #[command(
        after_help = "Example:\n  palpate import mcap push.mcap --out capture     # lists the topics\n  palpate import mcap push.mcap --out capture --world base_link --kind push --track box=/mocap/box --tool tf:fingertip --tool-radius 0.006 --force /wrist/wrench\n  palpate import mcap scan.mcap --out capture --still --depth /camera/depth/image_rect --camera-info /camera/depth/camera_info\n\nA PLACE is a topic of poses, or tf:FRAME for a frame of /tf and /tf_static."
    )]
    Mcap {
        /// The recording
        source: PathBuf,
        /// Where the capture goes
        #[arg(long)]
        out: PathBuf,
        /// What to take
        #[command(flatten)]
        options: Box<McapOptions>,
    },
    /// A scene folder of the BOP benchmark: its images, the shapes and poses of its things as known
    #[command(after_help = "Example:\n  palpate import bop ycbv/test/000048 --out capture")]
    Bop {
        /// The scene's folder, with scene_camera.json
        source: PathBuf,
        /// Where the capture goes
        #[arg(long)]
        out: PathBuf,
        /// The folder of the models (default: `models` of the data set)
        #[arg(long)]
        models: Option<PathBuf>,
        /// The thing whose frame becomes the world, where the scene does not say where its cameras stood
        #[arg(long, value_name = "ID")]
        world_object: Option<u32>,
        /// Things move between the images: one recording with a track of each instead of views
        #[arg(long)]
        moving: bool,
        /// Images per second of such a recording; the format has no times
        #[arg(long, default_value_t = 30.0)]
        rate: f64,
    },
}

/// What to take from an MCAP file.
#[derive(Clone, Debug, Args)]
pub struct McapOptions {
    /// Topic of range images (sensor_msgs/Image in 16UC1 or 32FC1)
    #[arg(long, value_name = "TOPIC")]
    pub depth: Option<String>,
    /// Topic of colour images in register with them
    #[arg(long, value_name = "TOPIC")]
    pub color: Option<String>,
    /// Topic of the lens of the range camera
    #[arg(long, value_name = "TOPIC")]
    pub camera_info: Option<String>,
    /// Where its optical frame was (default: the frame that its lens names)
    #[arg(long, value_name = "PLACE")]
    pub camera: Option<String>,
    /// A thing that was tracked, and where it was; may be given again
    #[arg(long = "track", value_name = "NAME=PLACE")]
    pub tracks: Vec<String>,
    /// Where the tool was
    #[arg(long, value_name = "PLACE")]
    pub tool: Option<String>,
    /// The tool is a ball of this radius, m
    #[arg(long, value_name = "METRES")]
    pub tool_radius: Option<f64>,
    /// Topic of wrenches: what the tool exerts on the thing
    #[arg(long, value_name = "TOPIC")]
    pub force: Option<String>,
    /// The wrenches are what the thing exerts on the tool
    #[arg(long, requires = "force")]
    pub reaction: bool,
    /// The frame that becomes the world, z up
    #[arg(long, value_name = "FRAME", default_value = "world")]
    pub world: String,
    /// What was done: push, pull, press, lift, tilt, toss or hold (default)
    #[arg(long)]
    pub kind: Option<String>,
    /// What the tool means to touch
    #[arg(long, value_name = "NAME")]
    pub target: Option<String>,
    /// The images show a scene that stands still: they become views
    #[arg(long)]
    pub still: bool,
    /// Of the range images, keep every one in so many
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub every: usize,
}
