//! The recording as a whole: what is written, in which order.

use re_sdk_types::archetypes::RecordingInfo;

use super::stream::{Stream, failed};
use super::{cameras, clock, curves, scene, touches, words};
use crate::base::{Result, digest_of};
use crate::capture::Capture;
use crate::pipeline::Run;

/// The recording of a finished run, as the bytes of an `.rrd` file.
///
/// World frame, m, N, s; z of the entities is that of the capture. The same run gives the same bytes: ids are counted, and
/// the recording is named by what it was made of.
///
/// # Errors
/// [`crate::base::Error::Failed`] where the format refuses something; those of [`crate::capture::read_frame`] where an
/// image of the capture is damaged.
pub fn record(capture: &Capture, run: &Run) -> Result<Vec<u8>> {
    let twin = &run.model.twin;
    let made = serde_json::to_vec(&twin.provenance).map_err(failed)?;
    let mut stream = Stream::new(&format!("{}-{}", twin.name, &digest_of(&made)[..16]))?;
    stream.property(&RecordingInfo::new().with_name(twin.name.as_str()))?;
    let spans = clock::spans(capture);
    words::log(&mut stream, capture, run, &spans)?;
    scene::log(&mut stream, run)?;
    cameras::log(&mut stream, capture, &spans)?;
    touches::log(&mut stream, capture, run, &spans)?;
    curves::log(&mut stream, capture, run, &spans)?;
    stream.finish()
}
