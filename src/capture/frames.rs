//! Images taken during an interaction: their index is read and checked at once, the images when asked for.

use super::folder::{Folder, Reference, Seen};
use super::images::{Wanted, check_file_header, read_color, read_depth};
use super::json::FramesJson;
use super::streams::{pose_of, read_poses};
use super::table::Table;
use super::{Capture, ColorImage, DepthImage, Frames};
use crate::base::{Error, Result, read_bytes};

const HEADERS: [&str; 4] = [
    "time,depth",
    "time,depth,color",
    "time,depth,x,y,z,qx,qy,qz,qw",
    "time,depth,color,x,y,z,qx,qy,qz,qw",
];

/// Reads the index of `frames` and checks that every image is there with the right kind and size.
pub(super) fn read_frames(
    folder: &Folder,
    place: &str,
    frames: &FramesJson,
    camera: usize,
    (width, height): (u32, u32),
    seen: &mut Seen,
) -> Result<Frames> {
    let (index, bytes) = folder.bytes(&folder.key(format!("{place}.index"), &frames.index), seen)?;
    let table = Table::parse(&index, &bytes, &HEADERS)?;
    let moving = table.column("x").is_some();
    if moving == frames.pose.is_some() {
        let found = if moving {
            "a pose, and pose columns in the index"
        } else {
            "neither a pose nor pose columns in the index"
        };
        let expected = "one of them: a pose where the camera stands still, columns where it moves";
        return Err(Error::bad_input(&folder.json, format!("{place}.pose"), found, expected));
    }
    let mut out = Frames {
        camera,
        world_from_camera: None,
        time: table.times()?,
        depth: Vec::new(),
        color: Vec::new(),
        poses: if moving { Some(read_poses(&table, false)?) } else { None },
        taken: Vec::new(),
    };
    if let Some(seven) = frames.pose {
        out.world_from_camera = Some(pose_of(&folder.json, &format!("{place}.pose"), seven)?);
    }
    for row in 0..table.len() {
        let image = |column: usize, grey16: bool, seen: &mut Seen| {
            let place = format!("row {}, column {}", row + 1, table.columns[column]);
            let path = folder.file(&Reference {
                file: &index,
                place,
                relative: table.text(row, column),
            })?;
            let head = check_file_header(&path, Wanted { grey16, width, height })?;
            seen.add(table.text(row, column), &head);
            Ok::<_, Error>(path)
        };
        out.depth.push(image(1, true, seen)?);
        let color = table.column("color").filter(|c| !table.text(row, *c).is_empty());
        out.color.push(color.map(|c| image(c, false, seen)).transpose()?);
    }
    Ok(out)
}

/// Loads image `i` of `frames`: depth, and colour where there is one.
///
/// # Errors
/// [`Error::Usage`] where there is no such image, [`Error::BadInput`] where the file is damaged.
pub fn read_frame(capture: &Capture, frames: &Frames, i: usize) -> Result<(DepthImage, Option<ColorImage>)> {
    if let Some(image) = frames.taken.get(i) {
        return Ok(image.clone());
    }
    let (Some(depth), Some(camera)) = (frames.depth.get(i), capture.cameras.get(frames.camera)) else {
        return Err(Error::Usage(format!(
            "there are {} frames, and no frame {i}",
            frames.depth.len()
        )));
    };
    let image = read_depth(depth, &read_bytes(depth)?, camera.width, camera.height)?;
    let mut color = None;
    if let Some(path) = frames.color.get(i).and_then(Option::as_ref) {
        color = Some(read_color(path, &read_bytes(path)?, camera.width, camera.height)?);
    }
    Ok((image, color))
}
