//! What the ladder may try, and when it is content.

use zeroset_watch::CancelToken;

/// Normals that are known from elsewhere, `N × D`, one per point: outward up to a common sign, of any length; zero where there is
/// none.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum KnownNormals<const D: usize> {
    /// There are none.
    #[default]
    None,
    /// Where the continuation begins first: at p = 1, so that what is wrong among them is put right; the eigenvector is sought
    /// only if the referee is not content with that.
    Hint(Vec<[f64; D]>),
    /// What every candidate is fitted to; the referee chooses the length, and the lattice.
    Trust(Vec<[f64; D]>),
}

impl<const D: usize> KnownNormals<D> {
    /// The normals, if there are any.
    pub fn vectors(&self) -> Option<&[[f64; D]]> {
        match self {
            Self::None => None,
            Self::Hint(normals) | Self::Trust(normals) => Some(normals),
        }
    }
}

/// Settings of candidates whose fairness is of third order, on lattices or with unit normals: for few points, of which that of second order
/// makes no thin parts.
#[derive(Debug, Clone, PartialEq)]
pub struct ThirdOrderOptions {
    /// Their smoothing lengths, in spacings.
    pub ratios: Vec<f64>,
    /// They are tried where no other candidate scores less, without what noise adds.
    pub above: f64,
    /// Width of the cells on whose nodes the sign is to be read afterwards, frame units: what they do not hold is not taken. Of a flat sheet
    /// third order makes a wall as thin as the noise.
    pub cell: f64,
}

impl ThirdOrderOptions {
    /// The defaults for cells of a width.
    pub fn new(cell: f64) -> Self {
        Self { ratios: vec![0.4, 0.2, 0.1], above: 0.2, cell }
    }
}

/// Settings of [`climb`](crate::climb).
#[derive(Debug, Clone, PartialEq)]
pub struct LadderOptions<const D: usize> {
    /// Spacing s of the points, frame units.
    pub spacing: f64,
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D, in frame units.
    pub density: f64,
    /// Detail that is wanted, frame units: lattices are climbed to until all points are about as near to the zero set. The
    /// spacing, unless the points are a part of more.
    pub detail: f64,
    /// Smoothing lengths that may be tried, in spacings, ascending.
    pub ratios: Vec<f64>,
    /// The first to be tried; then longer ones as long as that helps, or else shorter ones.
    pub likeliest: f64,
    /// The first lattice: so many halvings of the base lattice.
    pub first: u32,
    /// The last lattice that may be climbed to.
    pub last: u32,
    /// No further lengths are tried once a candidate scores less.
    pub content: f64,
    /// Above this score of the best candidate the eigenvector is sought again on the next lattice.
    pub doubtful: f64,
    /// Above this score of the best candidate no further lattice is climbed to.
    pub hopeless: f64,
    /// Whether the surface may end where the points do, so that the score may say nothing of it: then what no point lies off, and is found
    /// again from scratch, needs no other length.
    pub open: bool,
    /// Whether candidates from scratch may begin with the directions in which the points push each other away
    /// ([`Referee::repulsion`](crate::Referee::repulsion)), in space and not for open surfaces, where the sides of those that begin with the
    /// eigenvector are about random.
    pub repulsion: bool,
    /// Candidates whose fairness is of third order, if there are to be any.
    pub third_order: Option<ThirdOrderOptions>,
    /// Relative residual of the solves on finer lattices.
    pub tolerance: f64,
    /// What is known of the normals.
    pub normals: KnownNormals<D>,
    /// Looked at before every iteration of the continuation; a cancelled ladder ends with
    /// [`GefmError::Cancelled`](crate::GefmError::Cancelled).
    pub cancel: CancelToken,
}

impl<const D: usize> LadderOptions<D> {
    /// The defaults for points with spacing `spacing` and density `density`.
    pub fn new(spacing: f64, density: f64) -> Self {
        Self {
            spacing,
            density,
            detail: spacing,
            ratios: vec![0.2, 0.4, 0.8, 1.6, 3.2, 6.4],
            likeliest: 0.4,
            first: 1,
            last: 3,
            content: 0.1,
            doubtful: 0.25,
            hopeless: f64::INFINITY,
            open: false,
            repulsion: true,
            third_order: None,
            tolerance: 1e-3,
            normals: KnownNormals::None,
            cancel: CancelToken::new(),
        }
    }

    /// With this smoothing length, frame units, as the first to be tried and the longest: what is no thicker than twice that may be
    /// welded, what is thicker may not. It is no shorter than the likeliest, beside which shorter ones are tried as always.
    #[must_use]
    pub fn up_to(mut self, length: f64) -> Self {
        let ratio = length / self.spacing;
        if ratio > self.likeliest {
            self.likeliest = ratio;
        }
        let longest = self.likeliest;
        self.ratios.retain(|shorter| *shorter < longest);
        self.ratios.push(longest);
        self
    }

    /// The weight of the thin-plate energy for a smoothing length of `ratio` spacings.
    pub(crate) fn weight(&self, ratio: f64) -> f64 {
        self.density * (ratio * self.spacing).powi(3)
    }

    /// The weight of `∫‖∇³f‖²` for the same.
    pub(crate) fn third_order_weight(&self, ratio: f64) -> f64 {
        self.density * (ratio * self.spacing).powi(5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_length_that_is_wanted_comes_first_and_is_the_longest() {
        let up_to = |length: f64| {
            let LadderOptions { ratios, likeliest, .. } = LadderOptions::<3>::new(0.5, 4.0).up_to(length);
            (ratios, likeliest)
        };
        assert_eq!(up_to(0.5), (vec![0.2, 0.4, 0.8, 1.0], 1.0));
        assert_eq!(up_to(0.4), (vec![0.2, 0.4, 0.8], 0.8));
        assert_eq!(up_to(10.0), (vec![0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 20.0], 20.0));
        // Where the points part walls they do so at the likeliest length, or a shorter one.
        assert_eq!(up_to(0.1), (vec![0.2, 0.4], 0.4));
    }
}
