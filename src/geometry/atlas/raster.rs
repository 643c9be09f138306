//! Which texels of an image a triangle covers.

/// Calls `visit` with every pixel of an image of that size whose centre lies in the triangle, and with its barycentric
/// weights there. Pixels are numbered from the upper left corner, and the centre of the first is at (0.5, 0.5). Of two
/// triangles that share an edge one alone covers a centre on it.
pub fn cover_triangle(corners: &[[f64; 2]; 3], size: [i64; 2], mut visit: impl FnMut(i64, i64, [f64; 3])) {
    let bound = |k: usize, pick: fn(f64, f64) -> f64| pick(pick(corners[0][k], corners[1][k]), corners[2][k]);
    let low = [0, 1].map(|k| ((bound(k, f64::min) - 0.5).ceil() as i64).max(0));
    let high = [0, 1].map(|k| ((bound(k, f64::max) - 0.5).floor() as i64).min(size[k] - 1));
    for y in low[1]..=high[1] {
        for x in low[0]..=high[0] {
            if let Some(w) = weights(corners, [x as f64 + 0.5, y as f64 + 0.5]) {
                visit(x, y, w);
            }
        }
    }
}

/// Barycentric weights of a point, if the triangle covers it.
fn weights(corners: &[[f64; 2]; 3], p: [f64; 2]) -> Option<[f64; 3]> {
    let side = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let whole = side(corners[0], corners[1], corners[2]);
    if whole == 0.0 {
        return None;
    }
    let turn = whole.signum();
    let mut w = [0.0; 3];
    for k in 0..3 {
        let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        w[k] = side(a, b, p) / whole;
        let (dx, dy) = (turn * (b[0] - a[0]), turn * (b[1] - a[1]));
        let owned = dy > 0.0 || (dy == 0.0 && dx < 0.0);
        if w[k] < 0.0 || (w[k] == 0.0 && !owned) {
            return None;
        }
    }
    Some(w)
}
