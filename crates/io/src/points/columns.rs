//! Which columns of a row hold coordinates and normals.

use crate::points::Dimension;

/// Positions in a row: `slots[k]` is the column of the k-th entry of `x y [z] [nx ny [nz]]`.
pub(crate) struct Columns {
    pub(crate) slots: Vec<usize>,
    pub(crate) dimension: Dimension,
    pub(crate) with_normals: bool,
}

impl Columns {
    /// The columns that `find` knows by name: in the plane where there is no z, with normals where every component is there;
    /// `None` where x or y is missing.
    pub(crate) fn named<E>(mut find: impl FnMut(&str) -> Result<Option<usize>, E>) -> Result<Option<Self>, E> {
        let (Some(x), Some(y)) = (find("x")?, find("y")?) else {
            return Ok(None);
        };
        let (mut slots, mut normals, mut dimension) = (vec![x, y], vec![find("nx")?, find("ny")?], Dimension::Two);
        if let Some(z) = find("z")? {
            slots.push(z);
            normals.push(find("nz")?);
            dimension = Dimension::Three;
        }
        let normals: Option<Vec<usize>> = normals.into_iter().collect();
        let with_normals = normals.is_some();
        slots.extend(normals.unwrap_or_default());
        Ok(Some(Self { slots, dimension, with_normals }))
    }
}
