//! Colours: light is added up as it is, and written as sRGB.

/// Red, green, blue as amounts of light from 0 to 1.
pub(crate) type Light = [f32; 3];

pub(crate) const WHITE: Light = [1.0; 3];

/// The light of an sRGB colour (IEC 61966-2-1).
pub(crate) fn light(srgb: [u8; 3]) -> Light {
    srgb.map(|byte| {
        let c = f32::from(byte) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
}

/// The sRGB colour of a light.
pub(crate) fn srgb(light: Light) -> [u8; 3] {
    light.map(|c| {
        let c = c.clamp(0.0, 1.0);
        let encoded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded).round() as u8
    })
}

/// From `a` at 0 to `b` at 1.
pub(crate) fn mix(a: Light, b: Light, t: f32) -> Light {
    std::array::from_fn(|channel| a[channel] + t * (b[channel] - a[channel]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back() {
        for byte in 0..=255 {
            assert_eq!(srgb(light([byte; 3])), [byte; 3]);
        }
        assert_eq!(srgb([-1.0, 0.5, 9.0]), [0, 188, 255]);
    }
}
