//! Images of messages as those of a capture.

use super::messages::{ImageMessage, Unread};
use crate::capture::{ColorImage, DepthImage};

/// Metres per count of a depth image, by the encoding of its messages.
///
/// `16UC1` counts millimetres (ROS REP 118); `32FC1` is in metres and is kept to a tenth of a millimetre.
pub(super) fn depth_unit(encoding: &str) -> Option<f64> {
    match encoding {
        "16UC1" | "mono16" => Some(1e-3),
        "32FC1" => Some(1e-4),
        _ => None,
    }
}

/// A range image in counts of [`depth_unit`]; what is not finite, not positive or too far for 16 bits is no reading.
pub(super) fn depth(image: &ImageMessage) -> Result<DepthImage, Unread> {
    let Some(unit) = depth_unit(&image.encoding) else {
        return Err((image.encoding.clone(), "a depth image in 16UC1 or 32FC1"));
    };
    let big = image.is_bigendian != 0;
    let metres = |b: [u8; 4]| {
        f64::from(if big {
            f32::from_be_bytes(b)
        } else {
            f32::from_le_bytes(b)
        })
    };
    let counted = |metres: f64| {
        let counts = (metres / unit).round();
        let told = counts.is_finite() && (1.0..=f64::from(u16::MAX)).contains(&counts);
        if told { counts as u16 } else { 0 }
    };
    let counts = if image.encoding == "32FC1" {
        let pixels = pixels::<4>(image)?;
        pixels.into_iter().map(|b| counted(metres(b))).collect()
    } else {
        let count = |b: [u8; 2]| {
            if big {
                u16::from_be_bytes(b)
            } else {
                u16::from_le_bytes(b)
            }
        };
        pixels::<2>(image)?.into_iter().map(count).collect()
    };
    Ok(DepthImage {
        width: image.width,
        height: image.height,
        counts,
    })
}

/// A colour image.
pub(super) fn color(image: &ImageMessage) -> Result<ColorImage, Unread> {
    let rgb = match image.encoding.as_str() {
        "rgb8" => pixels::<3>(image)?,
        "bgr8" => pixels::<3>(image)?.into_iter().map(|[b, g, r]| [r, g, b]).collect(),
        "rgba8" => pixels::<4>(image)?.into_iter().map(|[r, g, b, _]| [r, g, b]).collect(),
        "bgra8" => pixels::<4>(image)?.into_iter().map(|[b, g, r, _]| [r, g, b]).collect(),
        "mono8" => pixels::<1>(image)?.into_iter().map(|[v]| [v; 3]).collect(),
        other => return Err((other.to_owned(), "a colour image in rgb8, bgr8, rgba8, bgra8 or mono8")),
    };
    Ok(ColorImage {
        width: image.width,
        height: image.height,
        rgb,
    })
}

/// The pixels of `N` bytes each, row by row; rows may be padded.
fn pixels<const N: usize>(image: &ImageMessage) -> Result<Vec<[u8; N]>, Unread> {
    let (wide, step) = (image.width as usize * N, image.step as usize);
    if step < wide || image.data.len() < step * image.height as usize {
        let found = format!("{} bytes, {} a row", image.data.len(), image.step);
        return Err((found, "as many bytes as its size needs"));
    }
    let rows = image.data.chunks(step.max(1)).take(image.height as usize);
    let pixels = rows.flat_map(|row| row[..wide].as_chunks::<N>().0.iter().copied());
    Ok(pixels.collect())
}
