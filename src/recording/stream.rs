//! Rows of a recording as a stream of the `.rrd` format, with ids that are counted instead of drawn.

use re_chunk::{Chunk, ChunkComponents, ChunkId, RowId, TimeColumn};
use re_log_encoding::Encoder;
use re_log_types::{
    ApplicationId, EntityPath, EntityPathPart, LogMsg, RecordingId, SetStoreInfo, StoreId, StoreInfo, StoreSource,
};
use re_sdk_types::{AsComponents, SerializationError, SerializedComponentColumn};

use super::clock::Moment;
use crate::base::{Error, Result};

/// The timeline on which touches follow each other.
pub(super) const PLAYED: &str = "played";
/// The timeline of the capture's own clock.
pub(super) const RECORDED: &str = "capture_clock";

/// The place of what is logged, a part a name; names may hold any character.
pub(super) type Place<'a> = &'a [&'a str];

/// A recording that grows row by row.
pub(super) struct Stream {
    encoder: Encoder<Vec<u8>>,
    store: StoreId,
    /// The id of the next row or chunk: an id has to be unique and to grow, no more.
    next: u128,
}

/// What the encoder refuses, as an error of palpate.
pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(format!("recording.rrd: {error}"))
}

impl Stream {
    /// An empty recording. The viewer takes two recordings of one `id` for parts of the same.
    pub(super) fn new(id: &str) -> Result<Self> {
        let store = StoreId::recording(ApplicationId::from("palpate"), RecordingId::from(id));
        let mut encoder = Encoder::local().map_err(failed)?;
        // The footer, an index that readers may do without, is written in the order of a hash table.
        encoder.do_not_emit_footer();
        let mut stream = Self {
            encoder,
            store: store.clone(),
            next: 1,
        };
        let info = StoreInfo::new(
            store,
            StoreSource::Other(format!("palpate {}", env!("CARGO_PKG_VERSION"))),
        );
        let row_id = stream.id();
        let row_id = RowId::from_u128(row_id).as_tuid();
        stream.append(&LogMsg::SetStoreInfo(SetStoreInfo { row_id, info }))?;
        Ok(stream)
    }

    fn id(&mut self) -> u128 {
        self.next += 1;
        self.next
    }

    fn append(&mut self, message: &LogMsg) -> Result<()> {
        self.encoder.append(message).map(|_| ()).map_err(failed)
    }

    fn send(&mut self, chunk: &Chunk) -> Result<()> {
        let message = chunk.to_arrow_msg().map_err(failed)?;
        self.append(&LogMsg::ArrowMsg(self.store.clone(), message))
    }

    /// What holds at all times.
    pub(super) fn still(&mut self, place: Place, what: &dyn AsComponents) -> Result<()> {
        self.row(path(place), &[], what)
    }

    /// What holds of the recording as a whole.
    pub(super) fn property(&mut self, what: &dyn AsComponents) -> Result<()> {
        self.row(EntityPath::properties(), &[], what)
    }

    /// What holds from a moment on.
    pub(super) fn at(&mut self, place: Place, moment: Moment, what: &dyn AsComponents) -> Result<()> {
        self.row(path(place), &[moment], what)
    }

    fn row(&mut self, path: EntityPath, moments: &[Moment], what: &dyn AsComponents) -> Result<()> {
        let columns = what
            .as_serialized_batches()
            .into_iter()
            .map(SerializedComponentColumn::from)
            .collect();
        self.chunk(path, moments, columns, 1)
    }

    /// A row of `columns` for each of `moments`, which do not run backwards.
    pub(super) fn rows(
        &mut self,
        place: Place,
        moments: &[Moment],
        columns: std::result::Result<impl Iterator<Item = SerializedComponentColumn>, SerializationError>,
    ) -> Result<()> {
        if moments.is_empty() {
            return Ok(());
        }
        let columns = columns.map_err(failed)?.collect();
        self.chunk(path(place), moments, columns, moments.len())
    }

    fn chunk(
        &mut self,
        path: EntityPath,
        moments: &[Moment],
        columns: Vec<SerializedComponentColumn>,
        rows: usize,
    ) -> Result<()> {
        let id = ChunkId::from_u128(self.id());
        let row_ids: Vec<RowId> = (0..rows).map(|_| RowId::from_u128(self.id())).collect();
        let times = [
            TimeColumn::new_duration_secs(PLAYED, moments.iter().map(|m| m.played)),
            TimeColumn::new_duration_secs(RECORDED, moments.iter().map(|m| m.recorded)),
        ];
        let times = if moments.is_empty() { Vec::new() } else { times.into() };
        let times = times.into_iter().map(|t| (*t.timeline().name(), t)).collect();
        let components: ChunkComponents = columns.into_iter().collect();
        let chunk = Chunk::from_native_row_ids(id, path, Some(true), &row_ids, times, components).map_err(failed)?;
        self.send(&chunk)
    }

    /// The recording as the bytes of an `.rrd` file.
    pub(super) fn finish(mut self) -> Result<Vec<u8>> {
        self.encoder.finish().map_err(failed)?;
        self.encoder.into_inner().map_err(failed)
    }
}

fn path(place: Place) -> EntityPath {
    EntityPath::new(place.iter().map(|p| EntityPathPart::new(*p)).collect())
}
