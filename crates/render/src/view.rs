//! Where a picture is taken from.

use crate::error::RenderError;

/// A view along parallel rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// From the thing towards the viewer, of any length but zero.
    pub direction: [f64; 3],
    /// Which axis points up in the picture.
    pub up: Up,
}

/// The axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// y, as in most models and viewers: the front faces z.
    #[default]
    Y,
    /// z, as in most maps and machines: the front faces −y.
    Z,
}

impl Up {
    fn axis(self) -> [f64; 3] {
        match self {
            Self::Y => [0.0, 1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
        }
    }

    /// Towards a viewer in front.
    fn front(self) -> [f64; 3] {
        match self {
            Self::Y => [0.0, 0.0, 1.0],
            Self::Z => [0.0, -1.0, 0.0],
        }
    }
}

/// Along the right, upwards and towards the viewer.
pub(crate) type Rows = [[f64; 3]; 3];

impl View {
    /// From a direction, with y up.
    pub fn from_direction(direction: [f64; 3]) -> Self {
        Self { direction, up: Up::Y }
    }

    /// From the front.
    pub fn front(up: Up) -> Self {
        Self { direction: up.front(), up }
    }

    /// From the right in front, and from above.
    pub fn oblique(up: Up) -> Self {
        let (front, axis) = (up.front(), up.axis());
        let right = cross(axis, front);
        Self { direction: std::array::from_fn(|k| 0.75 * right[k] + 0.45 * axis[k] + 0.85 * front[k]), up }
    }

    /// From above, the front at the lower side of the picture.
    pub fn top(up: Up) -> Self {
        Self { direction: up.axis(), up }
    }

    /// The picture's axes.
    pub(crate) fn rows(&self) -> Result<Rows, RenderError> {
        let refused = RenderError::Direction(self.direction);
        let towards = normalised(self.direction).ok_or(refused.clone())?;
        // Seen along the axis itself, what is behind is up.
        let right = normalised(cross(self.up.axis(), towards))
            .or_else(|| normalised(cross(self.up.front().map(|c| -c), towards)))
            .ok_or(refused)?;
        Ok([right, cross(towards, right), towards])
    }
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The direction; nothing where the length is about zero beside 1, or not finite.
pub(crate) fn normalised(v: [f64; 3]) -> Option<[f64; 3]> {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let scaled = v.map(|c| c / largest);
    let norm = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    (largest > 1e-9 && norm.is_finite()).then(|| scaled.map(|c| c / norm))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_where_they_are_expected() {
        let [right, up, towards] = View::front(Up::Y).rows().unwrap();
        assert_eq!((right, up, towards), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]));
        let [right, up, _] = View::front(Up::Z).rows().unwrap();
        assert_eq!((right, up), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
        let [right, up, _] = View::top(Up::Y).rows().unwrap();
        assert_eq!((right, up), ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]));
        let [right, up, _] = View::top(Up::Z).rows().unwrap();
        assert_eq!((right, up), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
        let [right, up, _] = View::oblique(Up::Z).rows().unwrap();
        assert!(right[0] > 0.5 && up[2] > 0.5, "{right:?} {up:?}");
        for direction in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 1.0]] {
            assert!(matches!(View::from_direction(direction).rows(), Err(RenderError::Direction(_))));
        }
    }
}
