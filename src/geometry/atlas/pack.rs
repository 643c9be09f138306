//! Boxes packed into a sheet that is nearly square, on shelves.

/// How much wider the sheet is taken than a square of the boxes' area: shelves waste some.
const SLACK: f64 = 1.08;

/// Width and height of the sheet, and the upper left corner of each box. Nothing where there is no box.
pub fn pack(sizes: &[[u32; 2]]) -> Option<(u32, u32, Vec<[u32; 2]>)> {
    let widest = sizes.iter().map(|s| s[0]).max()?;
    let area: f64 = sizes.iter().map(|s| f64::from(s[0]) * f64::from(s[1])).sum();
    let width = widest.max((SLACK * area).sqrt().ceil() as u32).next_multiple_of(4);
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|i| (std::cmp::Reverse(sizes[*i][1]), std::cmp::Reverse(sizes[*i][0]), *i));
    // Each shelf: where it starts, how high it is, and how far it is filled.
    let mut shelves: Vec<[u32; 3]> = Vec::new();
    let mut spots = vec![[0; 2]; sizes.len()];
    let mut height = 0;
    for i in order {
        let [w, h] = sizes[i];
        let shelf = match shelves.iter().position(|s| s[1] >= h && s[2] + w <= width) {
            Some(shelf) => shelf,
            None => {
                shelves.push([height, h, 0]);
                height += h;
                shelves.len() - 1
            }
        };
        let [top, _, filled] = &mut shelves[shelf];
        spots[i] = [*filled, *top];
        *filled += w;
    }
    Some((width, height.next_multiple_of(4), spots))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_do_not_overlap() {
        let sizes: Vec<[u32; 2]> = (0..40).map(|i| [3 + (i * 7) % 23, 2 + (i * 5) % 17]).collect();
        let (width, height, spots) = pack(&sizes).expect("a sheet");
        let mut taken = vec![false; (width * height) as usize];
        for (size, spot) in sizes.iter().zip(&spots) {
            for y in spot[1]..spot[1] + size[1] {
                for x in spot[0]..spot[0] + size[0] {
                    let cell = &mut taken[(y * width + x) as usize];
                    assert!(!*cell);
                    *cell = true;
                }
            }
        }
    }
}
