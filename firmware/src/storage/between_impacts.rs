//! Flash that nobody changes while an impact is open.
//!
//! ```text
//! impact         ────────────┐███████ open ███████┌──────────────
//! wanted         w w w w w e w w w
//! flash           w w w w w e                      w w w           the erase under way ends: 22 ms on the board, a word 0.1 ms
//! ```
//!
//! Each double word and each page is held back by itself, so that a store that an impact comes into goes on after it; and before each, and
//! before each reading, the other tasks have their turn: a flash that blocks while it is busy blocks them no longer than that. An impact that
//! opens between the waiting and the operation is seen too, because the flash asks once more as it begins ([`AskedFlash`]).

use core::future::poll_fn;
use core::task::{Context, Poll};

use embassy_futures::yield_now;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use crate::board::AskedFlash;

/// Knows whether an impact is open.
pub trait ImpactWatch: Sync {
    /// Whether one is open now.
    fn is_open(&self) -> bool;
    /// Whether no impact is open. If one is, it wakes whoever asks when it may be over, and now and then before.
    fn poll_closed(&self, context: &mut Context<'_>) -> Poll<()>;
}

/// Waits until no impact is open.
pub(crate) async fn closed(watch: &dyn ImpactWatch) {
    poll_fn(|context| watch.poll_closed(context)).await;
}

/// A flash, and who says when it must wait; nobody until there are impacts.
pub(super) struct BetweenImpacts<F> {
    pub(super) flash: F,
    pub(super) watch: Option<&'static dyn ImpactWatch>,
}

impl<F> BetweenImpacts<F> {
    /// Waits until an operation may begin, and gives what is to be asked when it does.
    async fn pause(&self) -> impl Fn() -> bool + use<F> {
        self.make_way().await;
        let watch = self.watch;
        if let Some(watch) = watch {
            closed(watch).await;
        }
        move || watch.is_none_or(|watch| !watch.is_open())
    }

    /// Lets the other tasks have their turn; at a start there are none yet.
    async fn make_way(&self) {
        if self.watch.is_some() {
            yield_now().await;
        }
    }
}

impl<F: ErrorType> ErrorType for BetweenImpacts<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> ReadNorFlash for BetweenImpacts<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.make_way().await;
        self.flash.read(offset, bytes).await
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: AskedFlash> NorFlash for BetweenImpacts<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            loop {
                let may = self.pause().await;
                if self.flash.erase_if(page, may).await? {
                    break;
                }
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        for (place, word) in (offset..).step_by(Self::WRITE_SIZE).zip(bytes.chunks(Self::WRITE_SIZE)) {
            loop {
                let may = self.pause().await;
                if self.flash.write_if(place, word, may).await? {
                    break;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use core::cell::RefCell;
    use core::convert::Infallible;
    use core::pin::pin;
    use core::sync::atomic::{AtomicUsize, Ordering};
    use core::task::Waker;
    use std::boxed::Box;
    use std::rc::Rc;
    use std::vec::Vec;

    use super::*;

    /// What was done to a flash: to this offset, with so many bytes or up to that offset.
    #[derive(Clone, Default)]
    struct Recorder(Rc<RefCell<Vec<(u32, usize)>>>);

    impl ErrorType for Recorder {
        type Error = Infallible;
    }

    impl ReadNorFlash for Recorder {
        const READ_SIZE: usize = 1;

        async fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), Infallible> {
            Ok(())
        }

        fn capacity(&self) -> usize {
            8192
        }
    }

    impl NorFlash for Recorder {
        const WRITE_SIZE: usize = 8;
        const ERASE_SIZE: usize = 2048;

        async fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
            self.0.borrow_mut().push((from, to as usize));
            Ok(())
        }

        async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
            self.0.borrow_mut().push((offset, bytes.len()));
            Ok(())
        }
    }

    impl AskedFlash for Recorder {}

    /// Lets so many operations pass before an impact opens.
    struct Passes(AtomicUsize);

    impl ImpactWatch for Passes {
        fn is_open(&self) -> bool {
            false
        }

        fn poll_closed(&self, _: &mut Context<'_>) -> Poll<()> {
            let passed = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
            if passed.is_ok() { Poll::Ready(()) } else { Poll::Pending }
        }
    }

    #[test]
    fn each_word_and_page_waits_for_the_end_of_an_impact() {
        let recorder = Recorder::default();
        let watch: &'static Passes = Box::leak(Box::new(Passes(AtomicUsize::new(0))));
        let mut flash = BetweenImpacts { flash: recorder.clone(), watch: Some(watch) };
        let mut context = Context::from_waker(Waker::noop());
        let mut work = pin!(async {
            flash.write(2048, &[0; 24]).await.unwrap();
            flash.erase(0, 4096).await.unwrap();
            flash.read(0, &mut [0; 8]).await.unwrap();
        });
        let whole = [(2048, 8), (2056, 8), (2064, 8), (0, 2048), (2048, 4096)];
        for done in 0..whole.len() {
            // Others have their turn, it waits, and waits on.
            for _ in 0..3 {
                assert_eq!(work.as_mut().poll(&mut context), Poll::Pending);
            }
            assert_eq!(*recorder.0.borrow(), whole[..done], "nothing more while an impact is open");
            watch.0.store(1, Ordering::Relaxed);
        }
        assert_eq!(work.as_mut().poll(&mut context), Poll::Pending);
        assert_eq!(work.as_mut().poll(&mut context), Poll::Ready(()), "reading makes way and waits for nothing");
        assert_eq!(*recorder.0.borrow(), whole);
    }

    /// Says that no impact is open when it is waited for, and that one is at so many of the following looks.
    struct OpensMeanwhile(AtomicUsize);

    impl ImpactWatch for OpensMeanwhile {
        fn is_open(&self) -> bool {
            self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
        }

        fn poll_closed(&self, _: &mut Context<'_>) -> Poll<()> {
            Poll::Ready(())
        }
    }

    #[test]
    fn an_impact_that_opens_after_the_wait_still_holds_the_operation_back() {
        let recorder = Recorder::default();
        let watch: &'static OpensMeanwhile = Box::leak(Box::new(OpensMeanwhile(AtomicUsize::new(0))));
        let mut flash = BetweenImpacts { flash: recorder.clone(), watch: Some(watch) };
        let mut context = Context::from_waker(Waker::noop());
        let mut work = pin!(async {
            flash.write(2048, &[0; 8]).await.unwrap();
            flash.erase(0, 2048).await.unwrap();
        });
        let whole = [(2048, 8), (0, 2048)];
        for done in 0..whole.len() {
            watch.0.store(3, Ordering::Relaxed);
            while watch.0.load(Ordering::Relaxed) > 0 {
                assert_eq!(work.as_mut().poll(&mut context), Poll::Pending);
                assert_eq!(*recorder.0.borrow(), whole[..done], "begun although an impact had opened");
            }
            assert_eq!(work.as_mut().poll(&mut context).is_ready(), done + 1 == whole.len());
            assert_eq!(*recorder.0.borrow(), whole[..=done], "begun as soon as it might");
        }
    }
}
