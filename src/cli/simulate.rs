//! `palpate simulate`: a hand at work on the twin in the embedded engine.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::{Error, Result, StagedFolder, write_atomically};
use crate::export::{Deed, FilmFormat, film_folder, manipulate_folder};

/// What a folder of pictures always holds.
const FIRST: &str = "0000.png";

/// Does one thing to the twin and says what came along.
pub fn simulate(common: &Common, twin: &Path, deed: &str, film: Option<&Path>) -> Result<ExitCode> {
    let deed: Deed = deed.parse()?;
    let outcome = match film {
        None => manipulate_folder(twin, &deed)?,
        Some(place) => {
            let format = film_format(place)?;
            let (outcome, files) = film_folder(twin, &deed, format)?;
            match format {
                FilmFormat::Animation => files.iter().try_for_each(|bytes| write_atomically(place, bytes))?,
                FilmFormat::Pictures => write_pictures(place, &files)?,
            }
            outcome
        }
    };
    output::result(common, &outcome.to_string(), &outcome)?;
    Ok(ExitCode::SUCCESS)
}

/// By its ending: a `.glb` is an animation, no ending a folder of pictures.
fn film_format(place: &Path) -> Result<FilmFormat> {
    match place.extension().and_then(|e| e.to_str()) {
        Some("glb") => Ok(FilmFormat::Animation),
        None if place.extension().is_none() => Ok(FilmFormat::Pictures),
        _ => Err(Error::Usage(format!(
            "--film {}: expected FILE.glb for an animation, or a folder's name without an ending for PNG pictures",
            place.display()
        ))),
    }
}

fn write_pictures(folder: &Path, files: &[Vec<u8>]) -> Result<()> {
    let staged = StagedFolder::create(folder, FIRST)?;
    for (number, bytes) in files.iter().enumerate() {
        staged.write(&format!("{number:04}.png"), bytes)?;
    }
    staged.commit()
}
