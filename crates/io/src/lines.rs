//! Lines of text, whatever ends them.

/// The lines of a text and their numbers from 1. Lines end in LF or CRLF; where there is no LF at all, in a lone CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split(end).enumerate().map(|(index, line)| (index + 1, line.strip_suffix('\r').unwrap_or(line)))
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn lf_crlf_and_lone_cr_end_lines() {
        for text in ["a\nb\nc", "a\r\nb\r\nc", "a\rb\rc"] {
            assert_eq!(lines(text).collect::<Vec<_>>(), [(1, "a"), (2, "b"), (3, "c")], "{text:?}");
        }
    }
}
