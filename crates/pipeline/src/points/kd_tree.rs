//! The tree in which nearest points are looked up.

use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// As many points as a tree can number: more are refused at the door.
pub const MOST_POINTS: u64 = 1 << 32;

/// A tree of finite points, [`MOST_POINTS`] at most.
#[expect(clippy::expect_used, reason = "only more points than its numbers of 32 bits tell apart make no tree")]
pub fn tree_of<const D: usize>(points: &[[f64; D]]) -> ImmutableKdTree<f64, D> {
    ImmutableKdTree::new_from_slice(points).expect("no more points than 32 bits number")
}

/// Which points lie in a ball, the nearest first.
pub fn within<const D: usize>(
    tree: &ImmutableKdTree<f64, D>,
    centre: &[f64; D],
    radius: f64,
) -> impl Iterator<Item = usize> {
    let near = tree.query(centre).within::<SquaredEuclidean<f64>>(radius * radius).execute();
    near.into_iter().map(|near| near.item as usize)
}
