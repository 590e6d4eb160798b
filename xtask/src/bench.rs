//! The whole road and its stages timed, from 2500 points on. Writes a table and a plot.

mod ballast;
mod kernels;
mod levels;
mod meshlab;
mod page;
mod plot;
mod reference;
mod run;
mod sizes;
mod torus;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use run::Program;

/// What `bench` is told.
#[derive(Args)]
pub struct Arguments {
    /// The most points: sizes are 2500, 10 000, 40 000 …, four times as many each
    #[arg(long, value_name = "N", default_value_t = 160_000)]
    most_points: usize,
    /// Runs of each case, of which medians are told
    #[arg(long, value_name = "N", default_value_t = 3)]
    repeat: usize,
    /// Time the levels too: unknowns and seconds on each, down to cells as fine as the points
    #[arg(long)]
    levels: bool,
    /// Points for the levels
    #[arg(long, value_name = "N", default_value_t = 1_250_000)]
    level_points: usize,
    /// Cells along the longest side on the finest of the levels, 64 to 1024
    #[arg(long, value_name = "CELLS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=1024))]
    level_cells: u32,
    /// Run the benches of the kernels too
    #[arg(long)]
    kernels: bool,
    /// Time MeshLab's normals and screened Poisson (depth 8) too, with an interpreter that has pymeshlab
    #[arg(long, value_name = "PATH")]
    python: Option<PathBuf>,
    /// Threads of each run [default: all cores]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// The page; plots go beside it [default: target/bench/bench.md]
    #[arg(long, value_name = "FILE.md")]
    output: Option<PathBuf>,
    /// Use this binary instead of building one
    #[arg(long, value_name = "PATH")]
    binary: Option<PathBuf>,
}

/// Fewest points.
const FEWEST: usize = 2500;
/// Every size is so many times the one before.
const FACTOR: usize = 4;
/// At most so many points are timed with one thread and with all.
const SHARED: usize = 160_000;
/// More points than this are not asked for.
const MOST: usize = 2_500_000;

/// The sizes up to the largest that was asked for. The last, 2 560 000, is rounded.
fn sizes(most: usize) -> Vec<usize> {
    let sizes = std::iter::successors(Some(FEWEST), |size| Some(size * FACTOR)).map(|size| size.min(MOST));
    let mut sizes: Vec<usize> = sizes.take(6).collect();
    sizes.retain(|size| *size <= most.max(FEWEST));
    sizes
}

/// Runs what was asked for and writes the page after each part.
pub fn run(root: &Path, arguments: &Arguments) -> Result<()> {
    let binary = match &arguments.binary {
        Some(binary) => binary.canonicalize().with_context(|| format!("{} cannot be found", binary.display()))?,
        None => super::compare::build(root)?,
    };
    let work = root.join("target/bench");
    fs::create_dir_all(&work).with_context(|| format!("{} cannot be made", work.display()))?;
    let output = arguments.output.clone().unwrap_or_else(|| work.join("bench.md"));
    if let Some(folder) = output.parent() {
        fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    let threads = arguments.threads.map_or_else(|| "all".into(), |threads| threads.to_string());
    let mut page = format!(
        "# Bench\n\nMade by `cargo xtask bench`. Machine: {}; {threads} threads. Medians of {}. CPU seconds are user and system time; \
         on a machine that does other work too they are upper ends.\n",
        super::paper::machine(),
        arguments.repeat.max(1)
    );
    let program = Program { binary, threads: arguments.threads, repeat: arguments.repeat.max(1), work };
    let mut part = |text: String| {
        println!("{text}");
        page.push('\n');
        page.push_str(&text);
        fs::write(&output, &page).with_context(|| format!("{} cannot be written", output.display()))
    };
    let (rates, core) = reference::section();
    part(rates)?;
    let meshlab = arguments.python.as_deref().map(meshlab::MeshLab::new);
    part(page::fixture(&sizes::fixture(&program, root, meshlab.as_ref())?))?;
    let rows = sizes::rows(&program, &sizes(arguments.most_points), meshlab.as_ref())?;
    part(page::sizes(&rows, meshlab.as_ref(), &plot_file(&output, "points", &sizes::plot(&rows))?))?;
    if let Some(row) = rows.iter().rfind(|row| row.points <= SHARED)
        && let Some(found) = sizes::speedup(&program, row)?
    {
        part(page::speedup(&found))?;
    }
    if arguments.levels {
        let levels = levels::rows(&program, arguments.level_points, arguments.level_cells)?;
        part(page::levels(&levels, arguments.level_points, &plot_file(&output, "levels", &levels::plot(&levels))?))?;
    }
    if arguments.kernels {
        part(kernels::section(root, &core)?)?;
    }
    eprintln!("wrote {}", output.display());
    Ok(())
}

/// Writes a plot beside the page and returns its name.
fn plot_file(page: &Path, name: &str, svg: &str) -> Result<String> {
    let stem = page.file_stem().unwrap_or_default().to_string_lossy();
    let name = format!("{stem}-{name}.svg");
    let path = page.with_file_name(&name);
    fs::write(&path, svg).with_context(|| format!("{} cannot be written", path.display()))?;
    Ok(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_grow_by_fours() {
        assert_eq!(sizes(160_000), [2500, 10_000, 40_000, 160_000]);
        assert_eq!(sizes(10), [2500]);
        assert_eq!(sizes(usize::MAX), [2500, 10_000, 40_000, 160_000, 640_000, 2_500_000]);
    }
}
