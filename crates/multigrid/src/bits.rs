//! Sets of up to sixteen places, as bits.

/// The places of the bits, from the lowest on.
///
/// An iterator rather than a function that takes a closure: a closure is compiled without the vector instructions of the kernel
/// that it is written in, unless it happens to be inlined.
#[derive(Clone, Copy)]
pub(crate) struct Bits(pub(crate) u16);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let place = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(place)
    }
}
