//! The figures redone as pictures.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use ndarray::ArrayD;
use zeroset::bspline::Spline;
use zeroset::isosurface::{self, LatticeSamples};
use zeroset::{Domain, gefm};

use super::cases::{Case, curve, surface};
use super::picture::{BLACK, Picture, View, diverging};

/// Side of the square pictures of curves.
const SIDE: usize = 360;

pub fn write(root: &Path, folder: &Path, page: &mut String) -> Result<()> {
    page.push_str(
        "## Figures\n\nCurves: the function as a coloured field (blue inside, red outside, full colour at a tenth of the longest side, \
         bands of a hundredth), its zero curve in black, the points as dots. Our own outlines stand in for the paper's, which are not \
         published.\n\n",
    );
    let one = curve(root, "star.xy")?;
    let domain = one.domain();
    points(&one, &domain)?.save(&folder.join("fig1a.png"))?;
    for iteration in [1, 2] {
        let f_hat = gefm_iterations(&one, &domain, iteration)?;
        field(&one, &domain, &f_hat)?.save(&folder.join(format!("fig1{}.png", ["b", "c"][iteration - 1])))?;
    }
    row(
        page,
        "Fig. 1: generalized eigenvector fitting: points, after iteration 1, after iteration 2",
        &["fig1a", "fig1b", "fig1c"],
    )?;

    let two = curve(root, "hook.xy")?;
    let domain = two.domain();
    points(&two, &domain)?.save(&folder.join("fig2a.png"))?;
    let eigenvector = gefm_iterations(&two, &domain, 10)?;
    field(&two, &domain, &eigenvector)?.save(&folder.join("fig2b.png"))?;
    row(
        page,
        "Fig. 2: points and the function of the eigenvector fit, flat over most of the box",
        &["fig2a", "fig2b"],
    )?;

    let three = curve(root, "horse.xy")?;
    let wide = three.domain();
    points(&three, &wide)?.save(&folder.join("fig3a.png"))?;
    field(&three, &wide, &improperly_tagged(&three, &wide)?)?.save(&folder.join("fig3b.png"))?;
    row(
        page,
        "Fig. 3: points, and the distance with a sign from flooding the cells without points: it leaks between the samples",
        &["fig3a", "fig3b"],
    )?;

    field(&two, &domain, &synthesized(&two, &domain)?)?.save(&folder.join("fig4b.png"))?;
    row(page, "Fig. 4: the same points by the synthesized scheme (compare Fig. 2)", &["fig2a", "fig4b"])?;
    let (flat, steep) = (slope(&two, &domain, &eigenvector), slope(&two, &domain, &synthesized(&two, &domain)?));
    writeln!(
        page,
        "Share of the box in which ‖∇f‖ is below a quarter of its mean at the points: Fig. 2 {:.0} %, Fig. 4 {:.0} %. The first \
         function is flat where the second keeps the slope of a distance.\n",
        100.0 * flat,
        100.0 * steep
    )?;
    field(&three, &wide, &synthesized(&three, &wide)?)?.save(&folder.join("fig5b.png"))?;
    row(page, "Fig. 5: the points of Fig. 3 by the synthesized scheme", &["fig3a", "fig5b"])?;

    for (number, file, up, name) in [(6, "double_torus.ply", 2, "double torus"), (7, "teapot.ply", 2, "teapot")] {
        let case = surface(root, file)?;
        let domain = case.domain();
        let f_hat = gefm_with(&case, &domain, gefm::Options::default())?;
        let initial = case.synthesized(&f_hat, &domain, 2)?;
        let view = View::around(&case.points, up, 30.0, 35.0, 640, 480);
        let mut dots = Picture::new(640, 480);
        view.points(&mut dots, &case.points, false);
        dots.save(&folder.join(format!("fig{number}a.png")))?;
        let axes = domain.nodes(2);
        let samples = LatticeSamples::new(axes.clone(), initial.sample(&axes, [0; 3]))?;
        let (mesh, _) = isosurface::surface(&samples, Some(&initial), &isosurface::Options::default())?;
        let mut shape = Picture::new(640, 480);
        view.mesh(&mut shape, &mesh.vertices, &mesh.normals, &mesh.triangles);
        view.points(&mut shape, &case.points, true);
        shape.save(&folder.join(format!("fig{number}b.png")))?;
        let (a, b) = (format!("fig{number}a"), format!("fig{number}b"));
        row(page, &format!("Fig. {number}: {name}: points, initial surface by the synthesized scheme"), &[&a, &b])?;
    }
    Ok(())
}

fn row(page: &mut String, caption: &str, pictures: &[&str]) -> Result<()> {
    for picture in pictures {
        write!(page, "<img src=\"{picture}.png\" width=\"320\" alt=\"{picture}\"> ")?;
    }
    writeln!(page, "\n\n{caption}.\n")?;
    Ok(())
}

fn gefm_with<const D: usize>(case: &Case<D>, domain: &Domain<D>, settings: gefm::Options) -> Result<Spline<D>> {
    let options = case.gefm_options(domain, settings);
    Ok(gefm::fit(&case.points, &case.spacing.areas, &domain.knots(3, 0)?, &options)?.0)
}

/// Section 3 as written, so many iterations.
fn gefm_iterations(case: &Case<2>, domain: &Domain<2>, iterations: usize) -> Result<Spline<2>> {
    let mut options = gefm::Options::paper();
    options.eigenvector.most_iterations = iterations;
    gefm_with(case, domain, options)
}

fn synthesized(case: &Case<2>, domain: &Domain<2>) -> Result<Spline<2>> {
    case.synthesized(&gefm_with(case, domain, gefm::Options::default())?, domain, 1)
}

/// What tagging gives that knows only the lattice: outside is what a flood from the corner of the box reaches without
/// entering a node that has a point within half a cell.
fn improperly_tagged(case: &Case<2>, domain: &Domain<2>) -> Result<Spline<2>> {
    let halvings = 1;
    let nodes = domain.nodes(halvings);
    let cell = domain.spacing(halvings);
    let shape = domain.cells(halvings).map(|cells| cells + 1);
    let lattice = zeroset::eikonal_sweep::Lattice::new(domain.lower, cell, shape)?;
    let distance = case.godunov(&lattice)?;
    let mut outside = ArrayD::from_elem(distance.raw_dim(), false);
    let mut front = vec![[0usize, 0usize]];
    outside[[0, 0].as_slice()] = true;
    while let Some([i, j]) = front.pop() {
        for [a, b] in [[i.wrapping_sub(1), j], [i + 1, j], [i, j.wrapping_sub(1)], [i, j + 1]] {
            let Some(&d) = distance.get([a, b].as_slice()) else { continue };
            if d > 0.5 * cell && !outside[[a, b].as_slice()] {
                outside[[a, b].as_slice()] = true;
                front.push([a, b]);
            }
        }
    }
    let phi = ArrayD::from_shape_fn(distance.raw_dim(), |i| if outside[&i] { distance[&i] } else { -distance[&i] });
    case.least_squares(&phi, &nodes, &domain.knots(3, halvings)?, cell)
}

/// From frame to picture coordinates, and back.
struct Window {
    lower: [f64; 2],
    size: f64,
}

impl Window {
    fn of(domain: &Domain<2>) -> Self {
        let extent: [f64; 2] = std::array::from_fn(|axis| domain.cells[axis] as f64 * domain.spacing);
        let size = extent[0].max(extent[1]);
        let lower = std::array::from_fn(|axis| domain.lower[axis] - 0.5 * (size - extent[axis]));
        Self { lower, size }
    }

    fn place(&self, p: &[f64; 2]) -> [f64; 2] {
        let scale = SIDE as f64 / self.size;
        [(p[0] - self.lower[0]) * scale, SIDE as f64 - (p[1] - self.lower[1]) * scale]
    }

    fn position(&self, x: f64, y: f64) -> [f64; 2] {
        let scale = self.size / SIDE as f64;
        [self.lower[0] + x * scale, self.lower[1] + (SIDE as f64 - y) * scale]
    }
}

fn points(case: &Case<2>, domain: &Domain<2>) -> Result<Picture> {
    let window = Window::of(domain);
    let mut picture = Picture::new(SIDE, SIDE);
    for point in &case.points {
        let [x, y] = window.place(point);
        picture.disc(x, y, 1.5, BLACK);
    }
    Ok(picture)
}

fn field(case: &Case<2>, domain: &Domain<2>, f: &Spline<2>) -> Result<Picture> {
    let window = Window::of(domain);
    let mut picture = Picture::new(SIDE, SIDE);
    picture.fill(|x, y| {
        let value = f.value(&window.position(x, y));
        if value.is_nan() { [1.0; 3] } else { diverging(10.0 * value) }
    });
    for point in &case.points {
        let [x, y] = window.place(point);
        picture.disc(x, y, 1.1, [0.35, 0.35, 0.38]);
    }
    let axes = domain.nodes(2);
    let samples = LatticeSamples::new(axes.clone(), f.sample(&axes, [0; 2]))?;
    let (curves, _) = isosurface::curve(&samples, Some(f), &isosurface::Options::default())?;
    for closed in &curves.loops {
        for (from, to) in closed.iter().zip(closed.iter().cycle().skip(1)) {
            picture.line(window.place(from), window.place(to), 1.6, BLACK);
        }
    }
    Ok(picture)
}

/// Share of the box in which the gradient is below a quarter of its mean at the points.
fn slope(case: &Case<2>, domain: &Domain<2>, f: &Spline<2>) -> f64 {
    let length = |p: &[f64; 2]| {
        let gradient = f.value_and_gradient(p).1;
        gradient[0].hypot(gradient[1])
    };
    let mean = case.points.iter().map(length).sum::<f64>() / case.points.len() as f64;
    let axes = domain.nodes(2);
    let count = axes[0].len() * axes[1].len();
    let flat = axes[0].iter().flat_map(|&x| axes[1].iter().map(move |&y| [x, y])).filter(|p| length(p) < 0.25 * mean);
    flat.count() as f64 / count as f64
}
