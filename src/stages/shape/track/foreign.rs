//! What an image shows that is no body: the table, and the tool of the interaction.

use nalgebra::{Isometry3, Point3, Vector3};

use super::picture::Pixel;
use crate::capture::{Interaction, ToolShape};
use crate::geometry::parse_mesh;
use crate::twin::SupportPlane;

/// Readings nearer to the tool than this belong to it, m.
const TOOL_SKIN: f64 = 0.004;
/// Readings nearer to the table than this, and as level as it, belong to it, m.
const TABLE_SKIN: f64 = 0.003;

/// The tool at one moment, and the table.
pub struct Foreign {
    table: Option<(Point3<f64>, Vector3<f64>)>,
    tool: Option<(Isometry3<f64>, ToolForm)>,
}

#[derive(Clone, Copy)]
enum ToolForm {
    Ball(f64),
    Block(Point3<f64>, Vector3<f64>),
    Rod(f64, f64),
}

impl Foreign {
    /// As things stand at `time` of an interaction.
    pub fn at(interaction: &Interaction, support: Option<&SupportPlane>, time: f64) -> Self {
        let form = interaction.tool.as_ref().and_then(|t| form_of(&t.shape));
        let pose = interaction.tool_path.as_ref().and_then(|path| path.sample(time));
        Self {
            table: support.map(|s| (Point3::from(s.point), Vector3::from(s.normal))),
            tool: form
                .zip(pose)
                .map(|(form, (p, q))| (Isometry3::from_parts(p.into(), q.unwrap_or_default()), form)),
        }
    }

    /// Whether a reading belongs to the table.
    pub fn on_table(&self, pixel: &Pixel) -> bool {
        self.table.is_some_and(|(point, normal)| {
            (pixel.point - point).dot(&normal) < TABLE_SKIN.max(3.0 * pixel.sd) && pixel.normal.dot(&normal) > 0.9
        })
    }

    /// Whether a point is on the tool.
    pub fn on_tool(&self, point: &Point3<f64>) -> bool {
        self.tool.as_ref().is_some_and(|(world_from_tool, form)| {
            let p = world_from_tool.inverse_transform_point(point);
            let distance = match *form {
                ToolForm::Ball(radius) => p.coords.norm() - radius,
                ToolForm::Block(center, half) => ((p - center).abs() - half).sup(&Vector3::zeros()).norm(),
                ToolForm::Rod(radius, half) => (p.coords.xy().norm() - radius).max(p.z.abs() - half),
            };
            distance < TOOL_SKIN
        })
    }
}

fn form_of(shape: &ToolShape) -> Option<ToolForm> {
    Some(match shape {
        ToolShape::Sphere { radius } => ToolForm::Ball(*radius),
        ToolShape::Box { half } => ToolForm::Block(Point3::origin(), *half),
        ToolShape::Cylinder { radius, half_height } => ToolForm::Rod(*radius, *half_height),
        ToolShape::Mesh(file) => {
            let (low, high) = parse_mesh(&file.path, &file.bytes).ok()?.bounds()?;
            ToolForm::Block(nalgebra::center(&low, &high), 0.5 * (high - low))
        }
    })
}
