//! The command line.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use zeroset_io::PointFormat;
use zeroset_render::{Size, Up};

use crate::points::format_parser;

/// Raw points in, a smooth implicit B-spline curve or surface out: no normals needed.
#[derive(Parser)]
#[command(name = "zeroset", version, arg_required_else_help = true, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done, 1 internal error, 2 wrong usage, 3 input refused, 4 no trustworthy result, \
                        5 output could not be written, 6 out of time, 130 interrupted."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    /// Print nothing but errors
    #[arg(short, long, global = true, help_heading = "Running")]
    pub quiet: bool,
    /// Number of threads; the result does not depend on it [default: all cores] [example: 4]
    #[arg(long, global = true, value_name = "N", help_heading = "Running")]
    pub threads: Option<usize>,
}

#[derive(Subcommand)]
pub enum Command {
    /// Reconstruct a curve or surface from points, closed or open
    #[command(after_help = "Examples:\n  zeroset reconstruct scan.ply -o surface.ply\n  \
                            zeroset reconstruct outline.xy -o outline.svg -o preview.svg -o function.npz\n  \
                            zeroset reconstruct scan.ply -o surface.glb --report report.html\n  \
                            zeroset reconstruct front.ply back.ply --box -1,-1,0,1,1,2 -o surface.ply")]
    Reconstruct(Reconstruct),
    /// Evaluate a saved spline at points: value, gradient, Hessian
    #[command(after_help = "Example:\n  zeroset eval function.npz points.xyz -o values.csv")]
    Eval(Eval),
    /// Extract the curve or surface of a saved spline again: at another resolution, or another value of the function
    #[command(after_help = "Examples:\n  zeroset mesh function.npz --resolution 512 -o fine.ply\n  \
                            zeroset mesh function.npz --iso 0.5 -o offset.stl")]
    Mesh(Mesh),
    /// Sample a saved spline on a grid
    #[command(after_help = "Example:\n  zeroset field function.npz --cells 256 -o values.npy")]
    Field(Field),
    /// Draw a saved spline: a surface with points, or a plane function's levels with its curve and points
    #[command(
        after_help = "Examples:\n  zeroset render function.npz --points scan.ply --view 1,0.5,1 -o surface.png\n  \
                            zeroset render function.npz --points outline.xy -o levels.svg"
    )]
    Render(Render),
    /// Say what is in a points file or a saved spline
    #[command(after_help = "Example:\n  zeroset info scan.ply")]
    Info(Info),
    /// Print completions of this command line for a shell
    #[command(
        after_help = "Examples:\n  zeroset completions bash > ~/.local/share/bash-completion/completions/zeroset\n  \
                            zeroset completions fish > ~/.config/fish/completions/zeroset.fish"
    )]
    Completions(Completions),
    /// Print the manual page, or write those of all commands into a folder
    #[command(after_help = "Examples:\n  zeroset man | man -l -\n  zeroset man ~/.local/share/man/man1")]
    Man(Man),
}

#[derive(Args)]
pub struct Reconstruct {
    /// Points: text .xyz .xy .txt .csv .asc .pts (x, y and, in 3D, z first, or columns named in a header line), .ply .obj .stl .npy
    /// .las .laz .e57; - for standard input. Several files are one cloud
    #[arg(required = true)]
    pub points: Vec<PathBuf>,
    /// The format of the points, whatever the extension; needed for standard input [example: xyz]
    #[arg(long, value_name = "EXTENSION", value_parser = format_parser(), hide_possible_values = true, help_heading = "Input")]
    pub format: Option<PointFormat>,
    /// What to do with normals that the points have: nothing, begin with them, or let them decide the sides. Which way is out is
    /// found in any case
    #[arg(long, value_enum, default_value_t = Normals::Hint, help_heading = "Input")]
    pub normals: Normals,
    /// Take only the points in this box: X0,Y0,Z0,X1,Y1,Z1, in the plane X0,Y0,X1,Y1, in the unit of the points [default: all
    /// points] [example: -1,-1,0,1,1,2]
    #[arg(
        long = "box",
        value_name = "CORNERS",
        value_delimiter = ',',
        allow_hyphen_values = true,
        help_heading = "Input"
    )]
    pub corners: Vec<f64>,
    /// Take two of the three coordinates: the points seen along the third axis, whose outline is wanted [default: all three]
    #[arg(long, value_enum, help_heading = "Input")]
    pub plane: Option<Plane>,
    /// Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D),
    /// spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the
    /// function's levels with curve and points (also as preview.svg) [example: surface.ply]
    #[arg(short, long = "output", value_name = "FILE", required_unless_present_any = ["oriented", "report"], help_heading = "Output")]
    pub output: Vec<PathBuf>,
    /// Write the input points with outward normals, confidence and which are outliers (.ply) [example: normals.ply]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub oriented: Option<PathBuf>,
    /// The axis that points up in pictures
    #[arg(long, value_enum, default_value_t = UpAxis::Y, help_heading = "Output")]
    pub up: UpAxis,
    /// Write the report, repeatable: stages, figures, topology of the result as .json, or as an .html page with pictures, plots and a
    /// view of the surface that can be turned [example: report.html]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub report: Vec<PathBuf>,
    /// Cells along the longest side of the points' bounding box on the finest level, 8 to 1024 [default: from the spacing of
    /// the points] [example: 256]
    #[arg(long, value_name = "CELLS", help_heading = "Fit")]
    pub resolution: Option<usize>,
    /// Smooth away detail below this length, in the unit of the points: twice the noise, and less than half of the thinnest wall
    /// [default: automatic] [example: 0.5]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, help_heading = "Fit")]
    pub smooth: Option<f64>,
    /// Take weight from points that lie farther off than their neighbours by about this length, in the unit of the points [default: automatic,
    /// where the noise has heavy tails] [example: 0.2]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, help_heading = "Fit")]
    pub robust: Option<f64>,
    /// Leave open what the points leave open: the result ends where they do, within about two of their spacings, and holes
    /// larger than that stay [default: everything is closed]
    #[arg(long, help_heading = "Fit")]
    pub open: bool,
    /// Room around the points in which the function is defined, at least, in the unit of the points; up to half their longest side
    /// [default: a few cells] [example: 10]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, help_heading = "Fit")]
    pub margin: Option<f64>,
    /// Degree of the B-splines, 2 to 5 [example: 2]
    #[arg(long, value_name = "DEGREE", default_value_t = 3, help_heading = "Fit")]
    pub degree: usize,
    /// How inside is told from outside
    #[arg(long, value_enum, default_value_t = Topology::Continuation, help_heading = "Fit")]
    pub topology: Topology,
    /// How the distance on the lattice is computed
    #[arg(long, value_enum, default_value_t = Distance::ClosestPoint, help_heading = "Fit")]
    pub distance: Distance,
    /// Memory to use at most: bytes, or with K, M, G or T (powers of 1024). Where more would be needed cells are coarser, with a
    /// warning [default: 70 % of what is free] [example: 4G]
    #[arg(long, value_name = "SIZE", value_parser = parse_memory, help_heading = "Running")]
    pub memory: Option<u64>,
    /// Wall-clock time for the whole run at most, in seconds: a run that is not done by then ends with exit code 6 and writes nothing
    /// more; files that it had finished stay [default: no limit] [example: 60]
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, help_heading = "Running")]
    pub time: Option<Duration>,
    /// Stop at the initial shape: no dynamic reconstruction
    #[arg(long, help_heading = "Fit")]
    pub no_refine: bool,
    /// Write the outputs even where no trustworthy surface was found, and end with exit code 0
    #[arg(long, help_heading = "Fit")]
    pub accept_doubt: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Normals {
    /// As if there were none
    Ignore,
    /// The search begins with them, and ends there if winding numbers agree; wrong ones are put right
    Hint,
    /// They decide which side of the surface each point is seen from, right or wrong
    Trust,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Plane {
    /// x and y
    Xy,
    /// x and z
    Xz,
    /// y and z
    Yz,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Topology {
    /// Eigenvector, then continuation in the exponent p
    Continuation,
    /// The paper's section 3 as written
    Paper,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Distance {
    /// Sweeping that carries the nearest sample
    ClosestPoint,
    /// The paper's Godunov scheme
    Godunov,
    /// A search per node
    Exact,
}

#[derive(Args)]
pub struct Eval {
    /// A spline saved by reconstruct (.npz)
    pub spline: PathBuf,
    /// Where to evaluate: a points file of the same dimension, or - for standard input
    pub points: PathBuf,
    /// The format of the points, whatever the extension; needed for standard input [example: xyz]
    #[arg(long, value_name = "EXTENSION", value_parser = format_parser(), hide_possible_values = true)]
    pub format: Option<PointFormat>,
    /// Add the signed distance from the curve or surface, in the unit of the points: right at any distance, and outside the
    /// function's box too. It takes the time of an extraction
    #[arg(long)]
    pub distance: bool,
    /// Memory to use at most for that: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]
    #[arg(long, value_name = "SIZE", value_parser = parse_memory, requires = "distance")]
    pub memory: Option<u64>,
    /// Where to write: .csv or .npy, one row per point [example: values.csv]
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

#[derive(Args)]
pub struct Mesh {
    /// A spline saved by reconstruct (.npz)
    pub spline: PathBuf,
    /// Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// At least this many cells along the longest side of the function's box, 2 to 4096, and more where its own cells are
    /// smaller. Time and memory grow with the square [default: 96] [example: 512]
    #[arg(long, value_name = "CELLS")]
    pub resolution: Option<usize>,
    /// Memory to use at most: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]
    #[arg(long, value_name = "SIZE", value_parser = parse_memory)]
    pub memory: Option<u64>,
    /// Extract f = VALUE in place of f = 0, in the unit of the points: positive values lie outside, negative inside. Near the surface
    /// f is close to the distance from it, so that small values give offset surfaces; farther away it is not a distance [example:
    /// 0.5]
    #[arg(long, value_name = "VALUE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub iso: f64,
}

#[derive(Args)]
pub struct Field {
    /// A spline saved by reconstruct (.npz)
    pub spline: PathBuf,
    /// Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Distance between neighbouring nodes, in the unit of the points [default: as --cells says] [example: 0.1]
    #[arg(long, value_name = "LENGTH", conflicts_with = "cells")]
    pub spacing: Option<f64>,
    /// Cells along the longest side of the function's box [default: the function's own finest ones, at most 512]
    /// [example: 256]
    #[arg(long, value_name = "CELLS")]
    pub cells: Option<usize>,
}

#[derive(Args)]
pub struct Render {
    /// A spline saved by reconstruct (.npz)
    pub spline: PathBuf,
    /// Where to write, repeatable: .png, in 2D also .svg [example: view.png]
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Points to be drawn too: a points file of the same dimension, or - for standard input. Of more than 20000 some
    /// [default: none] [example: scan.ply]
    #[arg(long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// The format of the points, whatever the extension; needed for standard input [example: xyz]
    #[arg(long, value_name = "EXTENSION", value_parser = format_parser(), hide_possible_values = true)]
    pub format: Option<PointFormat>,
    /// From which direction a surface is seen: from the surface towards the viewer [default: from the front, the right and above]
    /// [example: 1,0.5,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true)]
    pub view: Option<[f64; 3]>,
    /// The axis that points up in the picture of a surface
    #[arg(long, value_enum, default_value_t = UpAxis::Y)]
    pub up: UpAxis,
    /// Pixels of the picture; that of a plane function has its shape, and is as large as there is room [example: 1200x900]
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "800x800")]
    pub size: Size,
    /// Draw f = VALUE in place of f = 0, in the unit of the points [example: 0.5]
    #[arg(long, value_name = "VALUE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub iso: f64,
}

/// The axis that points up.
#[derive(Clone, Copy, ValueEnum)]
pub enum UpAxis {
    /// As in most models: seen from the front, z points at the viewer
    Y,
    /// As in most maps and machines: seen from the front, y points away
    Z,
}

impl From<UpAxis> for Up {
    fn from(axis: UpAxis) -> Self {
        match axis {
            UpAxis::Y => Self::Y,
            UpAxis::Z => Self::Z,
        }
    }
}

fn parse_direction(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let usable =
        text.split(',').count() == 3 && numbers.iter().all(|c| c.is_finite()) && numbers.iter().any(|c| *c != 0.0);
    let direction = numbers.try_into().ok().filter(|_| usable);
    direction.ok_or_else(|| "three numbers are needed that are not all zero, such as 1,0.5,1".into())
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds
        .filter(|time| !time.is_zero())
        .ok_or_else(|| "a positive number of seconds is needed, such as 60 or 0.5".into())
}

fn parse_memory(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let number = text.trim_end_matches(|c: char| !c.is_ascii_digit());
    let power = match text[number.len()..].trim_start().to_ascii_uppercase().trim_end_matches('B').trim_end_matches('I')
    {
        "" => Some(0),
        "K" => Some(1),
        "M" => Some(2),
        "G" => Some(3),
        "T" => Some(4),
        _ => None,
    };
    let bytes = power.and_then(|power| number.parse::<f64>().ok().map(|number| number * 1024.0_f64.powi(power)));
    bytes
        .filter(|bytes| (1.0..=u64::MAX as f64).contains(bytes))
        .map(|bytes| bytes as u64)
        .ok_or_else(|| "a number of bytes is needed, or one with K, M, G or T, such as 800M or 1.5G".into())
}

fn parse_size(text: &str) -> Result<Size, String> {
    let size = text
        .split_once('x')
        .and_then(|(width, height)| Some(Size { width: width.parse().ok()?, height: height.parse().ok()? }));
    size.ok_or_else(|| "width and height are needed, such as 800x600".into())
}

#[derive(Args)]
pub struct Info {
    /// A points file or a spline (.npz), or - for points on standard input
    pub file: PathBuf,
    /// The format of the points, whatever the extension; needed for standard input [example: xyz]
    #[arg(long, value_name = "EXTENSION", value_parser = format_parser(), hide_possible_values = true)]
    pub format: Option<PointFormat>,
}

#[derive(Args)]
pub struct Completions {
    /// The shell
    pub shell: Shell,
}

#[derive(Args)]
pub struct Man {
    /// Where to write all pages, as .1 files; made if it is not there [default: standard output, the main page]
    #[arg(value_name = "FOLDER")]
    pub folder: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// Where an option has a list of values they are examples enough.
    #[test]
    fn every_option_has_an_example_that_is_right_and_a_default() {
        let program = Arguments::command();
        let mut options = 0;
        for command in program.get_subcommands() {
            let free = |arg: &&clap::Arg| {
                arg.get_action().takes_values() && arg.get_value_parser().possible_values().is_none()
            };
            for arg in command.get_opts().filter(free) {
                let help = arg.get_help().unwrap().to_string();
                let name = format!("{} --{}: {help}", command.get_name(), arg.get_long().unwrap());
                let (_, example) = help.split_once("[example: ").expect(&name);
                let example = example.strip_suffix(']').expect(&name);
                let is_path = arg.get_value_names().unwrap()[0] == "FILE";
                assert!(is_path || help.contains("[default: ") || !arg.get_default_values().is_empty(), "{name}");
                let given = [format!("--{}", arg.get_long().unwrap()), example.to_owned()];
                let others: &[&str] = match command.get_name() {
                    "reconstruct" => &["points.xyz", "-o", "a.ply"],
                    "eval" if arg.get_id() == "memory" => &["a.npz", "points.xyz", "-o", "a.csv", "--distance"],
                    "eval" => &["a.npz", "points.xyz"],
                    "info" => &["points.xyz"],
                    _ => &["a.npz"],
                };
                let output: &[&str] = match (command.get_name(), arg.get_id().as_str()) {
                    (_, "output") | ("reconstruct" | "info", _) | ("eval", "memory") => &[],
                    _ => &["-o", "a.ply"],
                };
                let start = ["zeroset", command.get_name()].into_iter().map(str::to_owned);
                let rest = others.iter().chain(output).map(|text| (*text).to_owned());
                let parsed = Arguments::try_parse_from(start.chain(given).chain(rest));
                assert!(parsed.is_ok(), "{name}: {}", parsed.err().unwrap());
                options += 1;
            }
        }
        assert!(options > 20, "{options}");
    }

    #[test]
    fn sizes_of_memory() {
        let sizes = ["123456", "800M", "1.5G", "4GiB", "2 kB", "1t"].map(|text| parse_memory(text).unwrap());
        assert_eq!(sizes, [123_456, 800 << 20, 3 << 29, 4 << 30, 2048, 1 << 40]);
        for text in ["", "0", "-1G", "G", "1X", "nan", "inf", "1e400", "1G2"] {
            assert!(parse_memory(text).is_err(), "{text}");
        }
    }
}
