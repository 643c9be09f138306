//! An image on a mesh.

use std::io::Cursor;

use image::{ImageFormat, ImageReader, RgbImage};

/// An sRGB image and where each triangle of a mesh lies in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    /// Places in the image, from its lower left corner (0, 0) to its upper right one (1, 1).
    pub places: Vec<[f64; 2]>,
    /// The places of each triangle's corners, triangle by triangle of the mesh. Each place belongs to one vertex.
    pub corners: Vec<[u32; 3]>,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
}

impl Texture {
    /// The image as PNG; nothing where its size is not that of its pixels.
    pub fn png(&self) -> Option<Vec<u8>> {
        let image = RgbImage::from_raw(self.width, self.height, self.rgb.as_flattened().to_vec())?;
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, ImageFormat::Png).ok()?;
        Some(bytes.into_inner())
    }

    /// Takes the image out of a PNG; says why not where it is none.
    ///
    /// # Errors
    /// The decoder's complaint.
    pub fn set_png(&mut self, bytes: &[u8]) -> Result<(), String> {
        let reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
        let image = reader.decode().map_err(|e| e.to_string())?.into_rgb8();
        (self.width, self.height) = image.dimensions();
        self.rgb = image.pixels().map(|p| p.0).collect();
        Ok(())
    }

    /// The vertex that each place belongs to, for a mesh of those triangles.
    pub fn vertices(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut vertices = vec![0; self.places.len()];
        for (places, corners) in self.corners.iter().zip(triangles) {
            for (place, vertex) in places.iter().zip(corners) {
                vertices[*place as usize] = *vertex;
            }
        }
        vertices
    }
}
