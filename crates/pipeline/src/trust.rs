//! Whether the result can be trusted.

use zeroset_bspline::{KnotVector, Spline};
use zeroset_gefm::Referee;

use crate::error::ReconstructError;
use crate::report::TrustReport;
use crate::spacing::Spacing;

/// A score above this is no orientation that anybody should rely on: right ones reached 0.25 at the worst (noise of 2 %),
/// wrong ones scored 0.35 and more.
const NO_TRUST: f64 = 0.35;
/// Above this, some part is probably on the wrong side.
const SOME_DOUBT: f64 = 0.24;
/// `|W − ½|` at a point from which its side is unsure: W is nearer to what it would be a full sheet away.
const UNSURE: f64 = 0.4;

/// What winding numbers say of the final function.
pub fn judge<const D: usize>(
    f: &Spline<D>,
    points: &[[f64; D]],
    spacing: &Spacing,
    knots: &[KnotVector; D],
) -> Result<TrustReport, ReconstructError> {
    let referee = Referee::new(points, &spacing.areas, spacing.typical, spacing.density, knots)?;
    let (judgement, winding) = referee.judge(f)?;
    let unsure = winding.iter().filter(|w| (**w - 0.5).abs() > UNSURE).count() as f64 / winding.len() as f64;
    Ok(TrustReport { judgement, unsure })
}

/// The warning, if there is some doubt, or the doubt, if there is no trust.
pub fn verdict(trust: &TrustReport) -> (Option<String>, Option<String>) {
    let (score, unsure) = (trust.judgement.score, 100.0 * trust.unsure);
    let advice =
        "try --smooth with a length above the noise but below half the thinnest wall, or a denser or cleaner scan";
    if score > NO_TRUST {
        let doubt = format!(
            "no trustworthy closed surface was found: winding numbers contradict the sides of the points (score \
             {score:.2}, {unsure:.0} % of the points unsure); {advice}"
        );
        return (None, Some(doubt));
    }
    let warning = (score > SOME_DOUBT).then(|| {
        format!("some points are probably on the wrong side (score {score:.2}, {unsure:.0} % of the points unsure): {advice}")
    });
    (warning, None)
}
