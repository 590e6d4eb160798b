//! Whether the result can be trusted.

use zeroset_bspline::{Derivatives, Evaluation, HierarchicalSpline, KnotVector};
use zeroset_gefm::{LAYERED, Patches, Referee, layers};

use crate::error::ReconstructError;
use crate::points::frame::Frame;
use crate::points::heavy_tails::Noise;
use crate::points::spacing::{NOISY, Spacing};
use crate::report::{OffReport, TrustReport};
use crate::topology::fragile::{FragilePlace, fragile};
use crate::trust::confidence::{RegionReport, is_unsure, regions};

pub(crate) mod confidence;
pub(crate) mod gaps;
pub(crate) mod one_sided;
pub(crate) mod oriented;
pub(crate) mod volume;

/// A [score](zeroset_gefm::Judgement::beyond_noise) above this is no orientation that anybody should rely on: right ones reached 0.25 with points all over the
/// surface and 0.36 with points along curves on it, wrong ones scored 0.44 and more.
pub const NO_TRUST: f64 = 0.4;
/// Above this score some part is probably on the wrong side.
pub const SOME_DOUBT: f64 = 0.24;
/// A point does not fit if it lies farther from the zero set than this share of its spacing and than so many times the
/// median of all points.
const FAR_OFF: f64 = 0.1;
const FAR_OFF_MEDIANS: f64 = 8.0;
/// More such points than this mean walls or gaps that the points cannot tell apart; creases have fewer.
const MISFITS: f64 = 0.012;

/// At a point where ‖∇f‖ is below this share of its mean, f hardly tells inside from outside.
const FLAT: f64 = 0.3;
/// With more such points than this, handles or tunnels between close walls may be wrong.
const MANY_FLAT: f64 = 0.05;

/// What winding numbers say of the final function f at points that have a standard deviation of `noise`, and how it fits the points
/// `fitted` with their `own` spacing, by which it is judged what hangs on little too: the others may be a few of these. Where their noise has
/// heavy tails, points that lie off f alone are no misfit.
pub fn judge<const D: usize>(
    f: &HierarchicalSpline<D>,
    (fitted, own): (&[[f64; D]], &Spacing),
    (points, spacing): (&[[f64; D]], &Spacing),
    noise: f64,
    knots: &[KnotVector; D],
    frame: &Frame<D>,
) -> Result<TrustReport, ReconstructError> {
    let referee = Referee::new(points, &spacing.areas, spacing.typical, spacing.density, knots)?;
    let (judgement, winding) = referee.judge(f)?;
    let unsure = winding.iter().filter(|w| is_unsure(**w)).count() as f64 / winding.len() as f64;
    let at = f.evaluate(fitted, Derivatives::Gradient);
    let distances = at.sampson_distances();
    // Most often all points that are heard are fitted.
    let heard =
        if points == fitted { &distances } else { &f.evaluate(points, Derivatives::Gradient).sampson_distances() };
    let heavy_tails = (noise > NOISY * own.typical)
        .then(|| Noise::around(&at, fitted))
        .filter(|around| around.loss_length(&own.areas).is_some());
    Ok(TrustReport {
        score: judgement.beyond_noise(noise / spacing.typical),
        judgement,
        unsure,
        misfit: heavy_tails.map_or_else(|| misfit(&distances, own), |around| misfit(&around.shared(), own)),
        off: off(heard, points, spacing.typical, noise, frame),
        layers: layers(&distances, noise, own.typical),
        flat: flat(&at),
        fragile: fragile(f, noise, own.typical, frame),
        regions: regions(points, &winding, frame),
    })
}

/// Share of the points at which f is flat: the gradient of a distance has the same length everywhere.
fn flat<const D: usize>(at: &Evaluation<D>) -> f64 {
    let norms: Vec<f64> = at.gradients.iter().map(|g| g.iter().map(|g| g * g).sum::<f64>().sqrt()).collect();
    let mean = norms.iter().sum::<f64>() / norms.len() as f64;
    norms.iter().filter(|norm| **norm < FLAT * mean).count() as f64 / norms.len() as f64
}

fn off<const D: usize>(
    distances: &[f64],
    points: &[[f64; D]],
    spacing: f64,
    noise: f64,
    frame: &Frame<D>,
) -> OffReport {
    let patches = Patches::new(points, spacing);
    let off = patches.off(distances, noise);
    if off.len() < patches.least() {
        return OffReport { points: 0, farthest: None };
    }
    let farthest = off.iter().max_by(|a, b| distances[**a].abs().total_cmp(&distances[**b].abs()));
    OffReport { points: off.len(), farthest: farthest.map(|index| frame.to_data(&points[*index]).to_vec()) }
}

fn misfit(distances: &[f64], spacing: &Spacing) -> f64 {
    let distances: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
    let mut sorted = distances.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = FAR_OFF_MEDIANS * sorted[sorted.len() / 2];
    let off = distances.iter().zip(&spacing.local).filter(|(d, s)| **d > usual.max(FAR_OFF * **s)).count();
    off as f64 / distances.len() as f64
}

/// What the zero set is called.
pub(crate) const fn shape_name(dimension: usize) -> &'static str {
    if dimension == 2 { "curve" } else { "surface" }
}

/// The warning, if there is some doubt, or the doubt, if there is no trust. Of an `open` surface winding numbers say nothing:
/// it has no inside; nor do they contradict unit normals that have `agreed`, for of points as uneven as ask for these they are rough.
pub fn verdict<const D: usize>(trust: &TrustReport, open: bool, agreed: bool) -> (Option<String>, Option<String>) {
    let (score, unsure) = (trust.score, 100.0 * trust.unsure);
    let advice =
        "try --smooth with a length above the noise but below half the thinnest wall, or a denser or cleaner scan";
    let is_heard = !(open || agreed);
    if score > NO_TRUST && is_heard {
        let doubt = format!(
            "no trustworthy closed {} was found: winding numbers contradict the sides of the points (score {score:.2}, \
             {unsure:.0} % of the points unsure); if it is meant to end where they do, say --open; otherwise {advice}",
            shape_name(D)
        );
        return (None, Some(doubt));
    }
    if score > SOME_DOUBT && is_heard {
        let warning = format!(
            "some points are probably on the wrong side (score {score:.2}, {unsure:.0} % of the points unsure{}): {advice}",
            least_sure(&trust.regions).map_or_else(String::new, around)
        );
        return (Some(warning), None);
    }
    let misfit = (trust.misfit > MISFITS).then(|| {
        format!(
            "{:.1} % of the points lie off the result, far more than the rest: walls or gaps there are thinner than the \
             points or the cells can tell apart; try a higher --resolution, or a denser scan",
            100.0 * trust.misfit
        )
    });
    let off = trust.off.farthest.as_ref().map(|farthest| {
        format!(
            "{} points around {} lie on one side of the result together, farther off than noise explains: a hole, a gap or a thin \
             part there may have been smoothed over; try a denser or cleaner scan there",
            trust.off.points,
            place(farthest)
        )
    });
    let layered = trust.layers.filter(|layers| *layers > LAYERED).map(|_| {
        "the points lie in two layers on both sides of the result rather than around it: a thin wall may have been taken for noise; \
         if there is one, try --smooth with a length below half its thickness, or a denser scan"
            .to_owned()
    });
    let flat = (trust.flat > MANY_FLAT).then(|| {
        format!(
            "at {:.1} % of the points inside and outside are hardly told apart: walls or gaps there are too thin for the \
             sampling, and may be joined or pierced; try a denser scan",
            100.0 * trust.flat
        )
    });
    let hangs = trust.fragile.first().filter(|_| !open).map(|least| hangs_on(least, trust.fragile.len()));
    let warning = misfit.or(off).or(layered).or(flat).or(hangs);
    (warning, None)
}

/// Where most points are unsure; the least sure region may hold but a few.
fn least_sure(regions: &[RegionReport]) -> Option<&RegionReport> {
    let unsure = |region: &RegionReport| region.unsure * region.points as f64;
    regions.iter().max_by(|a, b| unsure(a).total_cmp(&unsure(b)))
}

fn around(region: &RegionReport) -> String {
    format!(", most around {}", place(&region.centre))
}

/// What a fragile place puts in doubt, the least sure one of so many.
fn hangs_on(least: &FragilePlace, count: usize) -> String {
    let what = match (least.index, least.value < 0.0) {
        (0, _) => "whether there is a separate part",
        (1, true) => "whether parts hang together",
        (1, false) => "whether parts are separate",
        (index, inside) if index < least.place.len() => {
            ["whether there is a hole", "whether a wall is whole"][usize::from(inside)]
        }
        _ => "whether there is a hollow",
    };
    format!(
        "{what} at {} hangs on less than the points can tell{}; try a denser scan there",
        place(&least.place),
        and_others(count)
    )
}

/// After one of so many places.
pub fn and_others(count: usize) -> String {
    if count > 1 { format!(" (and the like at {} other places)", count - 1) } else { String::new() }
}

/// A place in a sentence.
pub fn place(centre: &[f64]) -> String {
    let centre: Vec<String> = centre.iter().map(|x| coordinate(*x)).collect();
    format!("({})", centre.join(", "))
}

/// Four digits, whatever the unit.
fn coordinate(x: f64) -> String {
    let magnitude = x.abs().log10().floor();
    match magnitude {
        f64::NEG_INFINITY => "0".into(),
        -3.0..=5.0 => format!("{x:.*}", (3.0 - magnitude).max(0.0) as usize),
        _ => format!("{x:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::topology::fragile::tests::oval;
    use zeroset_bspline::Spline;

    #[test]
    fn what_hangs_on_little_is_judged_by_the_points_that_were_fitted() {
        let around = |count: u32| -> Vec<[f64; 2]> {
            let angle = |i| std::f64::consts::TAU * f64::from(i) / f64::from(count);
            (0..count).map(|i| [0.4 * angle(i).cos(), 0.2 * angle(i).sin()]).collect()
        };
        let (few, many) = (around(20), around(400));
        let frame = Frame { origin: [0.0; 2], scale: 1.0, sides: [1.0; 2] };
        let knots = Domain::<2>::around(&[1.0, 1.0], 32).knots(3, 0).unwrap();
        // Half a thousandth inside in the midst: a hundredth of the spacing of the few, a tenth of that of the many.
        let fragile_by = |fitted: &[[f64; 2]]| {
            let (own, spacing) = (Spacing::of(fitted), Spacing::of(&few));
            judge(&oval(0.2505), (fitted, &own), (&few, &spacing), 0.0, &knots, &frame).unwrap().fragile.len()
        };
        assert_eq!([fragile_by(&few), fragile_by(&many)], [1, 0]);
    }

    #[test]
    fn a_few_points_far_off_are_counted_and_noise_is_not() {
        let knots = KnotVector::uniform(3, -1.0, 0.1, 20).unwrap();
        // f = x, by its Greville abscissae.
        let f = Spline::from_flat(
            [knots.clone(), knots],
            (0..23 * 23).map(|flat| -1.0 + 0.1 * ((flat / 23) as f64 - 1.0)).collect(),
        )
        .unwrap();
        let line = |off: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            (0..100).map(|i| [off(i), -0.9 + 0.018 * i as f64]).collect()
        };
        let share = |points: &[[f64; 2]]| {
            misfit(&f.evaluate(points, Derivatives::Gradient).sampson_distances(), &Spacing::of(points))
        };
        assert_eq!(share(&line(&|_| 0.0)), 0.0);
        // Half a spacing off, one in twenty.
        assert_eq!(share(&line(&|i| if i % 20 == 7 { 0.009 } else { 0.0 })), 0.05);
        // All as far off as each other: noise.
        assert_eq!(share(&line(&|i| if i % 2 == 0 { 0.009 } else { -0.008 })), 0.0);
    }

    #[test]
    fn the_place_of_doubt_is_where_most_points_are_unsure() {
        let region = |x: f64, points, confidence, unsure| RegionReport {
            centre: vec![x, -0.000_123_456, 1.5e9],
            points,
            confidence,
            unsure,
        };
        let regions = [region(1.0, 2, 0.0, 1.0), region(1234.567, 100, 0.4, 0.5)];
        let found = least_sure(&regions).map(around);
        assert_eq!(found.as_deref(), Some(", most around (1235, -1.235e-4, 1.500e9)"));
        assert_eq!(coordinate(0.0123456), "0.01235");
        assert_eq!(coordinate(0.0), "0");
    }

    #[test]
    fn what_hangs_on_little_is_said_in_plain_words() {
        let at = |index, value| FragilePlace { place: vec![1.0, 2.0, 3.0], value, index };
        let said = |index, value| hangs_on(&at(index, value), 1);
        assert_eq!(
            said(1, 0.1),
            "whether parts are separate at (1.000, 2.000, 3.000) hangs on less than the points can tell; try a denser scan there"
        );
        assert!(said(1, -0.1).starts_with("whether parts hang together at"));
        assert!(said(2, -0.1).starts_with("whether a wall is whole at"));
        assert!(said(2, 0.1).starts_with("whether there is a hole at"));
        assert!(said(0, 0.1).starts_with("whether there is a separate part at"));
        assert!(said(3, 0.1).starts_with("whether there is a hollow at"));
        assert!(hangs_on(&at(0, 0.1), 3).contains("(and the like at 2 other places)"));
    }

    #[test]
    fn points_between_close_walls_are_flat() {
        let knots = KnotVector::uniform(3, -1.0, 0.1, 20).unwrap();
        let greville = |k: usize| -1.0 + 0.1 * (k as f64 - 1.0);
        // f = x³ is flat around zero: |3x²| is below 0.3 of its mean over -0.9 ≤ x ≤ 0.9, 0.81, for |x| < 0.285.
        let blossom = |k: usize| (-1..=1).map(|i| greville(k) + 0.1 * f64::from(i)).product::<f64>();
        let f =
            Spline::from_flat([knots.clone(), knots], (0..23 * 23).map(|flat| blossom(flat / 23)).collect()).unwrap();
        let points: Vec<[f64; 2]> = (0..1800).map(|i| [-0.9 + 0.001 * (f64::from(i) + 0.5), 0.0]).collect();
        // To a few points on each side: the mean over the points is not the integral.
        assert!((flat(&f.evaluate(&points, Derivatives::Gradient)) - 0.285 / 0.9).abs() < 0.01);
    }
}
