//! What is known of a candidate, and which of two is to be preferred.

use crate::noise::LEAST_NOISE;

/// A longer length is taken if its score is above that of a shorter one by no more than this share of it: under noise both
/// have the sides right, and the smoother one has fewer handles and bubbles. But in space it must not leave a patch of points behind,
/// unless the sides of the shorter one are about random.
/// (In the plane what it leaves are tips and bays, and shorter lengths part noisy curves.)
const SMOOTHER: f64 = 0.05;
/// A length below the noise over this makes sheets that follow the noise, a hollow shell or many, and the better they do the more W agrees
/// with them: then the longer length is taken as long as it does not score as random sides do, nor so many times higher. But where a length
/// fills gaps or swallows limbs, what is left of the points' distances looks like noise too, if that does not change from point to point; and
/// where it welds walls they have two values. And where the fit with the shorter length sees less than [`LEAST_NOISE`] there is none: what
/// the longer one takes for noise are the two sides of a wall.
const FOLLOWS: f64 = 0.85;
const NOISIER: f64 = 3.0;
/// Nor, on wide cells, where the shorter length sees less than the other's noise over this: a hollow shell parts normal noise into halves of
/// 0.60 of its deviation, 1/1.66; a wall four deviations thick is parted into layers of 1/2.2 of what it looks like when it is welded. (On
/// narrow cells there may be many sheets, which leave less.) Where the shorter one sees no noise, what has welded is not to lead either, whatever
/// it scores, if both are about random or the points lie on both sides of it: finer cells can put right a shell that is torn, not one that is
/// welded, and for W a closed shell without its inner side is as good as with it.
const PARTS: f64 = 1.8;
/// What sees more noise than this, in spacings, where a shorter length on wide cells saw less than [`LEAST_NOISE`], has welded walls, whatever it
/// scores: of points with so much noise that one sees most of it even with random sides.
pub(crate) const WELDED: f64 = 0.5;
/// Above this score the sides are about as random as coins.
pub(crate) const RANDOM: f64 = 0.4;

/// Two fits have the same sides where their scores differ by less.
const SAME: f64 = 1e-3;

/// What decides between two candidates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdict {
    /// The referee's.
    pub(crate) score: f64,
    /// The same without what noise adds to it.
    pub(crate) beyond_noise: f64,
    /// Smoothing length in spacings.
    pub(crate) ratio: f64,
    /// Standard deviation of the noise as this candidate sees it, in spacings.
    pub(crate) noise: f64,
    /// What is left of it without the share of the points' distances that they have in common with those around them.
    pub(crate) own_noise: f64,
    /// Whether it is on the first lattice, whose cells are a few spacings wide.
    pub(crate) wide_cells: bool,
    /// Points that lie off it together with those around them.
    pub(crate) off: usize,
    /// Whether the points lie on both sides of it rather than around it.
    pub(crate) layered: bool,
    /// Whether it sees noise where a shorter length saw none.
    pub(crate) welded: bool,
}

impl Verdict {
    /// Of a fit that failed.
    pub(crate) const fn failed(ratio: f64) -> Self {
        Self {
            score: f64::INFINITY,
            beyond_noise: f64::INFINITY,
            ratio,
            noise: 0.0,
            own_noise: 0.0,
            wide_cells: false,
            off: 0,
            layered: false,
            welded: false,
        }
    }

    /// Whether no point lies off it, and what they scatter by is nothing.
    pub(crate) fn fits(&self) -> bool {
        self.off == 0 && self.noise < LEAST_NOISE
    }

    /// Whether it has the sides of another one with the same length, going by what the referee says of them.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        (self.score - other.score).abs() < SAME
    }

    /// Whether a candidate with a longer length is to be preferred, of which no more than `few` points more may lie off it.
    pub(crate) fn yields_to(&self, longer: &Self, doubtful: f64, few: usize) -> bool {
        if self.welded != longer.welded {
            return self.welded;
        }
        let slack = if self.score < doubtful { SMOOTHER * self.score } else { 0.0 };
        let leaves_more = self.beyond_noise < RANDOM && longer.off.saturating_sub(self.off) > few;
        let follows_noise = self.noise > LEAST_NOISE && self.own_noise.max(longer.own_noise) > FOLLOWS * self.ratio;
        let parts = self.wide_cells && longer.wide_cells && longer.noise > PARTS * self.noise;
        let welds = longer.layered || parts;
        let parted = self.noise < LEAST_NOISE && parts && (longer.layered || longer.score > RANDOM);
        let as_good = longer.score < self.score + slack && !leaves_more && !parted;
        let sound = !welds && longer.beyond_noise < RANDOM && longer.score < NOISIER * self.score;
        as_good || (follows_noise && sound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_that_follows_noise_has_to_be_far_better() {
        let verdict = |ratio, score, noise| Verdict {
            score,
            beyond_noise: score - 0.2 * noise,
            ratio,
            noise,
            own_noise: noise,
            wide_cells: false,
            off: 5,
            layered: false,
            welded: false,
        };
        let longer_wins = |shorter: Verdict, longer: Verdict| shorter.yields_to(&longer, 0.25, 16);
        // A hollow shell around points with noise of 1.2 spacings, and the surface in the midst of it.
        assert!(longer_wins(verdict(0.8, 0.20, 0.8), verdict(1.6, 0.22, 1.2)));
        // Many sheets on narrow cells, which hide the noise.
        assert!(longer_wins(verdict(0.4, 0.17, 0.3), verdict(0.8, 0.27, 0.7)));
        // But among random sides none is smoother than others.
        assert!(!longer_wins(verdict(0.8, 0.77, 0.6), verdict(1.6, 1.2, 2.1)));
        // Nor is a length far above a wall's thickness right where the shorter one is a little below the noise.
        assert!(!longer_wins(verdict(0.8, 0.28, 0.74), verdict(1.6, 4.3, 0.87)));
        // The two sides of a wall are noise to the fit that welds them, and nothing to the other.
        assert!(!longer_wins(verdict(0.4, 0.1, 0.05), verdict(0.8, 0.18, 0.7)));
        // Nor do points that lie in two layers follow noise.
        assert!(!longer_wins(verdict(0.4, 0.15, 0.3), Verdict { layered: true, ..verdict(0.8, 0.24, 0.6) }));
        // Nor is it noise what a length that makes two sheets on wide cells hardly sees; a hollow shell sees most of it.
        let on_wide_cells = |ratio, score, noise| Verdict { wide_cells: true, ..verdict(ratio, score, noise) };
        assert!(!longer_wins(on_wide_cells(0.4, 0.14, 0.48), on_wide_cells(0.8, 0.38, 0.92)));
        assert!(longer_wins(on_wide_cells(0.4, 0.14, 0.6), on_wide_cells(0.8, 0.38, 1.0)));
        // Among random sides on wide cells the better score is no reason to weld.
        assert!(!longer_wins(on_wide_cells(0.4, 0.76, 0.05), on_wide_cells(3.2, 0.46, 1.6)));
        assert!(longer_wins(on_wide_cells(0.2, 3.2, 0.59), on_wide_cells(1.6, 1.0, 1.17)));
        // Nor is it where points on both sides of the better one say that it has.
        let layered = Verdict { layered: true, ..on_wide_cells(0.8, 0.19, 1.19) };
        assert!(!longer_wins(on_wide_cells(0.4, 0.2, 0.03), layered));
        assert!(longer_wins(on_wide_cells(0.4, 0.2, 0.03), Verdict { layered: false, ..layered }));
        assert!(longer_wins(on_wide_cells(0.4, 0.2, 0.4), layered), "noise");
        // Nor does any score speak for what has welded walls, unless against what has welded them, too.
        let welded = |longer: Verdict| Verdict { welded: true, ..longer };
        assert!(!longer_wins(verdict(0.4, 2.5, 0.05), welded(verdict(3.2, 0.29, 2.7))));
        assert!(longer_wins(welded(verdict(0.8, 0.3, 0.7)), verdict(1.6, 0.4, 0.1)));
        assert!(longer_wins(welded(verdict(1.6, 0.5, 1.0)), welded(verdict(3.2, 0.4, 1.2))));
        // Nor is noise what patches of points have in common, as where gaps between rods are filled.
        let misfit = Verdict { own_noise: 0.3, ..verdict(0.8, 0.32, 0.9) };
        assert!(longer_wins(verdict(0.4, 0.16, 0.3), verdict(0.8, 0.32, 0.9)));
        assert!(!longer_wins(verdict(0.4, 0.16, 0.3), misfit));
        // Little noise changes nothing.
        assert!(!longer_wins(verdict(0.4, 0.1, 0.2), verdict(0.8, 0.12, 0.2)));
        assert!(longer_wins(verdict(0.4, 0.1, 0.2), verdict(0.8, 0.104, 0.2)));
        // Unless it leaves a patch of points behind.
        let off = |off| Verdict { off, ..verdict(0.8, 0.104, 0.2) };
        assert!(longer_wins(verdict(0.4, 0.1, 0.2), off(21)) && !longer_wins(verdict(0.4, 0.1, 0.2), off(22)));
        // Even if the shorter one is doubtful, as of thin walls; random sides fit all points.
        assert!(!longer_wins(verdict(0.4, 0.33, 0.01), off(22)) && longer_wins(verdict(0.4, 0.6, 0.01), off(22)));
    }
}
