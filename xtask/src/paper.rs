//! The paper redone: Table 1, the figures, and its claim measured. Writes `docs/paper/`.

mod cases;
mod claim;
mod figures;
mod picture;
mod plot;
mod table;

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result};

/// Writes pictures and `README.md` into `docs/paper` under the given root.
pub fn run(root: &Path) -> Result<()> {
    let folder = root.join("docs/paper");
    std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    let mut page = String::from(
        "# The paper, redone\n\nMade by `cargo xtask paper`; every figure on this page comes from that run, on the machine and day named \
         below. Compare times within this page only.\n\n",
    );
    writeln!(page, "Machine: {}.\n", machine())?;
    table::write(root, &mut page)?;
    figures::write(root, &folder, &mut page)?;
    claim::write(root, &folder, &mut page)?;
    let path = folder.join("README.md");
    std::fs::write(&path, page).with_context(|| format!("{} cannot be written", path.display()))?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

/// Processor, cores and date, as far as the system tells.
pub fn machine() -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        text.lines().find_map(|line| {
            line.strip_prefix("model name").map(|rest| rest.trim_start_matches([' ', '\t', ':']).to_owned())
        })
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let days = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |elapsed| elapsed.as_secs() / 86_400);
    format!("{}, {cores} cores, {}", processor.unwrap_or_else(|| std::env::consts::ARCH.into()), date(days))
}

/// The civil date of a day counted from 1970-01-01 (Gregorian calendar, years of 400-year cycles from March 1).
fn date(days: u64) -> String {
    let shifted = days + 719_468;
    let (era, day) = (shifted / 146_097, shifted % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let civil_month = if month < 10 { month + 3 } else { month - 9 };
    format!("{:04}-{civil_month:02}-{day_of_month:02}", era * 400 + year + u64::from(civil_month <= 2))
}

#[cfg(test)]
mod tests {
    #[test]
    fn dates() {
        assert_eq!(super::date(0), "1970-01-01");
        assert_eq!(super::date(19_782), "2024-02-29");
        assert_eq!(super::date(20_819), "2027-01-01");
    }
}
