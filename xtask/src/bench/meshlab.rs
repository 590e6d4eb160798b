//! MeshLab's normals and screened Poisson reconstruction on the same points, where an interpreter has pymeshlab.

use std::path::Path;
use std::process::Command;

use super::run::{Program, median, timed};
use crate::compare::process::Usage;

/// Default settings but for the depth, file to file.
const SCRIPT: &str = "\
import sys, pymeshlab
meshes = pymeshlab.MeshSet()
meshes.load_new_mesh(sys.argv[1])
meshes.compute_normal_for_point_clouds()
meshes.generate_surface_reconstruction_screened_poisson(depth=8)
meshes.save_current_mesh(sys.argv[2])
";

/// The interpreter, or why there is none.
pub struct MeshLab<'a> {
    python: &'a Path,
    pub missing: bool,
}

impl<'a> MeshLab<'a> {
    /// Looks whether pymeshlab can be imported.
    pub fn new(python: &'a Path) -> Self {
        let found =
            Command::new(python).args(["-c", "import pymeshlab"]).output().is_ok_and(|out| out.status.success());
        if !found {
            eprintln!("MeshLab is left out: {} cannot import pymeshlab", python.display());
        }
        Self { python, missing: !found }
    }

    /// Times it as often as the program; nothing if it fails.
    pub fn time(&self, program: &Program, input: &Path) -> Option<Usage> {
        if self.missing {
            return None;
        }
        let mut runs: Vec<Usage> = Vec::with_capacity(program.repeat);
        for _ in 0..program.repeat {
            let mut command = Command::new(self.python);
            command.args(["-c", SCRIPT]).arg(input).arg(program.work.join("meshlab.ply"));
            let peak = runs.last().and_then(|usage| usage.peak);
            match timed(&mut command, &program.work.join("meshlab.txt"), peak) {
                Ok(usage) => runs.push(usage),
                Err(error) => {
                    eprintln!("MeshLab: {error:#}");
                    return None;
                }
            }
        }
        let over = |figure: fn(&Usage) -> Option<f64>| runs.iter().map(figure).collect::<Option<_>>().map(median);
        Some(Usage { wall: over(|u| Some(u.wall))?, cpu: over(|u| u.cpu), peak: over(|u| u.peak) })
    }
}
