//! The tool: driven without regard to force; it touches from outside (it can only push), or holds one body.

use nalgebra::Vector3;

use super::body::{Frame, RigidBody, Wrench};
use super::distance::{Piece, nearest, reach, support_radius};
use super::footprint::{Foot, shell};
use super::friction::{Bristle, DryFriction};
use super::patch::{Patch, Spring};
use super::weld::{Weld, WeldSpring, stiff};
use crate::lab::hidden::{Act, Effect, ElasticLaw, Occasion, Setting};
use crate::lab::{FoamSpec, PartShape};

/// Stiffness of a touch, N/m.
const TOUCH: f64 = 2e4;
/// Stiffness of a grip, N/m and N·m/rad.
const GRIP: (f64, f64) = (1e5, 200.0);

/// A touched body of the world with its pieces.
pub(crate) struct Touched<'a> {
    pub index: usize,
    pub body: &'a RigidBody,
    pub pieces: Vec<Piece>,
    pub shell: Vec<(Foot, f64)>,
    pub foam: Option<FoamSpec>,
}

/// What a tool does to the bodies of a world.
#[derive(Clone, Debug)]
pub(crate) enum Hand {
    /// From outside.
    Touch {
        patches: Vec<TouchPatch>,
        cushions: Vec<Cushion>,
    },
    /// Holding a body; before and after that, nothing.
    Hold {
        body: usize,
        pin: bool,
        /// Force into the table, N.
        down: f64,
        weld: Option<Weld>,
    },
}

/// Contact of the tool with one piece of one body.
#[derive(Clone, Debug)]
pub(crate) struct TouchPatch {
    body: usize,
    patch: Patch,
    by_tool: bool,
}

/// Contact with a springy body: the tool sinks in as into a bed, as deep as its foremost point lies below the face.
#[derive(Clone, Debug)]
pub(crate) struct Cushion {
    body: usize,
    pieces: Vec<Piece>,
    tool: PartShape,
    foam: FoamSpec,
    law: DryFriction,
    bristle: Bristle,
    hidden: Vec<ElasticLaw>,
}

impl Hand {
    /// Hides effects in what it presses, and in its tip.
    pub fn hide(&mut self, effects: &[Effect], occasion: &Occasion) {
        let Hand::Touch { patches, cushions } = self else {
            return;
        };
        for effect in effects {
            if let Act::Setting(Setting::Tip(pad)) = effect.act {
                patches.iter_mut().for_each(|touch| touch.patch.tip_with(pad));
            }
            if let Act::Elastic(law) = &effect.act {
                let mut law = law.clone();
                law.begin(occasion.start, occasion.deepest);
                cushions.iter_mut().for_each(|cushion| cushion.hidden.push(law.clone()));
            }
        }
    }

    /// A tool of this shape against all these bodies.
    pub fn touching(shape: &PartShape, friction: f64, touched: Vec<Touched>) -> Self {
        let law = DryFriction::new(friction, friction);
        let (mut patches, mut cushions) = (Vec::new(), Vec::new());
        for thing in touched {
            if let Some(foam) = thing.foam {
                cushions.push(Cushion {
                    body: thing.index,
                    pieces: thing.pieces,
                    tool: shape.clone(),
                    foam,
                    law,
                    bristle: Bristle::default(),
                    hidden: Vec::new(),
                });
            } else {
                patches.extend(patches_against(shape, law, &thing));
            }
        }
        Hand::Touch { patches, cushions }
    }

    /// Takes hold, as things are.
    pub fn grasp(&mut self, tool: &Frame, bodies: &[RigidBody]) {
        if let Hand::Hold { body, pin, weld, .. } = self {
            let held = &bodies[*body];
            let linear = stiff(GRIP.0, held.compliance_at(&tool.position));
            let angular = if *pin {
                (0.0, 0.0)
            } else {
                stiff(GRIP.1, held.angular_compliance())
            };
            *weld = Some(Weld::new(
                tool,
                &held.frame,
                &tool.position,
                WeldSpring { linear, angular },
            ));
        }
    }

    /// Lets go.
    pub fn release(&mut self) {
        if let Hand::Hold { weld, .. } = self {
            *weld = None;
        }
    }

    /// How far it is from touching anything, m; infinite for a hand that holds or is to hold.
    pub fn clearance(&self, tool: &Frame, bodies: &[RigidBody]) -> f64 {
        let Hand::Touch { patches, cushions } = self else {
            return f64::INFINITY;
        };
        let patches = patches.iter().map(|touch| {
            let body = &bodies[touch.body].frame;
            let (owner, other) = if touch.by_tool { (tool, body) } else { (body, tool) };
            -touch.patch.deepest(owner, other).0
        });
        let cushions = cushions.iter().map(|cushion| {
            let sunk = cushion.sunk(tool, &bodies[cushion.body].frame);
            sunk.map_or(f64::INFINITY, |(depth, ..)| -depth)
        });
        patches.chain(cushions).fold(f64::INFINITY, f64::min)
    }

    /// Whether it has hold of something.
    pub fn holds(&self) -> bool {
        matches!(self, Hand::Hold { weld: Some(_), .. })
    }

    /// Adds its wrench to the bodies and gives what it exerts on them, all together.
    pub fn act(&mut self, tool: &Frame, bodies: &mut [RigidBody], dt: f64) -> Wrench {
        let mut total = Wrench::zero();
        match self {
            Hand::Touch { patches, cushions } => {
                for touch in patches {
                    let wrench = touch.act(tool, &bodies[touch.body].frame, dt);
                    bodies[touch.body].wrench.add(&wrench, 1.0);
                    total.add(&wrench, 1.0);
                }
                for cushion in cushions {
                    let wrench = cushion.act(tool, &bodies[cushion.body].frame, dt);
                    bodies[cushion.body].wrench.add(&wrench, 1.0);
                    total.add(&wrench, 1.0);
                }
            }
            Hand::Hold { body, down, weld, .. } => {
                if let Some(weld) = weld {
                    let (wrench, _) = weld.act(tool, &bodies[*body].frame);
                    bodies[*body].wrench.add(&wrench, 1.0);
                    total = wrench;
                    let mut pressing = Wrench::zero();
                    pressing.push(&tool.position, Vector3::z() * -*down);
                    bodies[*body].wrench.add(&pressing, 1.0);
                    total.add(&pressing, 1.0);
                }
            }
        }
        total
    }
}

fn patches_against(shape: &PartShape, law: DryFriction, thing: &Touched) -> Vec<TouchPatch> {
    let ball = matches!(shape, PartShape::Sphere { .. });
    let weight = if ball { 1.0 } else { 0.5 };
    let spring = Spring::blow(TOUCH, thing.body.mass);
    let feet: Vec<(Foot, f64)> = shell(shape)
        .into_iter()
        .map(|(at, radius)| (Foot::Ball { at, radius }, weight))
        .collect();
    let mut patches: Vec<TouchPatch> = thing
        .pieces
        .iter()
        .map(|piece| TouchPatch {
            body: thing.index,
            patch: Patch::new(&feet, reach(shape), piece.clone(), spring, law),
            by_tool: true,
        })
        .collect();
    if !ball {
        let feet: Vec<(Foot, f64)> = thing.shell.iter().map(|(foot, _)| (foot.clone(), weight)).collect();
        patches.push(TouchPatch {
            body: thing.index,
            patch: Patch::new(&feet, thing.body.reach, Piece::alone(shape.clone()), spring, law),
            by_tool: false,
        });
    }
    patches
}

impl TouchPatch {
    /// The wrench on the body.
    fn act(&mut self, tool: &Frame, body: &Frame, dt: f64) -> Wrench {
        if !self.by_tool {
            return self.patch.act(body, tool, dt);
        }
        let mut wrench = Wrench::zero();
        wrench.add(&self.patch.act(tool, body, dt), -1.0);
        wrench
    }
}

impl Cushion {
    fn act(&mut self, tool: &Frame, body: &Frame, dt: f64) -> Wrench {
        let mut wrench = Wrench::zero();
        let pulls = self.hidden.iter().any(ElasticLaw::pulls);
        let Some((depth, normal, at)) = self.sunk(tool, body).filter(|(depth, ..)| *depth > 0.0 || pulls) else {
            self.bristle.release();
            return wrench;
        };
        let velocity = body.velocity_at(&at) - tool.velocity_at(&at);
        let (sinking, k) = (normal.dot(&velocity), self.foam.stiffness);
        let (mut pushed, mut pulled) = (0.0, 0.0);
        for law in &mut self.hidden {
            let force = law.force(depth, sinking, k, dt);
            *(if law.pulls() { &mut pulled } else { &mut pushed }) += force;
        }
        if depth <= 0.0 {
            self.bristle.release();
            wrench.push(&at, normal * -pulled);
            return wrench;
        }
        let size = (k * depth + self.foam.damping * sinking + pushed).max(0.0) + pulled;
        let friction = self.bristle.advance(&self.law, &normal, &velocity, dt);
        wrench.push(&at, (friction - normal) * size);
        wrench
    }

    /// Depth, outward normal of the body and the foremost point of the tool, of the deepest piece.
    fn sunk(&self, tool: &Frame, body: &Frame) -> Option<(f64, Vector3<f64>, Vector3<f64>)> {
        let mut best: Option<(f64, Vector3<f64>, Vector3<f64>)> = None;
        for piece in &self.pieces {
            let (origin, axes) = piece.placed(body);
            let centre = axes.tr_mul(&(tool.position - origin));
            let found = nearest(&piece.shape, &centre, &centre);
            let normal = axes * found.normal;
            let ahead = support_radius(&self.tool, &tool.matrix.tr_mul(&normal));
            let depth = ahead - found.distance;
            if best.as_ref().is_none_or(|(deepest, ..)| depth > *deepest) {
                best = Some((depth, normal, tool.position - normal * ahead));
            }
        }
        best
    }
}
