//! Images as PNG: 16-bit grey depth and labels, 8-bit RGB colour. Any other kind is refused.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb};

use super::{ColorImage, DepthImage, LabelImage};
use crate::base::{Error, Result};

const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

/// What an image must be: its kind and the size of its camera.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// True for 16-bit greyscale, false for 8-bit RGB.
    pub grey16: bool,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Wanted {
    fn kind(&self) -> &'static str {
        if self.grey16 {
            "a 16-bit greyscale PNG"
        } else {
            "an 8-bit RGB PNG"
        }
    }
}

/// Checks the first bytes of a PNG (signature and IHDR; ISO/IEC 15948, 11.2.2) against what is wanted.
pub(super) fn check_header(path: &Path, head: &[u8], wanted: Wanted) -> Result<()> {
    let fault = |found: String, expected: String| Err(Error::bad_input(path, "image header", found, expected));
    if head.len() < 8 || head[..8] != SIGNATURE {
        return fault("no PNG signature".into(), wanted.kind().into());
    }
    let Some(ihdr) = head.get(16..26).filter(|_| &head[12..16] == b"IHDR") else {
        return fault("a PNG that ends inside its header".into(), wanted.kind().into());
    };
    let word = |i: usize| u32::from_be_bytes([ihdr[i], ihdr[i + 1], ihdr[i + 2], ihdr[i + 3]]);
    let (width, height, bits, colour) = (word(0), word(4), ihdr[8], ihdr[9]);
    let right = if wanted.grey16 { (16, 0) } else { (8, 2) };
    if (bits, colour) != right {
        return fault(format!("{bits}-bit {}", colour_type(colour)), wanted.kind().into());
    }
    if (width, height) != (wanted.width, wanted.height) {
        return fault(
            format!("{width} x {height} pixels"),
            format!("{} x {} pixels as the camera has", wanted.width, wanted.height),
        );
    }
    Ok(())
}

fn colour_type(code: u8) -> &'static str {
    match code {
        0 => "greyscale",
        2 => "RGB",
        3 => "palette colour",
        4 => "greyscale with alpha",
        6 => "RGB with alpha",
        _ => "of an unknown colour type",
    }
}

/// Checks the header of a PNG on disk without reading the rest; gives the header's bytes.
pub(super) fn check_file_header(path: &Path, wanted: Wanted) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    let opened = File::open(path).and_then(|file| file.take(33).read_to_end(&mut head));
    opened.map_err(|error| Error::bad_input(path, "the file", error.to_string(), wanted.kind()))?;
    check_header(path, &head, wanted)?;
    Ok(head)
}

fn decode(path: &Path, bytes: &[u8], wanted: Wanted) -> Result<DynamicImage> {
    check_header(path, bytes, wanted)?;
    let whole = format!("{}, whole and undamaged", wanted.kind());
    // Every PNG ends with the chunk IEND; without it the file was cut, even where all pixels are there.
    if !bytes.windows(4).any(|chunk| chunk == b"IEND") {
        return Err(Error::bad_input(path, "image data", "a PNG without its end", whole));
    }
    image::load_from_memory_with_format(bytes, ImageFormat::Png).map_err(|error| {
        Error::bad_input(
            path,
            "image data",
            format!("a PNG that cannot be decoded ({error})"),
            whole,
        )
    })
}

fn grey16(path: &Path, bytes: &[u8], wanted: Wanted) -> Result<Vec<u16>> {
    match decode(path, bytes, wanted)? {
        DynamicImage::ImageLuma16(image) => Ok(image.into_raw()),
        _ => Err(Error::bad_input(
            path,
            "image header",
            "greyscale with transparency",
            wanted.kind(),
        )),
    }
}

/// Decodes a depth image of the wanted size.
pub(super) fn read_depth(path: &Path, bytes: &[u8], width: u32, height: u32) -> Result<DepthImage> {
    let counts = grey16(
        path,
        bytes,
        Wanted {
            grey16: true,
            width,
            height,
        },
    )?;
    Ok(DepthImage { width, height, counts })
}

/// Decodes an image of instance ids of the wanted size.
pub(super) fn read_labels(path: &Path, bytes: &[u8], width: u32, height: u32) -> Result<LabelImage> {
    let ids = grey16(
        path,
        bytes,
        Wanted {
            grey16: true,
            width,
            height,
        },
    )?;
    Ok(LabelImage { width, height, ids })
}

/// Decodes a colour image of the wanted size.
pub(super) fn read_color(path: &Path, bytes: &[u8], width: u32, height: u32) -> Result<ColorImage> {
    let wanted = Wanted {
        grey16: false,
        width,
        height,
    };
    match decode(path, bytes, wanted)? {
        DynamicImage::ImageRgb8(image) => {
            let rgb = image.pixels().map(|p| p.0).collect();
            Ok(ColorImage { width, height, rgb })
        }
        _ => Err(Error::bad_input(
            path,
            "image header",
            "RGB with transparency",
            wanted.kind(),
        )),
    }
}

/// A 16-bit greyscale PNG of `values`, row by row.
pub(super) fn grey16_png(width: u32, height: u32, values: &[u16]) -> Result<Vec<u8>> {
    let image = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, values.to_vec());
    encode(image.map(DynamicImage::ImageLuma16))
}

/// An 8-bit RGB PNG of `image`.
pub fn color_png(image: &ColorImage) -> Result<Vec<u8>> {
    let flat: Vec<u8> = image.rgb.iter().flatten().copied().collect();
    let image = ImageBuffer::<Rgb<u8>, _>::from_raw(image.width, image.height, flat);
    encode(image.map(DynamicImage::ImageRgb8))
}

fn encode(image: Option<DynamicImage>) -> Result<Vec<u8>> {
    let image = image.ok_or_else(|| Error::Failed("an image holds fewer pixels than its size says".into()))?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| Error::Failed(format!("an image could not be written as PNG: {error}")))?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_comes_back_and_a_cut_file_is_refused_wherever_it_is_cut() {
        let values: Vec<u16> = (0..12 * 7).map(|i| (i * 977) as u16).collect();
        let png = grey16_png(12, 7, &values).expect("encoded");
        let path = Path::new("depth.png");
        assert_eq!(read_depth(path, &png, 12, 7).expect("decoded").counts, values);
        for length in 0..png.len() - 4 {
            let error = read_depth(path, &png[..length], 12, 7).expect_err("refused");
            assert_eq!(error.exit_code(), 2, "{length}");
        }
    }

    #[test]
    fn another_kind_or_size_is_refused_by_name() {
        let rgb = ColorImage {
            width: 3,
            height: 2,
            rgb: vec![[1, 2, 3]; 6],
        };
        let png = color_png(&rgb).expect("encoded");
        let path = Path::new("a.png");
        assert_eq!(read_color(path, &png, 3, 2).expect("decoded").rgb, rgb.rgb);
        let said = read_depth(path, &png, 3, 2).expect_err("refused").to_string();
        assert!(
            said.contains("found 8-bit RGB, expected a 16-bit greyscale PNG"),
            "{said}"
        );
        let said = read_color(path, &png, 4, 2).expect_err("refused").to_string();
        assert!(said.contains("found 3 x 2 pixels, expected 4 x 2"), "{said}");
    }
}
