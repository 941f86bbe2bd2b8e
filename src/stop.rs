//! Work that may be given up. A path among mirrors, or a ray through a million null surfaces, has no end that anyone
//! would wait for: so it asks now and then whether it is to stop.
//!
//! The wish belongs to the work of a thread, not to the program: two pictures in one process stop by themselves. What
//! is given up is of no use, and whoever asked for it finds out by [`is_requested`], which never goes back to false.

use std::sync::atomic::{AtomicBool, Ordering};

use scoped_tls::scoped_thread_local;

scoped_thread_local!(static WISH: AtomicBool);

/// Steps between two looks at the wish: about a millisecond of path segments.
const EVERY: u64 = 1024;

/// Does `work`, which heeds `wish` as far as it stays on this thread.
pub fn heeding<T>(wish: &AtomicBool, work: impl FnOnce() -> T) -> T {
    WISH.set(wish, work)
}

/// Whether what this thread does is to be given up.
pub fn is_requested() -> bool {
    WISH.is_set() && WISH.with(|wish| wish.load(Ordering::Relaxed))
}

/// The same, asked at every thousandth step only: `n_steps` is a count that goes up by one between two calls.
#[inline]
pub fn is_requested_after(n_steps: u64) -> bool {
    n_steps.is_multiple_of(EVERY) && look()
}

#[cold]
#[inline(never)]
fn look() -> bool {
    is_requested()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::{EVERY, heeding, is_requested, is_requested_after};

    #[test]
    fn a_thread_heeds_the_innermost_wish_and_none_outside() {
        let (outer, inner) = (AtomicBool::new(false), AtomicBool::new(true));
        assert!(!is_requested());
        heeding(&outer, || {
            assert!(!is_requested());
            heeding(&inner, || {
                assert!(is_requested());
                assert!(is_requested_after(EVERY) && !is_requested_after(EVERY + 1));
            });
            assert!(!is_requested());
            outer.store(true, Ordering::Relaxed);
            assert!(is_requested());
        });
        assert!(!is_requested());
    }
}
