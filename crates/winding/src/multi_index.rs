//! Exponents of monomials in D variables and the tables that multipole expansions are computed with.

/// Terms of the expansion: monopole (absent here), dipole, quadrupole, octupole, hexadecapole.
pub(crate) const ORDER: usize = 4;

/// The exponents up to a degree, in the order in which nested Horner schemes read coefficients: by falling exponent of the
/// first variable, then of the second, then of the third. The constant is the last.
pub(crate) fn exponents<const D: usize>(degree: usize) -> Vec<[usize; D]> {
    let mut all: Vec<[usize; D]> = vec![[0; D]];
    for axis in 0..D {
        let raised = |e: [usize; D]| {
            let room = degree - e.iter().sum::<usize>();
            (0..=room).rev().map(move |power| std::array::from_fn(|k| if k == axis { power } else { e[k] }))
        };
        all = all.into_iter().flat_map(raised).collect();
    }
    all
}

/// `target += factor · a[first] · b[second]`: one term of a bilinear map given by a table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    pub target: usize,
    pub first: usize,
    pub second: usize,
}

/// What moments are computed, moved and read with. Monomials are `r^γ / γ!`, numbered as [`exponents`] of [`ORDER`].
#[derive(Debug, Clone)]
pub(crate) struct Tables {
    /// Number of monomials and of moments; that of degree zero is the last.
    pub count: usize,
    /// From the constant upwards, each monomial from another, `r^γ/γ! = r^β/β! · r_axis / γ_axis`: (γ, β, axis, 1 / γ_axis).
    pub monomials: Vec<(usize, usize, usize, f64)>,
    /// Derivative of monomial `target` along axis `second` is monomial `first`.
    pub derivatives: Vec<Term>,
    /// Moment `target` about another centre has moment `first` times monomial `second` of the shift.
    pub shifts: Vec<Term>,
    /// Coefficient of the field's polynomial that a moment adds to, the moment, and the factor.
    pub field: Vec<(usize, usize, f64)>,
    /// Number of coefficients of the field's polynomials: degree ≤ 4, degree ≤ 2, constant.
    pub coefficients: usize,
}

impl Tables {
    pub fn new<const D: usize>() -> Self {
        let exponents = exponents::<D>(ORDER);
        #[expect(
            clippy::expect_used,
            reason = "asked only for exponents of degree ORDER at most, all of which are listed"
        )]
        let find =
            |e: &[usize; D]| exponents.iter().position(|x| x == e).expect("all exponents of the degree are listed");
        let lowered =
            |e: &[usize; D], axis: usize| (e[axis] > 0).then(|| std::array::from_fn(|k| e[k] - usize::from(k == axis)));
        let degree = |e: &[usize; D]| e.iter().sum::<usize>();
        let mut rising: Vec<usize> = (0..exponents.len()).collect();
        rising.sort_by_key(|&i| degree(&exponents[i]));

        let (mut monomials, mut derivatives, mut shifts) = (vec![], vec![], vec![]);
        for target in rising {
            let e = exponents[target];
            if let Some((axis, lower)) = (0..D).find_map(|axis| Some((axis, lowered(&e, axis)?))) {
                monomials.push((target, find(&lower), axis, 1.0 / e[axis] as f64));
            }
            for axis in 0..D {
                if let Some(lower) = lowered(&e, axis) {
                    derivatives.push(Term { target, first: find(&lower), second: axis });
                }
            }
            for (first, lower) in exponents.iter().enumerate() {
                if degree(lower) > 0 && (0..D).all(|k| lower[k] <= e[k]) {
                    shifts.push(Term { target, first, second: find(&std::array::from_fn(|k| e[k] - lower[k])) });
                }
            }
        }
        let (field, coefficients) = field(&exponents);
        Self { count: exponents.len(), monomials, derivatives, shifts, field, coefficients }
    }
}

/// The derivatives of the potential `G`, whose gradient is the kernel, at `r` from it, `q = ‖r‖² + ε²`:
///
/// `∂^α G = q^{(2−D)/2} Σ_j c_{k−J} Π_axis α!/(j! (α−2j)! 2^j) v^{α−2j} q^{−J}`, `v = r / q`, `k = |α|`, `J = |j|`,
/// `c₁ = 1`, `c_{n+1} = −(2n + D − 2) c_n`,
///
/// by differentiating a function of `q` again and again: each derivative either brings down an `r` or pairs with one.
fn field<const D: usize>(exponents: &[[usize; D]]) -> (Vec<(usize, usize, f64)>, usize) {
    let mut sections: Vec<Vec<[usize; D]>> = Vec::new();
    for pairs in 0..=ORDER / 2 {
        sections.push(self::exponents::<D>(ORDER - 2 * pairs));
    }
    let start = |pairs: usize| sections[..pairs].iter().map(Vec::len).sum::<usize>();
    let mut scale = [1.0; ORDER + 1];
    for n in 1..ORDER {
        scale[n + 1] = -((2 * n + D - 2) as f64) * scale[n];
    }
    let factorial = |n: usize| (1..=n).product::<usize>() as f64;
    let mut table = Vec::new();
    for (moment, e) in exponents.iter().enumerate() {
        let order = e.iter().sum::<usize>();
        if order == 0 {
            continue;
        }
        // All ways of taking `j[axis]` pairs from the exponents.
        for j in self::exponents::<D>(order / 2) {
            if (0..D).any(|k| 2 * j[k] > e[k]) {
                continue;
            }
            let pairs = j.iter().sum::<usize>();
            let rest: [usize; D] = std::array::from_fn(|k| e[k] - 2 * j[k]);
            let ways: f64 = (0..D)
                .map(|k| factorial(e[k]) / (factorial(j[k]) * factorial(rest[k]) * (1usize << j[k]) as f64))
                .product();
            #[expect(clippy::expect_used, reason = "pairs taken away leave a degree that the section lists")]
            let place = sections[pairs].iter().position(|x| *x == rest).expect("of lower degree");
            table.push((start(pairs) + place, moment, scale[order - pairs] * ways));
        }
    }
    (table, start(sections.len()))
}
