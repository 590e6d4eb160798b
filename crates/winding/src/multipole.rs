//! Moments of oriented points about the centres of the boxes, and the field's polynomials from them.

use rayon::prelude::*;

use crate::multi_index::Tables;
use crate::opening::Ball;
use crate::partition::{Part, Partition};

/// An oriented point: its place and its area vector.
pub(crate) type Source<const D: usize> = [[f64; D]; 2];

/// Space for the monomials of any dimension.
const MOST: usize = 35;

/// The coefficients of the field of each box, `tables.coefficients` per box, in preorder.
///
/// The moments are `m_α = Σᵢ aᵢ nᵢ · ∇(r^α / α!)` at `r = Pᵢ − c`, and `W ∝ Σ_α m_α ∂^α G(c − X)`.
pub(crate) fn fields<const D: usize>(
    tables: &Tables,
    partition: &Partition<D>,
    balls: &[Ball<D>],
    sources: &[Source<D>],
) -> Vec<f64> {
    let (parts, count) = (&partition.parts, tables.count);
    let mut moments = vec![0.0; parts.len() * count];
    let leaf = |(index, (part, moments)): (usize, (&Part, &mut [f64]))| {
        if part.is_leaf(index) {
            gather(tables, &balls[index].centre, &sources[part.run()], moments);
        }
    };
    parts.par_iter().zip(moments.par_chunks_mut(count)).enumerate().with_min_len(64).for_each(leaf);
    for index in (0..parts.len()).rev() {
        if !parts[index].is_leaf(index) {
            let (upper, lower) = moments.split_at_mut((index + 1) * count);
            let target = &mut upper[index * count..];
            for child in [index + 1, parts[index + 1].skip as usize] {
                let source = &lower[(child - index - 1) * count..][..count];
                let shift: [f64; D] = std::array::from_fn(|k| balls[child].centre[k] - balls[index].centre[k]);
                add_shifted(tables, &shift, source, target);
            }
        }
    }
    let mut fields = vec![0.0; parts.len() * tables.coefficients];
    let field = |(field, moments): (&mut [f64], &[f64])| {
        for &(coefficient, moment, factor) in &tables.field {
            field[coefficient] += factor * moments[moment];
        }
    };
    fields.par_chunks_mut(tables.coefficients).zip(moments.par_chunks(count)).with_min_len(64).for_each(field);
    fields
}

/// `r^γ / γ!` for all γ.
fn monomials<const D: usize>(tables: &Tables, r: &[f64; D]) -> [f64; MOST] {
    let mut monomials = [0.0; MOST];
    monomials[tables.count - 1] = 1.0;
    for &(target, lower, axis, inverse) in &tables.monomials {
        monomials[target] = monomials[lower] * r[axis] * inverse;
    }
    monomials
}

/// Adds the moments of sources about `centre`.
fn gather<const D: usize>(tables: &Tables, centre: &[f64; D], sources: &[Source<D>], moments: &mut [f64]) {
    for [point, area] in sources {
        let monomials = monomials(tables, &std::array::from_fn::<_, D, _>(|k| point[k] - centre[k]));
        for term in &tables.derivatives {
            moments[term.target] += area[term.second] * monomials[term.first];
        }
    }
}

/// Adds moments about a centre that lies at `shift` from that of `target`.
fn add_shifted<const D: usize>(tables: &Tables, shift: &[f64; D], moments: &[f64], target: &mut [f64]) {
    let monomials = monomials(tables, shift);
    for term in &tables.shifts {
        target[term.target] += moments[term.first] * monomials[term.second];
    }
}
