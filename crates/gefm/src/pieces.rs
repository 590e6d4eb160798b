//! Pieces of a curve, and which of them winding numbers would have the other way round.
//!
//! Random points of a curve leave gaps of several spacings, and each cuts it in two: with ℓ far below a gap the energy hardly couples the pieces on
//! both sides, so that any of them may come out the other way round than the rest, whatever its length, and p = 1 cannot leave that. Winding
//! numbers couple all with all. Their sum over the points is linear in the normals, piece by piece; so what W would be with some pieces turned
//! round is known without another fit.

use zeroset_watch::CancelToken;

use crate::error::GefmError;
use crate::gradient_form::area_vectors;
use crate::lanczos::dot;
use crate::patches::Patches;
use crate::referee::Referee;

/// Neighbours are in one piece if the cosine between their normals is at least this,
const AGREED: f64 = 0.5;
/// and the sines between what joins them and the tangents are no more than this: where a normal turns over from point to point it points along the
/// curve on its way.
const ACROSS: f64 = 0.6;
/// So many of the largest pieces may be turned.
const MOST: usize = 64;
/// Turning a piece must bring the mean of `|W − ½|` down by more than this.
const LEAST_GAIN: f64 = 1e-4;
/// Pieces are turned together, rather than one by one, if less than this share of the error is left then: it hardly tells of small pieces.
const BETTER: f64 = 0.9;
/// The tabu search takes so many steps for each piece,
const STEPS: usize = 100;
/// and one that was turned stays for so many steps, or a third as many as there are pieces.
const STAY: usize = 10;

/// The points of each piece of at least a patch of `points` with `normals` of any length, most points first.
pub(crate) fn pieces<const D: usize>(points: &[[f64; D]], normals: &[[f64; D]], patches: &Patches) -> Vec<Vec<usize>> {
    let units = area_vectors(normals, &vec![1.0; normals.len()]);
    let is_link = |i: usize, j: usize| {
        let between: [f64; D] = std::array::from_fn(|axis| points[j][axis] - points[i][axis]);
        let across = dot(&between, &units[i]).abs().max(dot(&between, &units[j]).abs());
        dot(&units[i], &units[j]) >= AGREED && across <= ACROSS * dot(&between, &between).sqrt()
    };
    let mut links = vec![vec![]; points.len()];
    for (i, around) in patches.around().enumerate() {
        for j in around.iter().map(|j| *j as usize).filter(|j| *j != i && is_link(i, *j)) {
            links[i].push(j);
            links[j].push(i);
        }
    }
    let mut seen = vec![false; points.len()];
    let mut pieces: Vec<Vec<usize>> = vec![];
    for first in 0..points.len() {
        let mut piece = vec![];
        let mut next = vec![first];
        while let Some(i) = next.pop() {
            if !std::mem::replace(&mut seen[i], true) {
                piece.push(i);
                next.extend(&links[i]);
            }
        }
        if piece.len() >= patches.least() {
            pieces.push(piece);
        }
    }
    pieces.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
    pieces
}

/// The normals along `gradients`, with those `pieces` of the points turned round that bring W nearer to ½ at the points; nothing if none does.
///
/// # Errors
/// If gradients are not finite, or this was cancelled.
pub(crate) fn turned<const D: usize>(
    referee: &Referee<D>,
    gradients: &[[f64; D]],
    pieces: &[Vec<usize>],
    cancel: &CancelToken,
) -> Result<Option<Vec<[f64; D]>>, GefmError> {
    let pieces = &pieces[..pieces.len().min(MOST)];
    if pieces.len() < 2 {
        return Ok(None);
    }
    let areas = referee.areas();
    let mut normals = area_vectors(gradients, areas);
    let of_piece = |piece: &Vec<usize>| {
        cancel.check()?;
        let mut alone = vec![[0.0; D]; normals.len()];
        piece.iter().for_each(|i| alone[*i] = normals[*i]);
        referee.winding(&alone)
    };
    let shares: Vec<Vec<f64>> = pieces.iter().map(of_piece).collect::<Result<_, _>>()?;
    let beside = referee.winding(&normals)?.iter().map(|w| w - 0.5).collect();
    let sum = Sum { beside, shares, areas, area: areas.iter().sum() };
    let as_it_is = vec![false; pieces.len()];
    let (first, one_by_one) = (sum.error(&as_it_is), sum.descend(as_it_is.clone()));
    let together = sum.descend(sum.least_square());
    let (least, is_turned) = if together.0 < BETTER * one_by_one.0 { together } else { one_by_one };
    if least > first - LEAST_GAIN {
        return Ok(None);
    }
    let turned = pieces.iter().zip(&is_turned).filter(|(_, is_turned)| **is_turned);
    turned.flat_map(|(piece, _)| piece).for_each(|i| normals[*i] = normals[*i].map(|x| -x));
    Ok(Some(normals))
}

/// W at the points, as a sum over pieces.
struct Sum<'a> {
    /// W − ½ with no piece turned.
    beside: Vec<f64>,
    /// What each piece adds to it.
    shares: Vec<Vec<f64>>,
    areas: &'a [f64],
    /// Their sum.
    area: f64,
}

impl Sum<'_> {
    fn mean(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.areas.iter().enumerate().map(|(i, area)| area * of(i)).sum::<f64>() / self.area
    }

    /// W − ½ with some pieces turned round.
    fn beside(&self, is_turned: &[bool]) -> Vec<f64> {
        let mut beside = self.beside.clone();
        for (share, _) in self.shares.iter().zip(is_turned).filter(|(_, is_turned)| **is_turned) {
            beside.iter_mut().zip(share).for_each(|(w, share)| *w -= 2.0 * share);
        }
        beside
    }

    /// The mean of |W − ½| with some pieces turned round.
    fn error(&self, is_turned: &[bool]) -> f64 {
        let beside = self.beside(is_turned);
        self.mean(|i| beside[i].abs())
    }

    /// The error, and which pieces are turned, after turning one piece after the other, or back, the best first.
    fn descend(&self, mut is_turned: Vec<bool>) -> (f64, Vec<bool>) {
        let mut least = self.error(&is_turned);
        loop {
            let beside = self.beside(&is_turned);
            let after = |piece: usize| {
                let (share, twice) = (&self.shares[piece], if is_turned[piece] { 2.0 } else { -2.0 });
                self.mean(|i| (beside[i] + twice * share[i]).abs())
            };
            let errors = (0..is_turned.len()).map(|piece| (after(piece), piece));
            match errors.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((error, piece)) if error < least - LEAST_GAIN => {
                    is_turned[piece] ^= true;
                    least = error;
                }
                _ => return (least, is_turned),
            }
        }
    }

    /// Those pieces that are turned where the mean of (W − ½)², a quadratic form in the signs of the pieces, is least, as far as a tabu search
    /// (Glover 1989) finds: pieces that have to be turned together, when to turn any of them alone is worse, stop one that only descends.
    fn least_square(&self) -> Vec<bool> {
        let count = self.shares.len();
        let product = |a: &[f64], b: &[f64]| self.mean(|i| a[i] * b[i]);
        let gram: Vec<Vec<f64>> =
            self.shares.iter().map(|a| self.shares.iter().map(|b| product(a, b)).collect()).collect();
        // Half of the slope of the form along each sign.
        let mut slopes: Vec<f64> = self.shares.iter().map(|share| product(share, &self.beside)).collect();
        let mut error = product(&self.beside, &self.beside);
        let (mut signs, mut stays) = (vec![1.0; count], vec![0; count]);
        let (mut least, mut best) = (error, signs.clone());
        for step in 0..STEPS * count {
            let after = |piece: usize| error - 4.0 * signs[piece] * slopes[piece] + 4.0 * gram[piece][piece];
            let may = |piece: &usize| stays[*piece] <= step || after(*piece) < least;
            let Some(piece) = (0..count).filter(may).min_by(|a, b| after(*a).total_cmp(&after(*b))) else { break };
            error = after(piece);
            slopes.iter_mut().zip(&gram[piece]).for_each(|(slope, with)| *slope -= 2.0 * signs[piece] * with);
            signs[piece] = -signs[piece];
            stays[piece] = step + 1 + STAY.min(count / 3);
            if error < least {
                (least, best) = (error, signs.clone());
            }
        }
        best.iter().map(|sign| *sign < 0.0).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    /// Points on a circle of radius 0.4 with a gap of ten spacings on either side of a third of them.
    fn arcs() -> (Vec<[f64; 2]>, Vec<bool>) {
        let indices = (0..300).filter(|i| !(100..110).contains(i) && !(200..210).contains(i));
        let at = |i: i32| (std::f64::consts::TAU * f64::from(i) / 300.0).sin_cos();
        indices.map(|i| (<[f64; 2]>::from(at(i)).map(|x| 0.4 * x), (110..200).contains(&i))).unzip()
    }

    const SPACING: f64 = 0.8 * std::f64::consts::PI / 300.0;

    fn found(gradients: &[[f64; 2]]) -> (Vec<usize>, Option<Vec<[f64; 2]>>) {
        let (points, _) = arcs();
        let knots = [0; 2].map(|_| KnotVector::uniform(3, -0.6, 0.1, 12).unwrap());
        let referee = Referee::new(&points, &vec![1.0; points.len()], SPACING, 1.0 / SPACING, &knots).unwrap();
        let pieces = pieces(&points, gradients, &Patches::new(&points, SPACING));
        let turned = turned(&referee, gradients, &pieces, &CancelToken::new()).unwrap();
        (pieces.iter().map(Vec::len).collect(), turned)
    }

    #[test]
    fn a_piece_the_other_way_round_is_turned() {
        let (points, is_third) = arcs();
        let gradients: Vec<[f64; 2]> =
            points.iter().zip(&is_third).map(|(p, third)| p.map(|x| if *third { -7.0 * x } else { x })).collect();
        let (sizes, turned) = found(&gradients);
        assert_eq!(sizes, [190, 90]);
        assert!(turned.unwrap().iter().zip(&points).all(|(n, p)| dot(n, p) > 0.0));
        // All inward is the larger mistake.
        let inward: Vec<[f64; 2]> = gradients.iter().map(|g| g.map(|x| -x)).collect();
        assert!(found(&inward).1.unwrap().iter().zip(&points).all(|(n, p)| dot(n, p) > 0.0));
    }

    #[test]
    fn what_is_right_is_left() {
        let (points, _) = arcs();
        assert_eq!(found(&points), (vec![190, 90], None));
    }

    #[test]
    fn pieces_that_have_to_be_turned_together_are_found() {
        // All three leave W at ½ when turned. The first alone makes it worse, with any other still worse than as it was.
        let shares = vec![vec![0.5], vec![0.5], vec![-0.9]];
        let sum = Sum { beside: vec![0.2], shares, areas: &[1.0], area: 1.0 };
        let none = vec![false; 3];
        assert_eq!(sum.descend(none.clone()).1, none);
        assert_eq!(sum.least_square(), [true; 3]);
        assert!(sum.descend(sum.least_square()).0 < 1e-15, "but for rounding");
    }

    #[test]
    fn a_normal_that_turns_over_along_the_curve_ends_a_piece() {
        // By less than a degree from point to point.
        let line: Vec<[f64; 2]> = (0..600).map(|i| [0.01 * f64::from(i), 0.0]).collect();
        let angle = |x: f64| std::f64::consts::PI * (x - 2.0).clamp(0.0, 2.0) / 2.0;
        let normals: Vec<[f64; 2]> = line.iter().map(|p| [angle(p[0]).sin(), angle(p[0]).cos()]).collect();
        let sizes: Vec<usize> = pieces(&line, &normals, &Patches::new(&line, 0.01)).iter().map(Vec::len).collect();
        // Up to an angle of arcsin 0.6, in steps of half a pi over a hundred.
        assert_eq!(sizes, [241, 240]);
    }
}
