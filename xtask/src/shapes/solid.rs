//! Solids by a bound of their signed distance, put together from simple ones.

use std::sync::Arc;

use zeroset_tests::Random;

/// Half the step of differences, for solids of size about 1: rounding and curvature take about as many digits.
const STEP: f64 = 1e-6;

type Bound<const D: usize> = dyn Fn(&[f64; D]) -> f64 + Send + Sync;

/// A set of points, as a function that is negative inside it, positive outside, and changes no faster than the distance between two
/// places: |f(x)| is the distance of x from the boundary, or less.
#[derive(Clone)]
pub struct Solid<const D: usize>(Arc<Bound<D>>);

impl<const D: usize> Solid<D> {
    /// From a function with Lipschitz constant 1.
    fn new(bound: impl Fn(&[f64; D]) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(bound))
    }

    /// f(x).
    pub fn value(&self, x: &[f64; D]) -> f64 {
        (self.0)(x)
    }

    /// ∇f(x) by central differences.
    pub fn gradient(&self, x: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| {
            let [mut before, mut behind] = [*x; 2];
            before[axis] -= STEP;
            behind[axis] += STEP;
            (self.value(&behind) - self.value(&before)) / (2.0 * STEP)
        })
    }

    /// A ball, or a disc.
    pub fn ball(centre: [f64; D], radius: f64) -> Self {
        Self::new(move |x| distance(x, &centre) - radius)
    }

    /// A box around the origin, with half its sides.
    pub fn cuboid(half: [f64; D]) -> Self {
        Self::new(move |x| {
            let beyond: [f64; D] = std::array::from_fn(|k| x[k].abs() - half[k]);
            let outside = norm(&beyond.map(|b| b.max(0.0)));
            outside + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0)
        })
    }

    /// All that is nearer to a segment than its radius, for any of some segments with their radii.
    pub fn rods(segments: Vec<([f64; D], [f64; D], f64)>) -> Self {
        let rods: Vec<_> = segments
            .into_iter()
            .map(|(a, b, radius)| {
                let along = sub(&b, &a);
                (a, along, dot(&along, &along).max(f64::MIN_POSITIVE), radius)
            })
            .collect();
        Self::new(move |x| {
            let mut least = f64::INFINITY;
            for (a, along, square, radius) in &rods {
                let from = sub(x, a);
                let t = (dot(&from, along) / square).clamp(0.0, 1.0);
                let off: [f64; D] = std::array::from_fn(|k| from[k] - t * along[k]);
                least = least.min(norm(&off) - radius);
            }
            least
        })
    }

    /// All that is nearer to a polyline than a radius.
    pub fn tube(line: &[[f64; D]], radius: f64) -> Self {
        Self::rods(line.windows(2).map(|pair| (pair[0], pair[1], radius)).collect())
    }

    /// What is in any of some solids.
    pub fn union(parts: Vec<Self>) -> Self {
        Self::new(move |x| parts.iter().map(|part| part.value(x)).fold(f64::INFINITY, f64::min))
    }

    /// The same, with seams rounded over a width.
    pub fn smooth_union(parts: Vec<Self>, width: f64) -> Self {
        Self::new(move |x| {
            parts.iter().map(|part| part.value(x)).fold(f64::INFINITY, |a, b| smooth_minimum(a, b, width))
        })
    }

    /// What is in both.
    pub fn and(self, other: Self) -> Self {
        Self::new(move |x| self.value(x).max(other.value(x)))
    }

    /// The same, with edges rounded over a width.
    pub fn smoothly_and(self, other: Self, width: f64) -> Self {
        Self::new(move |x| -smooth_minimum(-self.value(x), -other.value(x), width))
    }

    /// What is in this and not in the other.
    pub fn without(self, other: Self) -> Self {
        Self::new(move |x| self.value(x).max(-other.value(x)))
    }

    /// All that is nearer than a width, or, where it is negative, deeper inside than that.
    pub fn grown(self, width: f64) -> Self {
        Self::new(move |x| self.value(x) - width)
    }

    /// A wall of a thickness along the boundary.
    pub fn shell(self, thickness: f64) -> Self {
        Self::new(move |x| self.value(x).abs() - 0.5 * thickness)
    }

    /// Moved.
    pub fn moved(self, by: [f64; D]) -> Self {
        Self::new(move |x| self.value(&sub(x, &by)))
    }

    /// Stretched by a factor along each axis.
    pub fn stretched(self, by: [f64; D]) -> Self {
        let least = by.into_iter().fold(f64::INFINITY, f64::min);
        Self::new(move |x| least * self.value(&std::array::from_fn(|k| x[k] / by[k])))
    }

    /// With other axes: the first is the one that is named first, and so on.
    pub fn with_axes(self, axes: [usize; D]) -> Self {
        Self::new(move |x| self.value(&axes.map(|axis| x[axis])))
    }

    /// Turned at random around the origin, or mirrored too.
    pub fn turned(self, random: &mut Random) -> Self {
        let axes = orthonormal(random);
        Self::new(move |x| self.value(&axes.map(|axis| dot(&axis, x))))
    }
}

impl Solid<2> {
    /// A polygon, by its corners in order.
    pub fn polygon(corners: Vec<[f64; 2]>) -> Self {
        Self::new(move |x| {
            let (mut least, mut inside) = (f64::INFINITY, false);
            let mut a = corners[corners.len() - 1];
            for &b in &corners {
                let (from, along) = (sub(x, &a), sub(&b, &a));
                let t = (dot(&from, &along) / dot(&along, &along).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let off = [from[0] - t * along[0], from[1] - t * along[1]];
                least = least.min(dot(&off, &off));
                // Whether a ray along the first axis crosses the side.
                if (a[1] > x[1]) != (b[1] > x[1]) {
                    let at = a[0] + (x[1] - a[1]) / along[1] * along[0];
                    inside ^= x[0] < at;
                }
                a = b;
            }
            if inside { -least.sqrt() } else { least.sqrt() }
        })
    }

    /// A bar with flat ends between two places, with half its width.
    pub fn bar(a: [f64; 2], b: [f64; 2], half: f64) -> Self {
        let (along, length) = (sub(&b, &a), distance(&a, &b));
        let along = along.map(|c| c / length);
        let bar = Self::cuboid([0.5 * length + half, half]);
        Self::new(move |x| {
            let from: [f64; 2] = std::array::from_fn(|k| x[k] - 0.5 * (a[k] + b[k]));
            bar.value(&[dot(&from, &along), along[0] * from[1] - along[1] * from[0]])
        })
    }

    /// The outline pulled along the third axis, to half a height on both sides.
    pub fn extruded(self, half: f64) -> Solid<3> {
        Solid::new(move |x| {
            let beyond = [self.value(&[x[0], x[1]]), x[2].abs() - half];
            norm(&beyond.map(|b| b.max(0.0))) + beyond[0].max(beyond[1]).min(0.0)
        })
    }

    /// The outline, in the distance from the third axis and the height along it, turned around that axis.
    pub fn revolved(self) -> Solid<3> {
        Solid::new(move |x| self.value(&[x[0].hypot(x[1]), x[2]]))
    }
}

impl Solid<3> {
    /// A ring around the third axis.
    pub fn torus(ring: f64, radius: f64) -> Self {
        Solid::<2>::ball([ring, 0.0], radius).revolved()
    }

    /// One side of Schoen's gyroid: where sin x cos y + sin y cos z + sin z cos x, of lengths times `waves`, is below a level.
    pub fn gyroid_side(waves: f64, level: f64) -> Self {
        // No partial derivative is above √(cos² + sin²) of two coordinates, by Cauchy and Schwarz, so that their squares sum to 3.
        let steepest = waves * 3f64.sqrt();
        Self::new(move |x| {
            let [x, y, z] = x.map(|c| (waves * c).sin_cos());
            (x.0 * y.1 + y.0 * z.1 + z.0 * x.1 - level) / steepest
        })
    }
}

/// The smaller, and smaller than that where both are about equal: a quadratic blend.
fn smooth_minimum(a: f64, b: f64, width: f64) -> f64 {
    let share = (1.0 - (a - b).abs() / width).max(0.0);
    a.min(b) - 0.25 * width * share * share
}

/// Rows that are orthogonal and of length 1, every such matrix as likely as any other.
fn orthonormal<const D: usize>(random: &mut Random) -> [[f64; D]; D] {
    let mut rows = [[0.0; D]; D];
    for row in 0..D {
        loop {
            let mut new: [f64; D] = std::array::from_fn(|_| random.gaussian());
            for other in &rows[..row] {
                let along = dot(&new, other);
                (0..D).for_each(|k| new[k] -= along * other[k]);
            }
            let length = norm(&new);
            // Shorter ones have lost digits.
            if length > 1e-3 {
                rows[row] = new.map(|c| c / length);
                break;
            }
        }
    }
    rows
}

/// A random direction.
pub fn direction<const D: usize>(random: &mut Random) -> [f64; D] {
    orthonormal(random)[0]
}

pub fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}

pub fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `x + t along`.
pub fn ahead<const D: usize>(x: &[f64; D], t: f64, along: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| x[k] + t * along[k])
}

pub fn norm<const D: usize>(a: &[f64; D]) -> f64 {
    dot(a, a).sqrt()
}

pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    norm(&sub(a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-12, "{value}, expected {expected}");
    }

    #[test]
    fn simple_solids_know_their_distances() {
        let cuboid = Solid::cuboid([1.0, 2.0, 3.0]);
        near(cuboid.value(&[4.0, 6.0, 3.0]), 5.0);
        near(cuboid.value(&[0.0, 1.5, 0.0]), -0.5);
        near(Solid::torus(2.0, 0.5).value(&[0.0, 2.0, 3.0]), 2.5);
        near(Solid::tube(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]], 1.0).value(&[7.0, 8.0]), 4.0);
        let square = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        near(Solid::polygon(square.clone()).value(&[1.0, 1.75]), -0.25);
        near(Solid::polygon(square.clone()).value(&[5.0, 6.0]), 5.0);
        near(Solid::polygon(square).extruded(1.0).value(&[1.0, 5.0, 5.0]), 5.0);
        // From (0, 0) to (3, 4), half a unit beyond both and to both sides.
        let bar = Solid::bar([0.0, 0.0], [3.0, 4.0], 0.5);
        near(bar.value(&[1.5 - 0.8, 2.0 + 0.6]), 0.5);
        near(bar.value(&[3.6, 4.8]), 0.5);
    }

    #[test]
    fn operations_do_what_they_say() {
        let ball = || Solid::ball([0.0; 3], 1.0);
        near(ball().shell(0.2).value(&[0.0, 0.0, 0.7]), 0.2);
        near(ball().without(Solid::ball([1.0, 0.0, 0.0], 0.25)).value(&[1.0, 0.0, 0.0]), 0.25);
        near(ball().and(ball().moved([1.0, 0.0, 0.0])).value(&[-1.0, 0.0, 0.0]), 1.0);
        near(ball().stretched([2.0, 1.0, 1.0]).value(&[4.0, 0.0, 0.0]), 1.0);
        near(Solid::cuboid([1.0, 2.0, 3.0]).with_axes([1, 2, 0]).value(&[4.0, 0.0, 0.0]), 1.0);
        near(Solid::smooth_union(vec![ball(), ball()], 0.4).value(&[1.0, 0.0, 0.0]), -0.1);
        near(ball().turned(&mut Random(3)).value(&[0.0, 3.0, 4.0]), 4.0);
    }
}
