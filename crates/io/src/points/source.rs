//! The bytes that points are read from: a file, or what stands in memory.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

use crate::read_error::Malformed;

/// So many bytes are held at a time.
const BUFFER: usize = 1 << 16;

/// What can be read from any place in it.
pub(crate) trait ReadSeek: Read + Seek {}

impl<T: Read + Seek> ReadSeek for T {}

/// Bytes of a known number, read in order or from another place on, of which a fixed number is held at a time.
pub(crate) struct Source<'a> {
    reader: BufReader<Watched<'a>>,
    length: u64,
}

impl<'a> Source<'a> {
    /// From the first of `length` bytes on, which is where `bytes` stands.
    pub(crate) fn new(bytes: &'a mut dyn ReadSeek, length: u64) -> Self {
        let reader = BufReader::with_capacity(BUFFER, Watched { bytes, at: 0, failure: None });
        Self { reader, length }
    }

    /// The number of bytes, none of which need have been read.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Where the next byte stands.
    pub(crate) fn at(&self) -> u64 {
        self.reader.get_ref().at - self.reader.buffer().len() as u64
    }

    /// The number of bytes from here to the end.
    pub(crate) fn remaining(&self) -> u64 {
        self.length.saturating_sub(self.at())
    }

    /// Goes on at byte `at`.
    pub(crate) fn go_to(&mut self, at: u64) -> Result<(), Malformed> {
        self.seek(SeekFrom::Start(at)).map_err(Malformed::unread)?;
        Ok(())
    }

    /// The next bytes, `most` or all that there are, which are then read again.
    pub(crate) fn peek(&mut self, most: usize) -> Result<Vec<u8>, Malformed> {
        let at = self.at();
        let mut head = Vec::new();
        self.by_ref().take(most as u64).read_to_end(&mut head).map_err(Malformed::unread)?;
        self.go_to(at)?;
        Ok(head)
    }

    /// Reads as many bytes as `place` has.
    pub(crate) fn fill(&mut self, place: &mut [u8]) -> Result<(), Malformed> {
        self.read_exact(place).map_err(Malformed::unread)
    }

    /// What the operating system said where it did not hand over bytes, whatever the readers made of it.
    pub(crate) fn failure(self) -> Option<io::Error> {
        self.reader.into_inner().failure
    }
}

impl Read for Source<'_> {
    fn read(&mut self, place: &mut [u8]) -> io::Result<usize> {
        self.reader.read(place)
    }

    fn read_exact(&mut self, place: &mut [u8]) -> io::Result<()> {
        self.reader.read_exact(place)
    }
}

impl BufRead for Source<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.reader.consume(count);
    }
}

/// Within what is held, nothing is read again.
impl Seek for Source<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = self.at();
        let to = match to {
            SeekFrom::Start(to) => Some(to),
            SeekFrom::Current(by) => at.checked_add_signed(by),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
        };
        let by = to.and_then(|to| i64::try_from(i128::from(to) - i128::from(at)).ok());
        let (Some(to), Some(by)) = (to, by) else {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "there is no such place in the file"));
        };
        self.reader.seek_relative(by)?;
        Ok(to)
    }
}

/// Knows where it stands, and keeps the first error of reading: decoders of other crates wrap what they are told in errors of their
/// own.
struct Watched<'a> {
    bytes: &'a mut dyn ReadSeek,
    at: u64,
    failure: Option<io::Error>,
}

impl Read for Watched<'_> {
    fn read(&mut self, place: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.bytes.read(place) {
                Ok(count) => {
                    self.at += count as u64;
                    return Ok(count);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => {
                    let kind = error.kind();
                    self.failure.get_or_insert(error);
                    return Err(kind.into());
                }
            }
        }
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.bytes.seek(to)?;
        Ok(self.at)
    }
}
