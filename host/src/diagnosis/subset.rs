//! Some recordings of a campaign, as a set that is copied like a number.

/// The recordings that can be told one by one; of longer campaigns the others are in no set.
const MOST: usize = 256;
const BITS: usize = u64::BITS as usize;

/// A set of recordings, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Subset([u64; MOST / BITS]);

impl Subset {
    /// Whether it includes a recording.
    #[must_use]
    pub fn includes(self, recording: usize) -> bool {
        recording < MOST && self.0[recording / BITS] & (1 << (recording % BITS)) != 0
    }

    /// How many.
    #[must_use]
    pub fn len(self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Their numbers, rising.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..MOST).filter(move |recording| self.includes(*recording))
    }
}

impl FromIterator<usize> for Subset {
    /// Numbers from 256 on are left out.
    fn from_iter<T: IntoIterator<Item = usize>>(recordings: T) -> Self {
        let mut subset = Self::default();
        for recording in recordings.into_iter().filter(|recording| *recording < MOST) {
            subset.0[recording / BITS] |= 1 << (recording % BITS);
        }
        subset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_went_in_is_in_it() {
        let subset: Subset = [3, 64, 255, 256].into_iter().collect();
        assert_eq!(subset.iter().collect::<Vec<_>>(), [3, 64, 255]);
        assert_eq!(subset.len(), 3);
        assert!(!subset.includes(4) && !subset.includes(1000));
        assert!(Subset::default().is_empty());
    }
}
