//! How bright a surface is.

use crate::colour::{Light, light, mix};

/// Of the outside, of the inside, and of points.
const OUTSIDE: [u8; 3] = [176, 196, 222];
const INSIDE: [u8; 3] = [230, 130, 60];
const POINT: [u8; 3] = [156, 36, 44];
/// What comes from above and from below, on all sides.
const SKY: f32 = 0.72;
const GROUND: f32 = 0.2;
/// From over the viewer's left shoulder: along the right, upwards, towards the viewer; of length 1.
const LAMP: [f32; 3] = [-0.45, 0.6, 0.661_437_8];
const LAMP_STRENGTH: f32 = 0.7;
/// How much darker it is where the surface turns away from the viewer: there it usually curves into something.
const EDGE: f32 = 0.4;

/// What is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Material {
    Outside,
    Inside,
    Point,
}

/// The light from a place with a normal (along the right, upwards, towards the viewer) of length 1 that looks at the viewer.
pub(crate) fn shade(normal: [f32; 3], material: Material) -> Light {
    let colour = light(match material {
        Material::Outside => OUTSIDE,
        Material::Inside => INSIDE,
        Material::Point => POINT,
    });
    let around = GROUND + (SKY - GROUND) * (0.5 + 0.5 * normal[1]);
    let lamp = LAMP_STRENGTH * (0..3).map(|k| LAMP[k] * normal[k]).sum::<f32>().max(0.0);
    let edge = 1.0 - EDGE * (1.0 - normal[2].clamp(0.0, 1.0)).powi(2);
    let gleam = 0.06 * gleam(normal);
    mix(colour.map(|c| c * (around + lamp) * edge), [1.0; 3], gleam)
}

/// The mirrored lamp (Blinn 1977), blurred.
fn gleam(normal: [f32; 3]) -> f32 {
    let half = [LAMP[0], LAMP[1], LAMP[2] + 1.0];
    let length = half.iter().map(|c| c * c).sum::<f32>().sqrt();
    ((0..3).map(|k| half[k] * normal[k]).sum::<f32>() / length).max(0.0).powi(24)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::srgb;

    #[test]
    fn light_comes_from_above_and_the_inside_is_orange() {
        let sum = |normal| srgb(shade(normal, Material::Outside)).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!(sum([0.0, 0.6, 0.8]) > sum([0.0, -0.6, 0.8]));
        let [red, _, blue] = srgb(shade([0.0, 0.0, 1.0], Material::Inside));
        assert!(red > blue + 60);
        let length = LAMP.iter().map(|c| c * c).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-6);
    }
}
