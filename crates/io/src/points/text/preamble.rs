//! What stands above the rows of a text table, and which columns it makes coordinates.

use crate::points::columns::Columns;
use crate::points::text::row::{is_word, split, unquoted};
use crate::points::{Dimension, attribute_columns};

/// So many lines of words may stand before the first row.
const LONGEST_PREAMBLE: usize = 100;

/// What stands before the first row: a count of points, words, names of columns.
#[derive(Default)]
pub(crate) struct Preamble {
    announced: Option<u64>,
    /// Lines of nothing but words.
    words: Vec<Vec<String>>,
    /// Whether one of them, outside a comment, names x and y: from there on a row may begin with a word.
    named: bool,
}

impl Preamble {
    /// Whether the line belongs to the preamble.
    pub(crate) fn takes<'a>(
        &mut self,
        line: &'a str,
        comment: Option<&'a str>,
        fields: &mut Vec<&'a str>,
    ) -> Result<bool, String> {
        if let (true, Some(comment)) = (line.is_empty(), comment) {
            let named = split(comment, fields).is_ok() && fields.iter().all(|f| is_word(f)) && names_columns(fields);
            if named && self.words.len() < LONGEST_PREAMBLE {
                self.words.push(fields.iter().map(|f| (*f).to_owned()).collect());
            }
            return Ok(true);
        }
        if split(line, fields).is_err() {
            return Ok(false);
        }
        drop_last_empty(fields);
        if !fields.is_empty() && fields.iter().all(|f| is_word(f)) {
            let words: Vec<String> = fields.iter().map(|f| (*f).to_owned()).collect();
            self.named |= named(&words, None)?.is_some();
            self.words.push(words);
        } else if !self.named && fields.first().is_some_and(|f| is_word(f)) {
            self.words.push(Vec::new());
        } else if let ([count], None, true) = (&fields[..], self.announced, self.words.is_empty()) {
            // The PTS format opens with the number of points on a line of its own.
            self.announced = count.parse().ok();
            return Ok(self.announced.is_some());
        } else {
            return Ok(false);
        }
        if self.words.len() > LONGEST_PREAMBLE {
            return Err(format!("{LONGEST_PREAMBLE} lines of words before, and still no row of numbers"));
        }
        Ok(true)
    }

    /// The number of points that the first line announces.
    pub(crate) fn announced(&self) -> Option<u64> {
        self.announced
    }

    /// The number of lines of words.
    pub(crate) fn words(&self) -> usize {
        self.words.len()
    }

    /// What the columns of the first row hold, by the last line that names as many of them, or else by their number alone;
    /// which other columns have names, and whether they are all unnamed. An empty field that a last separator leaves is taken off the row.
    pub(crate) fn columns(
        &self,
        row: &mut Vec<&str>,
        asked: Option<Dimension>,
    ) -> Result<(Columns, Names, bool), String> {
        let least = row.len() - usize::from(row.last() == Some(&""));
        let fits = |words: &&Vec<String>| names_columns(words) && (words.len() == row.len() || words.len() == least);
        if let Some(words) = self.words.iter().rev().find(fits)
            && let Some(columns) = named(words, asked)?
        {
            row.truncate(words.len());
            let names = attribute_columns(words.iter().map(|w| unquoted(w)).enumerate());
            let names = names.into_iter().map(|(position, name)| (position, name.to_owned())).collect();
            return Ok((columns, names, false));
        }
        if let (true, Some(words)) = (self.named, self.words.last()) {
            return Err(format!("{} columns under a header line of {}", row.len(), words.len()));
        }
        drop_last_empty(row);
        Ok((positional(row.len(), asked)?, Vec::new(), true))
    }
}

/// Positions and names of columns.
pub(crate) type Names = Vec<(usize, String)>;

/// One separator may end a row.
pub(crate) fn drop_last_empty(fields: &mut Vec<&str>) {
    if fields.last() == Some(&"") {
        fields.pop();
    }
}

fn names_columns(words: &[impl AsRef<str>]) -> bool {
    let is_named = |name: &str| words.iter().any(|w| unquoted(w.as_ref()).eq_ignore_ascii_case(name));
    is_named("x") && is_named("y")
}

/// Columns by their number alone: the first two or three, and normals where there are six.
fn positional(count: usize, asked: Option<Dimension>) -> Result<Columns, String> {
    let (used, dimension, with_normals) = match (count, asked) {
        (0 | 1, _) => {
            return Err(format!(
                "{count} column{}; 2 (x y) or 3 (x y z) are needed",
                if count == 1 { "" } else { "s" }
            ));
        }
        (2, _) | (_, Some(Dimension::Two)) => (2, Dimension::Two, false),
        (6, _) => (6, Dimension::Three, true),
        _ => (3, Dimension::Three, false),
    };
    Ok(Columns { slots: (0..used).collect(), dimension, with_normals })
}

/// Columns by the words of a header line; `None` where it does not name x and y.
fn named(words: &[String], asked: Option<Dimension>) -> Result<Option<Columns>, String> {
    Columns::named(|name| {
        if asked == Some(Dimension::Two) && name.ends_with('z') {
            return Ok(None);
        }
        let mut hits = words.iter().enumerate().filter(|(_, w)| unquoted(w).eq_ignore_ascii_case(name));
        match (hits.next(), hits.next()) {
            (_, Some(_)) => Err(format!("two columns are named {name}")),
            (hit, None) => Ok(hit.map(|(position, _)| position)),
        }
    })
}
