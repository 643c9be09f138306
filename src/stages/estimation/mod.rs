//! `identify`: mass, friction, centre of mass, inertia, stiffness from what was measured, with intervals.

mod accelerate;
mod action;
mod basins;
mod body;
mod calibrate;
mod chain;
mod chain_numbers;
mod chain_trial;
mod chain_write;
mod coast;
mod combine;
mod company;
mod config;
mod drag;
mod drive;
mod evidence;
mod face;
mod facts;
mod finger;
mod force_scale;
mod friction_force;
mod glide;
mod identify;
mod inertial;
mod joint;
mod joint_effort;
mod joint_law;
mod joint_led;
mod joint_load;
mod joint_matter;
mod lean;
mod lift;
mod loaded;
mod materials;
mod next_touch;
mod one_speed;
mod parting;
mod pool;
mod press;
mod push;
mod replay;
mod resolve;
mod rolling;
mod shake;
mod share;
mod shoved;
mod shoved_run;
mod slip;
mod slosh;
mod solid;
mod spin;
mod squeeze;
mod squeeze_profile;
mod standing;
mod sticking;
mod surface;
mod tilt;
mod together;
mod toss;
mod turning;
mod twist;
mod whole;

pub use action::{action_of, first_rest, rest_pose, start_poses, support_normal};
pub use calibrate::calibrate_friction;
pub use company::{Company, always_as_one, company};
pub use config::Config;
pub use force_scale::{ForceScale, calibrate_force};
pub use identify::identify;
pub use inertial::{Inertial, inertial};
pub use joint_led::leading_noise;
pub use joint_load::{JointLoad, joint_loads, joint_loads_by_tool};
pub use lift::{Hung, hung};
pub use materials::{MaterialFriction, material_friction, material_table, materials_from_toml};
pub use next_touch::{
    ArcTouch, NextTouch, NextTouchConfig, PushLine, TouchChoice, TouchDecision, Wanted, arc_touches, push_lines,
};
pub use replay::{replay_push, travel_direction, travel_of_track};
pub use rolling::{Rolled, rolled, tumbles};
pub use shake::{Shaken, shaken};
pub use slosh::{Sloshing, sloshing};
pub use tilt::{SlidDown, slid_down};
pub use toss::{
    Conditions, METHOD as TOSS_METHOD, Row as TossRow, Scene as TossScene, Simulated, Sought, Study, Subject, Toss,
    conditions_of, flight_of, flying as sought_of_flights, rigid as sought_of_tosses, subjects as tossed_subjects,
};
pub use turning::{Turned, turned};
