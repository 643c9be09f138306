//! What the rows of a recorded stream mean, and what is refused in them.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, Unit, UnitQuaternion, UnitVector3, Vector3};

use super::table::Table;
use super::{PoseStream, VectorStream, WrenchStream};
use crate::base::{Error, Pose, Result};

/// How far the length of a unit quaternion or normal may be from one; within it, it is normalised.
pub(super) const UNIT_TOLERANCE: f64 = 1e-3;

const FORCE: &str = "time,fx,fy,fz";
const WRENCH: &str = "time,fx,fy,fz,tx,ty,tz";
const POSE: &str = "time,x,y,z,qx,qy,qz,qw";
const NORMAL: &str = "time,nx,ny,nz";
const POSE_COLUMNS: [&str; 7] = ["x", "y", "z", "qx", "qy", "qz", "qw"];

/// Closer to one than this a length is left alone, so that what is written and read again keeps its digits.
const EXACT: f64 = 1e-12;

/// The unit quaternion of `x y z w`, or its length where that is not one.
pub(super) fn unit_quaternion(q: [f64; 4]) -> std::result::Result<UnitQuaternion<f64>, f64> {
    let quaternion = Quaternion::new(q[3], q[0], q[1], q[2]);
    unit(quaternion, quaternion.norm())
}

/// The unit vector of `v`, or its length where that is not one.
pub(super) fn unit_vector(v: [f64; 3]) -> std::result::Result<UnitVector3<f64>, f64> {
    let vector = Vector3::from(v);
    unit(vector, vector.norm())
}

fn unit<T: nalgebra::Normed<Norm = f64>>(value: T, norm: f64) -> std::result::Result<Unit<T>, f64> {
    match (norm - 1.0).abs() {
        off if off <= EXACT => Ok(Unit::new_unchecked(value)),
        off if off <= UNIT_TOLERANCE => Ok(Unit::new_normalize(value)),
        _ => Err(norm),
    }
}

/// Forces and, where the header has them, torques.
pub(super) fn read_wrench(file: &Path, bytes: &[u8]) -> Result<WrenchStream> {
    let table = Table::parse(file, bytes, &[FORCE, WRENCH])?;
    let time = table.times()?;
    let rows = 0..table.len();
    let force: Vec<Vector3<f64>> = rows
        .clone()
        .map(|r| Ok(table.numbers(r, 1)?.into()))
        .collect::<Result<_>>()?;
    let torque = match table.column("tx") {
        Some(first) => Some(
            rows.map(|r| Ok(table.numbers(r, first)?.into()))
                .collect::<Result<_>>()?,
        ),
        None => None,
    };
    refuse_all_missing(&table, force.iter().any(|f| f.iter().any(|x| x.is_finite())))?;
    Ok(WrenchStream { time, force, torque })
}

/// Poses of a tracked body; orientation may be missing throughout, a row may be missing as a whole.
pub(super) fn read_track(file: &Path, bytes: &[u8]) -> Result<PoseStream> {
    read_poses(&Table::parse(file, bytes, &[POSE])?, true)
}

/// Poses of a tool; a row may be missing as a whole.
pub(super) fn read_tool_path(file: &Path, bytes: &[u8]) -> Result<PoseStream> {
    read_poses(&Table::parse(file, bytes, &[POSE])?, false)
}

/// The pose columns of any table that has them, with its times.
pub(super) fn read_poses(table: &Table, orientation_may_lack: bool) -> Result<PoseStream> {
    let mut stream = PoseStream {
        time: table.times()?,
        ..PoseStream::default()
    };
    let first = table.column("x").unwrap_or(1);
    for row in 0..table.len() {
        let numbers: [f64; 7] = table.numbers(row, first)?;
        let (position, rotation) = read_pose_row(table, row, numbers, orientation_may_lack)?;
        stream.position.push(position);
        stream.rotation.push(rotation);
    }
    check_orientation_throughout(table, &stream)?;
    refuse_all_missing(table, stream.position.iter().any(|p| p.x.is_finite()))?;
    Ok(stream)
}

type PoseRow = (Point3<f64>, Option<UnitQuaternion<f64>>);

fn read_pose_row(table: &Table, row: usize, seven: [f64; 7], orientation_may_lack: bool) -> Result<PoseRow> {
    let [x, y, z, q @ ..] = seven;
    let missing = seven.map(f64::is_nan);
    let position = Point3::new(x, y, z);
    if missing == [true; 7] {
        return Ok((position, None));
    }
    if orientation_may_lack && missing == [false, false, false, true, true, true, true] {
        return Ok((position, None));
    }
    if let Some(i) = missing.iter().position(|m| *m) {
        let expected = if orientation_may_lack {
            "a whole pose, a row missing as a whole, or qx, qy, qz, qw missing in every row"
        } else {
            "a whole pose, or a row missing as a whole"
        };
        return Err(table.fault(
            row,
            POSE_COLUMNS[i],
            "a missing reading in a pose that is there in part",
            expected,
        ));
    }
    match unit_quaternion(q) {
        Ok(rotation) => Ok((position, Some(rotation))),
        Err(norm) => Err(table.fault(
            row,
            "qx,qy,qz,qw",
            format!("a quaternion of length {norm:.6}"),
            "a unit quaternion, to within 0.001",
        )),
    }
}

/// Orientation is there in every row that is not missing, or in none.
fn check_orientation_throughout(table: &Table, stream: &PoseStream) -> Result<()> {
    if stream.rotation.iter().all(Option::is_none) {
        return Ok(());
    }
    let there = |row: &usize| stream.position[*row].x.is_finite() && stream.rotation[*row].is_none();
    match (0..table.len()).find(there) {
        None => Ok(()),
        Some(row) => Err(table.fault(
            row,
            "qx",
            "a missing orientation, though other rows have one",
            "an orientation in every row or in none",
        )),
    }
}

/// Directions of the support's normal. A row that is missing as a whole is left out: it says nothing.
pub(super) fn read_normals(file: &Path, bytes: &[u8]) -> Result<VectorStream> {
    let table = Table::parse(file, bytes, &[NORMAL])?;
    let mut stream = VectorStream::default();
    for (row, time) in table.times()?.into_iter().enumerate() {
        let numbers: [f64; 3] = table.numbers(row, 1)?;
        match numbers.map(f64::is_nan) {
            [true, true, true] => continue,
            [false, false, false] => {}
            missing => {
                let i = missing.iter().position(|m| *m).unwrap_or_default();
                let expected = "all three numbers, or none of them";
                return Err(table.fault(row, ["nx", "ny", "nz"][i], "a missing reading", expected));
            }
        }
        let vector = unit_vector(numbers).map_err(|norm| {
            let found = format!("a normal of length {norm:.6}");
            table.fault(row, "nx,ny,nz", found, "a unit vector, to within 0.001")
        })?;
        stream.time.push(time);
        stream.vector.push(vector);
    }
    refuse_all_missing(&table, !stream.time.is_empty())?;
    Ok(stream)
}

fn refuse_all_missing(table: &Table, some: bool) -> Result<()> {
    if some {
        return Ok(());
    }
    Err(Error::bad_input(
        &table.file,
        format!("rows 1 to {}", table.len()),
        "no reading at all",
        "at least one reading (leave the stream out where there is none)",
    ))
}

/// `x y z qx qy qz qw` as a pose; `place` names it in the error.
pub(super) fn pose_of(file: &Path, place: &str, seven: [f64; 7]) -> Result<Pose> {
    let [x, y, z, q @ ..] = seven;
    match unit_quaternion(q) {
        Ok(rotation) => Ok(Pose(Isometry3::from_parts(Translation3::new(x, y, z), rotation))),
        Err(norm) => Err(Error::bad_input(
            file,
            place,
            format!("a quaternion of length {norm:.6}"),
            "a unit quaternion (qx qy qz qw, scalar last), to within 0.001",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "time,x,y,z,qx,qy,qz,qw\n";

    fn said(rows: &str) -> String {
        let text = format!("{HEAD}{rows}");
        read_track(Path::new("track.csv"), text.as_bytes())
            .map_or_else(|e| e.to_string(), |s| format!("{} rows", s.len()))
    }

    #[test]
    fn a_track_may_lack_rows_or_orientation_but_nothing_in_part() {
        let table = [
            ("0,1,2,3,0,0,0,1\n0,1,2,3,0,0,0,1\n", "2 rows"),
            ("0,1,2,3,0,0,0,1\n1,,,,,,,\n2,nan,NaN,nan,nan,nan,nan,nan\n", "3 rows"),
            ("0,1,2,3,nan,nan,nan,nan\n1,1,2,3,,,,\n", "2 rows"),
            ("0,1,2,3,0,0,0,1\n1,1,2,3,,,,\n", "row 2, column qx"),
            ("0,1,,3,0,0,0,1\n", "row 1, column y"),
            ("0,1,2,3,0,nan,0,1\n", "row 1, column qy"),
            ("0,,,,0,0,0,1\n", "row 1, column x"),
            (
                "0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1.002\n",
                "row 2, column qx,qy,qz,qw: found a quaternion of length 1.002",
            ),
            (
                "1,1,2,3,0,0,0,1\n0.5,1,2,3,0,0,0,1\n",
                "row 2, column time: found 0.5 after 1",
            ),
            ("0,1,2,inf,0,0,0,1\n", "row 1, column z: found `inf`"),
            ("0,1,2,3,0,0,0\n", "row 1: found 7 fields, expected 8"),
            (",1,2,3,0,0,0,1\n", "row 1, column time: found no time"),
            ("0,,,,,,,\n", "found no reading at all"),
            ("", "row 1: found the end of the file"),
        ];
        for (rows, wanted) in table {
            assert!(
                said(rows).contains(wanted),
                "{rows}\n said {}\n not {wanted}",
                said(rows)
            );
        }
    }
}
