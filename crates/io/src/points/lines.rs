//! Lines of text, whatever ends them.

use std::borrow::Cow;
use std::io::BufRead;

use crate::points::source::Source;
use crate::read_error::Malformed;

const MARK: &[u8] = b"\xEF\xBB\xBF";

/// The lines of a text, one at a time. They end in LF or CRLF; where there is no LF at all, in a lone CR.
pub(crate) struct Lines<'a, 's> {
    source: &'a mut Source<'s>,
    end: u8,
    number: usize,
    line: Vec<u8>,
}

impl<'a, 's> Lines<'a, 's> {
    /// The lines from where the source stands, without the mark that UTF-8 may begin with. A file without any LF is gone through
    /// once to find that out.
    pub(crate) fn new(source: &'a mut Source<'s>) -> Result<Self, Malformed> {
        if source.at() == 0 && source.peek(MARK.len())? == MARK {
            source.go_to(MARK.len() as u64)?;
        }
        let start = source.at();
        let end = loop {
            let piece = source.fill_buf().map_err(Malformed::unread)?;
            if piece.contains(&b'\n') {
                break b'\n';
            }
            let count = piece.len();
            if count == 0 {
                break b'\r';
            }
            source.consume(count);
        };
        source.go_to(start)?;
        Ok(Self { source, end, number: 0, line: Vec::new() })
    }

    /// Goes to the next line, the first in the beginning. Whether there is one.
    pub(crate) fn advance(&mut self) -> Result<bool, Malformed> {
        self.line.clear();
        let count = self.source.read_until(self.end, &mut self.line).map_err(Malformed::unread)?;
        self.line.pop_if(|last| *last == self.end);
        self.line.pop_if(|last| *last == b'\r');
        self.number += usize::from(count > 0);
        Ok(count > 0)
    }

    /// The number of this line, counted from 1.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// This line, without its end.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.line
    }

    /// This line as text, with signs for what is not UTF-8: names may be in any encoding, numbers are ASCII in all of them.
    pub(crate) fn text(&self) -> Cow<'_, str> {
        // The lossy way alone looks at every byte by itself.
        str::from_utf8(&self.line).map_or_else(|_| String::from_utf8_lossy(&self.line), Cow::Borrowed)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn lf_crlf_and_lone_cr_end_lines() {
        for text in ["a\nb\nc", "a\r\nb\r\nc\r\n", "a\rb\rc", "a\rb\rc\r"] {
            let mut bytes = Cursor::new(text);
            let mut source = Source::new(&mut bytes, text.len() as u64);
            let mut lines = Lines::new(&mut source).unwrap();
            for (number, line) in [(1, "a"), (2, "b"), (3, "c")] {
                assert!(lines.advance().unwrap(), "{text:?}");
                assert_eq!((lines.number(), lines.text()), (number, line.into()), "{text:?}");
            }
            assert!(!lines.advance().unwrap(), "{text:?}");
        }
    }
}
