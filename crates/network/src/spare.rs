//! Memory of arrays that are not used any more.

/// Arrays whose numbers are not used any more, for new ones: memory that comes fresh from the system takes longer than most operators.
#[derive(Debug, Default)]
pub(crate) struct Spare {
    /// Oldest first.
    arrays: Vec<Vec<f32>>,
    /// Numbers in them, and at most.
    held: usize,
    most: usize,
}

/// Shorter arrays are not kept.
const KEPT_MIN: usize = 1 << 12;

impl Spare {
    /// An array of any numbers: of those that fit best the newest, which is likeliest in the cache.
    pub fn take(&mut self, n: usize) -> Vec<f32> {
        let fits = |array: &Vec<f32>| (n..=2 * n).contains(&array.capacity());
        let all = self.arrays.iter().enumerate().rev().filter(|(_, array)| fits(array));
        let mut array = match all.min_by_key(|(_, array)| array.capacity()).map(|(i, _)| i) {
            Some(i) => self.arrays.remove(i),
            None => return vec![if cfg!(test) { f32::NAN } else { 0.0 }; n],
        };
        self.held -= array.capacity();
        array.resize(n, 0.0);
        if cfg!(test) {
            array.fill(f32::NAN);
        }
        array
    }

    /// Keeps an array; the oldest go where there are too many.
    pub fn give(&mut self, array: Vec<f32>) {
        if array.capacity() < KEPT_MIN {
            return;
        }
        self.held += array.capacity();
        self.arrays.push(array);
        while self.held > self.most {
            self.held -= self.arrays.remove(0).capacity();
        }
    }

    /// Tells how many numbers are alive. Twice the most that ever were are kept: with fewer, arrays of other lengths drive out those that the next run
    /// needs.
    pub fn alive(&mut self, numbers: usize) {
        self.most = self.most.max(2 * numbers);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_used_again_and_bounded() {
        let mut spare = Spare::default();
        spare.alive(15_000);
        for n in [10_000, 12_000, 100] {
            spare.give(vec![1.0; n]);
        }
        let array = spare.take(9_000);
        assert!(array.len() == 9_000 && array.capacity() == 10_000 && array.iter().all(|x| x.is_nan()));
        assert_eq!((spare.take(5_000).capacity(), spare.arrays.len()), (5_000, 1));
        spare.give(vec![1.0; 20_000]);
        assert_eq!((spare.held, spare.arrays.len()), (20_000, 1));
        spare.give(vec![1.0; 40_000]);
        assert_eq!((spare.held, spare.arrays.len()), (0, 0));
    }
}
