//! Groups of cases at a glance.

use super::process::Ending;
use super::row::{DOUBT, Row};
use super::verdict::{Verdict, quietly_wrong, side_target, topology_asked};

/// `right` of `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Share {
    pub right: usize,
    pub of: usize,
}

impl Share {
    fn count(&mut self, right: bool) {
        self.right += usize::from(right);
        self.of += 1;
    }
}

/// A group of cases.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    pub group: String,
    /// Cases that were run.
    pub run: usize,
    pub skipped: usize,
    /// Lowest share of points on the right side, percent, and its case.
    pub worst_side: Option<(f64, String)>,
    /// Cases whose side reaches its target, of those measured.
    pub side: Share,
    /// Cases of right topology, of those where it is known.
    pub topology: Share,
    /// The same among the cases of which it is asked.
    pub topology_asked: Share,
    pub doubted: usize,
    /// Runs that broke, were refused or took too long.
    pub failed: usize,
    /// Cases with warnings among the right ones.
    pub warned: Share,
    /// Right cases that ended in doubt.
    pub doubted_right: usize,
    /// Cases quietly wrong, and why.
    pub quiet: Vec<(String, String)>,
}

impl Summary {
    /// Counts some rows.
    pub fn of<'a>(group: &str, rows: impl IntoIterator<Item = &'a Row>) -> Self {
        let mut summary = Self { group: group.to_owned(), ..Self::default() };
        for row in rows {
            summary.add(row);
        }
        summary
    }

    fn add(&mut self, row: &Row) {
        let Some(ending) = &row.ending else {
            self.skipped += 1;
            return;
        };
        self.run += 1;
        let doubted = *ending == DOUBT;
        self.doubted += usize::from(doubted);
        self.failed += usize::from(!doubted && *ending != Ending::Exit(0));
        if let Some(side) = row.measures.side {
            self.side.count(side >= side_target(&row.case));
            if self.worst_side.as_ref().is_none_or(|(worst, _)| side < *worst) {
                self.worst_side = Some((side, row.case.name.clone()));
            }
        }
        if let Some(right) = row.topology_right() {
            self.topology.count(right);
            if topology_asked(&row.case) {
                self.topology_asked.count(right);
            }
        }
        if Verdict::of(row) == Verdict::Right {
            self.warned.count(!row.warnings.is_empty());
            self.doubted_right += usize::from(doubted);
        }
        self.quiet.extend(quietly_wrong(row).map(|why| (row.case.name.clone(), why)));
    }
}

/// One summary per group in the order of their first case, and one of all.
pub fn by_group(rows: &[Row]) -> Vec<Summary> {
    let mut groups: Vec<&str> = Vec::new();
    for row in rows {
        if !groups.contains(&row.case.group.as_str()) {
            groups.push(&row.case.group);
        }
    }
    let of = |group: &&str| Summary::of(group, rows.iter().filter(|row| row.case.group == *group));
    let mut summaries: Vec<_> = groups.iter().map(of).collect();
    summaries.push(Summary::of("all", rows));
    summaries
}
