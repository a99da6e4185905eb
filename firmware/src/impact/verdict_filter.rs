//! The force through the verdict filter, forward and backward, over a curve that does not fit into memory twice.
//!
//! ```text
//! forward   ─▶ state kept at every stretch ─▶ state kept at every piece of the present stretch
//! backward  ◀─ one piece of 128 samples, recomputed forward from its kept state ◀─
//! ```
//!
//! Two passes of a two-pole Butterworth leave no phase, so that peaks stand where they were. The backward pass begins at
//! rest on the last forward value, as if the force stayed what it was at the end of the curve.

use super::force::{Force, PIECE};
use crate::capture::Curve;
use crate::filter::{LowPass, State};

/// States that are kept at each level: 64·64 pieces, half a million samples.
const KEPT: usize = 64;

/// Calls `take(position, filtered)` for every position in `from..to`, the last one first.
pub fn backward<C: Curve>(
    force: &Force<'_, C>,
    filter: &LowPass,
    from: usize,
    to: usize,
    mut take: impl FnMut(usize, f32),
) {
    let to = to.min(force.len()).min(from + KEPT * KEPT * PIECE);
    if from >= to {
        return;
    }
    let pieces_per_stretch = (to - from).div_ceil(PIECE).div_ceil(KEPT);
    let stretch = pieces_per_stretch * PIECE;
    let mut at_stretch = [State::default(); KEPT];
    let mut at_piece = [State::default(); KEPT];
    let mut state = State::default();
    let mut last = 0.0;
    force.for_each(from, to, |at, x| {
        if (at - from).is_multiple_of(stretch) {
            at_stretch[(at - from) / stretch] = state;
        }
        last = filter.step(&mut state, x);
    });
    let mut back = State::steady(last);
    for stretch_index in (0..(to - from).div_ceil(stretch)).rev() {
        let begin = from + stretch_index * stretch;
        let end = (begin + stretch).min(to);
        let mut state = at_stretch[stretch_index];
        force.for_each(begin, end, |at, x| {
            if (at - begin).is_multiple_of(PIECE) {
                at_piece[(at - begin) / PIECE] = state;
            }
            filter.step(&mut state, x);
        });
        for piece_index in (0..(end - begin).div_ceil(PIECE)).rev() {
            let begin = begin + piece_index * PIECE;
            let mut piece = [0.0; PIECE];
            let wanted = PIECE.min(end - begin);
            let count = force.read(begin, &mut piece[..wanted]);
            let mut state = at_piece[piece_index];
            for x in &mut piece[..count] {
                *x = filter.step(&mut state, *x);
            }
            for (index, x) in piece[..count].iter().enumerate().rev() {
                take(begin + index, filter.step(&mut back, *x));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::board::AdcCode;
    use crate::idle::Baseline;
    use crate::units::Hertz;

    /// By pieces and at once, bit for bit; over lengths that end within a piece, at one and at a stretch's end.
    #[test]
    fn by_pieces_is_the_same_as_at_once() {
        let filter = LowPass::of_two_passes(Hertz(300.0), Hertz(20_000.0));
        let baseline = Baseline::default();
        for len in [1, 100, PIECE, 5 * PIECE + 7, KEPT * PIECE, 2 * KEPT * PIECE + 1, 14_336] {
            let codes: Vec<AdcCode> = (0..len).map(|at| (at * 7_919 % 30_011) as AdcCode).collect();
            let force = Force::bare(&codes, &baseline);
            let from = len / 3;
            let mut whole = std::vec![0.0; len - from];
            force.for_each(from, len, |at, x| whole[at - from] = x);
            filter.forth_and_back(&mut whole);
            let mut by_pieces = Vec::new();
            backward(&force, &filter, from, len, |at, y| by_pieces.push((at, y)));
            by_pieces.reverse();
            let expected: Vec<(usize, f32)> = whole.into_iter().enumerate().map(|(at, y)| (from + at, y)).collect();
            assert!(by_pieces == expected, "{len}");
        }
    }
}
