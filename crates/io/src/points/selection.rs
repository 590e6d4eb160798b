//! Parts and unions of point sets.

use crate::attributes::{Attribute, NumberKind};
use crate::points::{PointSet, Points};

/// Two of the three coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Plane {
    /// x and y: seen along z.
    Xy,
    /// x and z: seen along y.
    Xz,
    /// y and z: seen along x.
    Yz,
}

impl Plane {
    /// The two coordinates of a point.
    fn of(self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        match self {
            Self::Xy => [x, y],
            Self::Xz => [x, z],
            Self::Yz => [y, z],
        }
    }
}

impl Points {
    /// Several sets as one, in their order. It has normals where all of them have, and the attributes that all of them have, in the
    /// order of the first set; one whose types differ becomes floating point. `None` if there are no sets, or both kinds.
    pub fn joined(sets: Vec<Self>) -> Option<Self> {
        let (mut two, mut three) = (Vec::new(), Vec::new());
        for set in sets {
            match set {
                Self::Two(set) => two.push(set),
                Self::Three(set) => three.push(set),
            }
        }
        match (two.is_empty(), three.is_empty()) {
            (false, true) => PointSet::joined(two).map(Self::Two),
            (true, false) => PointSet::joined(three).map(Self::Three),
            _ => None,
        }
    }

    /// The points seen in a plane: those that are there already as they are. Normals are left out.
    pub fn in_plane(self, plane: Plane) -> Self {
        match self {
            Self::Two(_) => self,
            Self::Three(PointSet { points, normals: _, attributes }) => {
                let points = points.into_iter().map(|point| plane.of(point)).collect();
                Self::Two(PointSet { points, normals: None, attributes })
            }
        }
    }
}

impl<const D: usize> PointSet<D> {
    /// The points of a box, its faces included. There may be none.
    pub fn within(self, lower: &[f64; D], upper: &[f64; D]) -> Self {
        let inside =
            |p: &[f64; D]| p.iter().zip(lower.iter().zip(upper)).all(|(x, (low, high))| (low..=high).contains(&x));
        let keep: Vec<bool> = self.points.iter().map(inside).collect();
        Self {
            points: kept(self.points, &keep),
            normals: self.normals.map(|normals| kept(normals, &keep)),
            attributes: self
                .attributes
                .into_iter()
                .map(|attribute| Attribute { values: kept(attribute.values, &keep), ..attribute })
                .collect(),
        }
    }

    fn joined(sets: Vec<Self>) -> Option<Self> {
        let mut sets = sets.into_iter();
        let mut all = sets.next()?;
        for mut set in sets {
            all.points.append(&mut set.points);
            all.normals = all.normals.zip(set.normals).map(|(mut normals, mut others)| {
                normals.append(&mut others);
                normals
            });
            all.attributes.retain_mut(|attribute| {
                let other = set.attributes.iter_mut().find(|other| other.name.eq_ignore_ascii_case(&attribute.name));
                let Some(other) = other else { return false };
                if attribute.kind != other.kind {
                    attribute.kind = NumberKind::F64;
                }
                attribute.values.append(&mut other.values);
                true
            });
        }
        Some(all)
    }
}

fn kept<T>(values: Vec<T>, keep: &[bool]) -> Vec<T> {
    values.into_iter().zip(keep).filter(|(_, keep)| **keep).map(|(value, _)| value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, kind: NumberKind, values: &[f64]) -> Attribute {
        Attribute { name: name.into(), kind, values: values.to_vec() }
    }

    fn set(first: f64, with_normals: bool, attributes: Vec<Attribute>) -> PointSet<3> {
        let points = vec![[first, 1.0, 2.0], [first + 1.0, 3.0, 4.0]];
        let normals = with_normals.then(|| vec![[0.0, 0.0, first], [1.0, 0.0, 0.0]]);
        PointSet { points, normals, attributes }
    }

    #[test]
    fn sets_are_joined_with_what_they_have_in_common() {
        let first = set(
            0.0,
            true,
            vec![
                attribute("red", NumberKind::U8, &[1.0, 2.0]),
                attribute("label", NumberKind::I32, &[7.0, 8.0]),
                attribute("time", NumberKind::F32, &[0.5, 0.6]),
            ],
        );
        let second = set(
            10.0,
            true,
            vec![attribute("TIME", NumberKind::F64, &[0.7, 0.8]), attribute("red", NumberKind::U8, &[3.0, 4.0])],
        );
        let both = Points::joined(vec![Points::Three(first.clone()), Points::Three(second)]).unwrap();
        let Points::Three(both) = both else { panic!("in space") };
        assert_eq!(both.points.iter().map(|p| p[0]).collect::<Vec<_>>(), [0.0, 1.0, 10.0, 11.0]);
        assert_eq!(both.normals.unwrap()[2], [0.0, 0.0, 10.0]);
        assert_eq!(
            both.attributes,
            [
                attribute("red", NumberKind::U8, &[1.0, 2.0, 3.0, 4.0]),
                attribute("time", NumberKind::F64, &[0.5, 0.6, 0.7, 0.8]),
            ]
        );
        let bare = Points::joined(vec![Points::Three(first.clone()), Points::Three(set(5.0, false, vec![]))]).unwrap();
        assert!(!bare.has_normals() && bare.attributes().is_empty());
        let plane = Points::Three(first.clone()).in_plane(Plane::Xz);
        assert_eq!(Points::joined(vec![Points::Three(first), plane]), None);
        assert_eq!(Points::joined(vec![]), None);
    }

    #[test]
    fn a_plane_takes_two_coordinates() {
        let all = Points::Three(set(5.0, true, vec![attribute("red", NumberKind::U8, &[1.0, 2.0])]));
        for (plane, expected) in [(Plane::Xy, [5.0, 1.0]), (Plane::Xz, [5.0, 2.0]), (Plane::Yz, [1.0, 2.0])] {
            let Points::Two(seen) = all.clone().in_plane(plane) else { panic!("in the plane") };
            assert_eq!((seen.points[0], seen.attributes.len()), (expected, 1));
            assert_eq!(Points::Two(seen.clone()).in_plane(Plane::Yz), Points::Two(seen));
        }
    }

    #[test]
    fn a_box_takes_what_lies_in_it() {
        let all = set(5.0, true, vec![attribute("red", NumberKind::U8, &[1.0, 2.0])]);
        let part = all.clone().within(&[5.5, 3.0, 0.0], &[6.0, 9.0, 9.0]);
        assert_eq!(part.points, [[6.0, 3.0, 4.0]]);
        assert_eq!((part.normals, part.attributes[0].values.clone()), (Some(vec![[1.0, 0.0, 0.0]]), vec![2.0]));
        assert!(all.within(&[0.0; 3], &[1.0; 3]).points.is_empty());
    }
}
