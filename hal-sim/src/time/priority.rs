//! Several tasks as one future, the most urgent first.
//!
//! On the board an interrupt-priority executor runs the sampler before everything else; here the order of the
//! list is the priority. A task is polled only when it was woken, and after each poll the search begins again at
//! the most urgent one. The tasks may borrow from the future around them, so that what they share needs no static
//! and goes when the board is reset.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// A task with the name that messages call it by.
pub type Task<'a> = (&'static str, Pin<&'a mut dyn Future<Output = ()>>);

/// More polls of a board's tasks than this at one instant are a loop in which they wake each other.
const POLLS_AT_ONE_INSTANT: u32 = 100_000;

/// Runs the tasks, the first one the most urgent, until one of them ends, which the firmware's never do.
///
/// Gives the name of the task that ended.
///
/// # Panics
/// If the tasks keep waking each other without letting time go on, with the name of the one polled last.
pub async fn by_priority<const N: usize>(tasks: [Task<'_>; N]) -> &'static str {
    ByPriority { tasks, wakers: None }.await
}

struct ByPriority<'a, const N: usize> {
    tasks: [Task<'a>; N],
    wakers: Option<Wakers<N>>,
}

struct Wakers<const N: usize> {
    outer: Waker,
    tasks: [(Arc<Wakened>, Waker); N],
}

impl<const N: usize> Wakers<N> {
    /// Everyone is woken once at the start.
    fn new(outer: &Waker) -> Self {
        let tasks = std::array::from_fn(|_| {
            let flag = Arc::new(Wakened { flag: AtomicBool::new(true), outer: outer.clone() });
            (flag.clone(), Waker::from(flag))
        });
        Self { outer: outer.clone(), tasks }
    }
}

struct Wakened {
    flag: AtomicBool,
    outer: Waker,
}

impl Wake for Wakened {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.flag.store(true, Ordering::Relaxed);
        self.outer.wake_by_ref();
    }
}

impl<const N: usize> Future for ByPriority<'_, N> {
    type Output = &'static str;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let this = &mut *self;
        let wakers = match &mut this.wakers {
            Some(wakers) if wakers.outer.will_wake(context.waker()) => wakers,
            wakers => wakers.insert(Wakers::new(context.waker())),
        };
        for _ in 0..POLLS_AT_ONE_INSTANT {
            // One thread only: the atomics are there because wakers must be `Send`, not for order.
            let woken = wakers.tasks.iter().position(|(task, _)| task.flag.load(Ordering::Relaxed));
            let Some(most_urgent) = woken else { return Poll::Pending };
            let (flag, waker) = &wakers.tasks[most_urgent];
            flag.flag.store(false, Ordering::Relaxed);
            let (name, task) = &mut this.tasks[most_urgent];
            if task.as_mut().poll(&mut Context::from_waker(waker)).is_ready() {
                return Poll::Ready(name);
            }
        }
        let busy: Vec<_> = wakers
            .tasks
            .iter()
            .zip(&this.tasks)
            .filter(|((waker, _), _)| waker.flag.load(Ordering::Relaxed))
            .map(|(_, (name, _))| *name)
            .collect();
        panic!(
            "tasks spin at {} µs: after {POLLS_AT_ONE_INSTANT} polls still awake: {}",
            embassy_time::Instant::now().as_micros(),
            busy.join(", ")
        );
    }
}
