//! The cameras: where each stood, and what it saw.

use re_sdk_types::archetypes::{DepthImage, EncodedImage, Pinhole, SegmentationImage, Transform3D};
use re_sdk_types::components::{ImageFormat, MediaType, ViewCoordinates};
use re_sdk_types::datatypes::ChannelDatatype;

use super::clock::{Moment, Span, view_moment};
use super::scene::{HIDDEN, pose};
use super::stream::Stream;
use crate::base::{Pose, Result};
use crate::capture::{Camera, Capture, ColorImage, DepthImage as Depth, LabelImage, color_png, read_frame};

/// How far off its origin a camera's picture is drawn, m.
const PLANE: f32 = 0.1;

/// The lenses, the still views, then the images taken during touches.
pub(super) fn log(stream: &mut Stream, capture: &Capture, spans: &[Option<Span>]) -> Result<()> {
    for camera in &capture.cameras {
        stream.still(&["world", "cameras", &camera.name], &lens(camera))?;
    }
    for (i, view) in capture.views.iter().enumerate() {
        let Some(camera) = capture.cameras.get(view.camera) else {
            continue;
        };
        let moment = view_moment(i, view.time);
        let seen = (&view.depth, view.color.as_ref(), view.labels.as_ref());
        picture(stream, camera, moment, Some(&view.world_from_camera), seen)?;
    }
    for (interaction, span) in capture.interactions.iter().zip(spans) {
        let (Some(frames), Some(span)) = (&interaction.frames, span) else {
            continue;
        };
        let Some(camera) = capture.cameras.get(frames.camera) else {
            continue;
        };
        for (i, time) in frames.time.iter().enumerate() {
            let (depth, color) = read_frame(capture, frames, i)?;
            let at = frames.pose(i);
            picture(
                stream,
                camera,
                span.at(*time),
                at.as_ref(),
                (&depth, color.as_ref(), None),
            )?;
        }
    }
    Ok(())
}

/// The camera without its distortion, which the viewer does not draw. palpate counts pixels from the centre of the first,
/// the viewer from its corner.
fn lens(camera: &Camera) -> Pinhole {
    let [fx, fy] = [camera.fx as f32, camera.fy as f32];
    let [cx, cy] = [(camera.cx + 0.5) as f32, (camera.cy + 0.5) as f32];
    Pinhole::new([[fx, 0.0, 0.0], [0.0, fy, 0.0], [cx, cy, 1.0]])
        .with_resolution([camera.width as f32, camera.height as f32])
        .with_camera_xyz(ViewCoordinates::RDF)
        .with_image_plane_distance(PLANE)
}

fn picture(
    stream: &mut Stream,
    camera: &Camera,
    moment: Moment,
    world_from_camera: Option<&Pose>,
    (depth, color, labels): (&Depth, Option<&ColorImage>, Option<&LabelImage>),
) -> Result<()> {
    // A frame whose pose is not known is shown as a picture, and in no place.
    let transform = world_from_camera.map_or_else(
        || Transform3D::update_fields().with_scale(HIDDEN),
        |p| pose(p).with_scale(1.0_f32),
    );
    stream.at(&["world", "cameras", &camera.name], moment, &transform)?;
    let counts = DepthImage::from_gray16(little_endian(&depth.counts), [depth.width, depth.height])
        .with_meter((1.0 / camera.depth_unit) as f32);
    stream.at(&["world", "cameras", &camera.name, "depth"], moment, &counts)?;
    if let Some(color) = color {
        let png = EncodedImage::new(color_png(color)?).with_media_type(MediaType::png());
        stream.at(&["world", "cameras", &camera.name, "color"], moment, &png)?;
    }
    if let Some(labels) = labels {
        let ids = SegmentationImage::new(
            little_endian(&labels.ids),
            ImageFormat::segmentation([labels.width, labels.height], ChannelDatatype::U16),
        );
        stream.at(&["world", "cameras", &camera.name, "labels"], moment, &ids)?;
    }
    Ok(())
}

fn little_endian(counts: &[u16]) -> Vec<u8> {
    counts.iter().flat_map(|c| c.to_le_bytes()).collect()
}
