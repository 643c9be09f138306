//! The camera as a map between rays and pixels: pinhole with Brown-Conrady distortion.

use crate::capture::Camera;

/// Where a ray `(x/z, y/z, 1)` of the optical frame meets the image, pixels (Brown 1966).
pub fn project(camera: &Camera, x: f64, y: f64) -> (f64, f64) {
    let (xd, yd) = distort(&camera.distortion, x, y);
    (camera.fx * xd + camera.cx, camera.fy * yd + camera.cy)
}

/// The ray `(x/z, y/z)` through a pixel, by fixed-point iteration of the distortion.
pub fn unproject(camera: &Camera, u: f64, v: f64) -> (f64, f64) {
    let (x0, y0) = ((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
    if camera.distortion == [0.0; 5] {
        return (x0, y0);
    }
    let (mut x, mut y) = (x0, y0);
    for _ in 0..20 {
        let (xd, yd) = distort(&camera.distortion, x, y);
        (x, y) = (x + x0 - xd, y + y0 - yd);
    }
    (x, y)
}

fn distort(coefficients: &[f64; 5], x: f64, y: f64) -> (f64, f64) {
    let [k1, k2, p1, p2, k3] = *coefficients;
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_comes_back_through_a_distorting_lens() {
        let camera = Camera {
            name: "c".into(),
            width: 640,
            height: 480,
            fx: 600.0,
            fy: 610.0,
            cx: 320.0,
            cy: 240.0,
            distortion: [0.12, -0.25, 0.001, -0.0005, 0.08],
            depth_unit: 0.001,
            depth_min: 0.1,
            depth_max: 3.0,
            depth_sd: None,
        };
        for (u, v) in [(0.0, 0.0), (639.0, 479.0), (100.0, 400.0), (320.0, 240.0)] {
            let (x, y) = unproject(&camera, u, v);
            let back = project(&camera, x, y);
            assert!((back.0 - u).abs() < 1e-6 && (back.1 - v).abs() < 1e-6, "{back:?}");
        }
    }
}
